/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Requests about the firmware, on a device with a flash and on one without. */

#include <stddef.h>
#include <string.h>

#include "fake_flash.h"
#include "fixture.h"
#include "litestereo/crc32.h"
#include "litestereo/firmware_tag.h"
#include "require.h"

#define LENGTH 2500u
#define ROOM   0x40000u
#define HZ     60000000u

static flash_t  flash;
static records_t records;
static trial_t  trial;
static update_t update;
static _Alignas(8) uint8_t image[ROOM];
static uint8_t  firmware[LENGTH];

static void set_up_with_flash(void)
{
    unsigned seed = 3;

    set_up();
    fake_flash_reset();
    REQUIRE(flash_init(&flash, HZ) == STATUS_OK);
    REQUIRE(records_init(&records, &flash) == STATUS_OK);
    trial_init(&trial, &records, &(reset_report_t){.image = 1}, HZ);
    update_init(&update, &flash, &trial, image);
    session.update = &update;
    for (unsigned i = 0; i < LENGTH; i++) {
        firmware[i] = (uint8_t)next_random(&seed);
    }
    memcpy(firmware + LENGTH - sizeof(firmware_tag), &firmware_tag, sizeof(firmware_tag));
}

static uint8_t announce(uint32_t length, uint32_t crc)
{
    uint8_t payload[8];

    put_u32(payload, length);
    put_u32(payload + 4, crc);
    return ask(TYPE_UPDATE, 0, 0, payload, sizeof(payload));
}

static uint8_t send_chunk(uint32_t offset)
{
    uint32_t rest = LENGTH - offset;

    return ask(TYPE_IMAGE, 0, offset, firmware + offset, rest < 1024 ? rest : 1024);
}

static void load(void)
{
    REQUIRE(announce(LENGTH, crc32_update(0, firmware, LENGTH)) == 0x8e);
    for (uint32_t offset = 0; offset < LENGTH; offset += 1024) {
        REQUIRE(send_chunk(offset) == 0x8f && reply.length == 0);
    }
}

static void require_progress(update_state_t state, update_failure_t failure)
{
    REQUIRE(reply.length == PROTOCOL_PROGRESS_SIZE && reply.payload[0] == state && reply.payload[1] == failure);
    REQUIRE(reply.payload[2] == trial_state(&trial) && reply.payload[3] == 0 && get_u32(reply.payload + 12) == ROOM - 8);
}

static void work(void)
{
    for (int polls = 0; update_is_running(&update); polls++) {
        REQUIRE(polls < 10000);
        trial_poll(&trial, uptime += 1000);
        update_poll(&update, uptime);
    }
}

static void test_without_flash(void)
{
    static const uint8_t types[] = {TYPE_UPDATE, TYPE_IMAGE, TYPE_WRITE, TYPE_PROGRESS};

    set_up();
    hello(1);
    REQUIRE((get_u32(reply.payload + 20) & LITESTEREO_FEATURE_UPDATE) == 0);
    REQUIRE(reply.length == PROTOCOL_CAPABILITIES_SIZE);
    for (unsigned i = 0; i < sizeof(types); i++) {
        ask(types[i], 0, 0, NULL, 0);
        require_error(ERROR_TYPE, types[i]);
    }
}

static void test_update(void)
{
    set_up_with_flash();
    hello(1);
    REQUIRE((get_u32(reply.payload + 20) & LITESTEREO_FEATURE_UPDATE) != 0);
    REQUIRE(reply.length == PROTOCOL_CAPABILITIES_SIZE + PROTOCOL_CAPABILITY_SIZE);
    REQUIRE(get_u16(reply.payload + PROTOCOL_CAPABILITIES_SIZE) == LITESTEREO_CAPABILITY_UPDATE_BYTES);
    REQUIRE(get_u32(reply.payload + PROTOCOL_CAPABILITIES_SIZE + 4) == update_room(&update));
    REQUIRE(ask(TYPE_PROGRESS, 0, 0, NULL, 0) == 0x91);
    require_progress(UPDATE_EMPTY, UPDATE_NO_FAILURE);
    load();
    /* Every request may be repeated. */
    load();
    REQUIRE(ask(TYPE_PROGRESS, 0, 0, NULL, 0) == 0x91);
    require_progress(UPDATE_LOADING, UPDATE_NO_FAILURE);
    REQUIRE(get_u32(reply.payload + 4) == 0 && get_u32(reply.payload + 8) == 3 * (LENGTH + 8));
    for (int copies = 0; copies < 3; copies++) {
        REQUIRE(ask(TYPE_WRITE, 0, 0, NULL, 0) == 0x90);
        require_progress(UPDATE_CHECKING, UPDATE_NO_FAILURE);
    }
    work();
    REQUIRE(ask(TYPE_PROGRESS, 0, 0, NULL, 0) == 0x91);
    require_progress(UPDATE_DONE, UPDATE_NO_FAILURE);
    REQUIRE(get_u32(reply.payload + 4) == get_u32(reply.payload + 8));
    /* There was no good image, so the place does not matter. The new one asks for no trial. */
    REQUIRE(memcmp(fake_flash.contents + 0x100008, firmware, LENGTH) == 0 && reply.payload[2] == TRIAL_CONFIRMED);
    /* A second one is written to the other image, and is to be tried. */
    firmware[LENGTH - sizeof(firmware_tag) + offsetof(firmware_tag_t, flags)] = FIRMWARE_TAG_CONFIRMS;
    load();
    REQUIRE(ask(TYPE_WRITE, 0, 0, NULL, 0) == 0x90);
    work();
    REQUIRE(ask(TYPE_PROGRESS, 0, 0, NULL, 0) == 0x91);
    require_progress(UPDATE_DONE, UPDATE_NO_FAILURE);
    REQUIRE(memcmp(fake_flash.contents + 0x140008, firmware, LENGTH) == 0 && reply.payload[2] == TRIAL_RUNNING);
}

static void test_refused(void)
{
    uint8_t payload[8] = {0};

    set_up_with_flash();
    ask(TYPE_PROGRESS, 0, 0, NULL, 0);
    require_error(ERROR_SESSION, 0);
    hello(1);
    ask(TYPE_UPDATE, 0, 0, payload, 7);
    require_error(ERROR_LENGTH, 8);
    announce(0, 0);
    require_error(ERROR_SIZE, SIZE_TOO_LONG);
    announce(ROOM - 7, 0);
    require_error(ERROR_SIZE, SIZE_TOO_LONG);
    ask(TYPE_WRITE, 0, 0, NULL, 0);
    require_error(ERROR_STATE, UPDATE_EMPTY);
    send_chunk(0);
    require_error(ERROR_STATE, UPDATE_EMPTY);
    load();
    ask(TYPE_IMAGE, 0, 1, firmware, 1024);
    require_error(ERROR_OFFSET, 1);
    ask(TYPE_IMAGE, 0, 2048, firmware, 1024);
    require_error(ERROR_LENGTH, LENGTH - 2048);
    ask(TYPE_WRITE, 0, 0, payload, 1);
    require_error(ERROR_LENGTH, 0);
    REQUIRE(ask(TYPE_WRITE, 0, 0, NULL, 0) == 0x90);
    announce(5, 5);
    require_error(ERROR_STATE, UPDATE_CHECKING);
    send_chunk(0);
    require_error(ERROR_STATE, UPDATE_CHECKING);
    ask(TYPE_RESTART, 0, 0, NULL, 0);
    require_error(ERROR_STATE, UPDATE_CHECKING);
    REQUIRE(!session_wants_restart(&session, uptime + HZ));
}

/* A firmware belongs to its session until it is being written; then it is the device's. */
static void test_ownership(void)
{
    set_up_with_flash();
    hello(1);
    load();
    /* Another host may not even ask for the progress. */
    peer = (peer_t){.udp = true, .address = 1, .port = 2};
    ask(TYPE_PROGRESS, 0, 0, NULL, 0);
    REQUIRE(reply.type == TYPE_ERROR && get_u16(reply.payload) == ERROR_BUSY);
    ask(TYPE_RESTART, 0, 0, NULL, 0);
    REQUIRE(reply.type == TYPE_ERROR && get_u16(reply.payload) == ERROR_BUSY);
    peer = (peer_t){0};
    hello(2);
    REQUIRE(update.state == UPDATE_EMPTY);
    load();
    REQUIRE(ask(TYPE_WRITE, 0, 0, NULL, 0) == 0x90);
    hello(3);
    REQUIRE(update.state == UPDATE_CHECKING);
    REQUIRE(announce(LENGTH, crc32_update(0, firmware, LENGTH)) == 0x8e);
    require_progress(UPDATE_CHECKING, UPDATE_NO_FAILURE);
    work();
    REQUIRE(update.state == UPDATE_DONE);
}

/* After the reply only repeated RESTARTs are answered. */
static void test_restart(void)
{
    for (int with_flash = 0; with_flash < 2; with_flash++) {
        if (with_flash != 0) {
            set_up_with_flash();
        } else {
            set_up();
        }
        hello(1);
        REQUIRE(!session_wants_restart(&session, uptime + 100ull * HZ));
        REQUIRE(ask(TYPE_RESTART, 0, 0, NULL, 0) == 0x92 && reply.length == 0);
        REQUIRE(!session_wants_restart(&session, uptime + HZ / 10 - 1));
        REQUIRE(session_wants_restart(&session, uptime + HZ / 10));
        REQUIRE(!request(TYPE_STATISTICS, 0, 0, NULL, 0));
        REQUIRE(!request(TYPE_HELLO, 0, 0, "abcd", 4));
        /* A copy is answered, and changes nothing. */
        REQUIRE(ask(TYPE_RESTART, 0, 0, NULL, 0) == 0x92);
        REQUIRE(session_wants_restart(&session, uptime - 3000 + HZ / 10));
    }
}

int main(void)
{
    test_without_flash();
    test_update();
    test_refused();
    test_ownership();
    test_restart();
    return 0;
}
