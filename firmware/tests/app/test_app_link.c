/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* A host's requests to the whole firmware: sessions over UDP, updates, a restart. */

#include "app_fixture.h"
#include "fake_flash.h"
#include "fake_frame_link.h"
#include "generated/csr.h"
#include "litestereo/crc32.h"
#include "litestereo/firmware_tag.h"

static bool send_nothing(const peer_t *peer, const uint8_t *bytes, size_t length)
{
    (void)peer;
    (void)bytes;
    (void)length;
    return true;
}

/* Delivers a message over UDP, and polls the firmware. */
static void post(uint8_t type, uint32_t offset, const uint8_t *payload, uint32_t length)
{
    static const peer_t peer = {.udp = true, .address = 1, .port = 2};
    uint8_t   bytes[PROTOCOL_MESSAGE_MAX];
    message_t message = {
        .version = 1, .type = type, .session = app.session.token, .frame_id = 5, .offset = offset, .length = length,
        .payload = payload,
    };

    fake_frame_link_receive(&peer, bytes, message_build(&message, bytes));
    app_poll(&app);
    app_poll(&app);
}

/* The main loop serves UDP, and chunks that only gateware sees keep a session alive. */
static void test_udp_session(void)
{
    static const uint8_t size[4] = {80, 0, 20, 0}, chunk[PROTOCOL_CHUNK_SIZE];

    fake_frame_link.version = FRAME_LINK_VERSION;
    fake_frame_link.send    = send_nothing;
    boot();
    post(TYPE_HELLO, 0, size, 4);
    post(TYPE_OPEN, 0, size, 4);
    REQUIRE(app.session.open && app.session.peer.udp && app.pool.frame[0].state == FRAME_LOADING);
    for (int round = 0; round < 3; round++) {
        now += 4000000;
        post(TYPE_UPLOAD, 0, chunk, sizeof(chunk));
        now += 20000;
        app_poll(&app);
        REQUIRE(now - app.session.heard < 30000);
    }
    REQUIRE(app.counters.value[COUNTER_CHUNKS_RECEIVED] == 1 && app.counters.value[COUNTER_CHUNKS_REPEATED] == 2);
    post(TYPE_BYE, 0, NULL, 0);
    REQUIRE(!app.session.open && app.pool.frame[0].state == FRAME_EMPTY);
    fake_frame_link.version = 0;
}

/* With UDP, without it, and with a frame link that is not supported or does not stop: the line works in all cases. */
static void test_udp(void)
{
    static const peer_t peer = {.udp = true, .address = 1, .port = 2};

    boot();
    REQUIRE(strstr(type("info\r"), "udp") == NULL && strstr(type("stats\r"), "datagrams_received: 0\r\n") != NULL);
    fake_frame_link.version = FRAME_LINK_VERSION;
    fake_frame_link.send    = send_nothing;
    fake_frame_link.port    = 50000;
    boot();
    REQUIRE(strstr(out, "no UDP") == NULL);
    REQUIRE_TYPE("info\r", "udp: 192.168.1.50 port 50000\r\n");
    fake_frame_link_receive(&peer, (const uint8_t *)"?", 1);
    REQUIRE_TYPE("stats\r", "datagrams_received: 1\r\n");
    REQUIRE_TYPE("stats\r", "datagrams_malformed: 1\r\n");
    fake_frame_link.version = FRAME_LINK_VERSION + 1;
    boot();
    REQUIRE(strstr(out, "no UDP") != NULL && strstr(out, "litestereo> ") != NULL);
    REQUIRE(strstr(type("info\r"), "udp:") == NULL);
    REQUIRE_TYPE("selftest\r", "selftest: passed");
    fake_frame_link.version = 0;
    boot();
    REQUIRE(strstr(out, "no UDP") == NULL);
}

/* While the flash is written, frames are matched and the line is served. */
static void test_update(void)
{
    static uint8_t firmware[5000];
    uint32_t       pixels, matched = 0, answers = 0;

    boot();
    pixels = app.pool.max_pixels;
    REQUIRE(app.session.update == NULL);
    REQUIRE_TYPE("info\r", "flash: none\r\n");
    fake_flash_reset();
    fake_flash.busy_polls = 50;
    boot();
    REQUIRE(app.session.update == &app.update && app.pool.max_pixels < pixels);
    REQUIRE(app.pool.frame[0].memory >= app.update.image + app.flash.image_bytes);
    REQUIRE_TYPE("info\r", "flash: id 0xef4015, 2 images of 262144 bytes\r\n");
    memset(firmware, 7, sizeof(firmware));
    memcpy(firmware + sizeof(firmware) - sizeof(firmware_tag), &firmware_tag, sizeof(firmware_tag));
    REQUIRE(update_begin(&app.update, sizeof(firmware), crc32_update(0, firmware, sizeof(firmware))) == STATUS_OK);
    for (uint32_t offset = 0; offset < sizeof(firmware); offset += 1024) {
        uint32_t length = update_chunk_length(&app.update, offset);

        REQUIRE(update_store(&app.update, offset, firmware + offset, length) == STATUS_OK);
    }
    REQUIRE(update_write(&app.update) == STATUS_OK);
    for (uint32_t polls = 0; update_is_running(&app.update); polls++) {
        REQUIRE(polls < 100000);
        if (frame_pool_next(&app.pool) == NULL && frame_pool_matching(&app.pool) == NULL) {
            for (unsigned slot = 0; slot < FRAME_POOL_SLOTS; slot++) {
                matched += app.pool.frame[slot].state == FRAME_DONE;
                (void)frame_release(&app.pool.frame[slot]);
            }
            load_frame(polls);
        }
        answers += strstr(type("\r"), "litestereo> ") != NULL;
    }
    REQUIRE(app.update.state == UPDATE_DONE && memcmp(fake_flash.contents + 0x100008, firmware, sizeof(firmware)) == 0);
    REQUIRE(matched > 25 && app.counters.value[COUNTER_FRAMES_FAILED] == 0 && answers > 22 * 50);
    fake_flash.present = false;
}

/* A start of the firmware from image 1, which is on trial. */
static void boot_on_trial(void)
{
    uint8_t        firmware[100] = {1};
    trial_record_t record = {.state = TRIAL_RUNNING, .image = 1, .crc32 = crc32_update(0, firmware, sizeof(firmware))};

    fake_flash_reset();
    fake_flash_put_image(0x140000, firmware, sizeof(firmware));
    found_reset = (reset_report_t){0};
    boot();
    REQUIRE(records_write(&app.records, RECORD_TRIAL, &record, sizeof(record)) == STATUS_OK);
    found_reset = (reset_report_t){.cause = RESET_REQUESTED, .image = 2};
    boot();
    REQUIRE(trial_state(&app.trial) == TRIAL_RUNNING && app.trial.here);
    REQUIRE_TYPE("info\r", "newest firmware: on trial\r\n");
    forgotten_starts = 0;
}

static void require_confirmed(void)
{
    for (int polls = 0; trial_status(&app.trial) == STATUS_BUSY; polls++) {
        REQUIRE(polls < 100);
        app_poll(&app);
    }
    REQUIRE(trial_state(&app.trial) == TRIAL_CONFIRMED && forgotten_starts == 1);
    boot();
    REQUIRE_TYPE("info\r", "newest firmware: confirmed\r\n");
    REQUIRE_TYPE("confirm\r", "confirm: no firmware is on trial\r\n");
}

/* A firmware on trial is confirmed by the console, by a session, or by a minute of the main loop. */
static void test_trial(void)
{
    boot_on_trial();
    REQUIRE_TYPE("confirm\r", "confirm: done\r\n");
    require_confirmed();
    boot_on_trial();
    fake_frame_link.version = FRAME_LINK_VERSION;
    fake_frame_link.send    = send_nothing;
    boot();
    for (int polls = 0; polls < 100; polls++) {
        app_poll(&app);
    }
    post(TYPE_STATISTICS, 0, NULL, 0);
    REQUIRE(trial_state(&app.trial) == TRIAL_RUNNING);
    post(TYPE_HELLO, 0, (const uint8_t *)"abcd", 4);
    REQUIRE(trial_state(&app.trial) == TRIAL_CONFIRMED);
    require_confirmed();
    fake_frame_link.version = 0;
    boot_on_trial();
    now += 59900000;
    app_poll(&app);
    REQUIRE(trial_state(&app.trial) == TRIAL_RUNNING);
    now += 200000;
    app_poll(&app);
    REQUIRE(trial_state(&app.trial) == TRIAL_CONFIRMED);
    require_confirmed();
    /* The old firmware, after the new one has failed. */
    boot_on_trial();
    found_reset.image = 1;
    boot();
    REQUIRE_TYPE("info\r", "newest firmware: failed on trial\r\n");
    REQUIRE_TYPE("confirm\r", "confirm: no firmware is on trial\r\n");
    for (int polls = 0; trial_status(&app.trial) == STATUS_BUSY; polls++) {
        REQUIRE(polls < 100);
        app_poll(&app);
    }
    REQUIRE(forgotten_starts == 1);
    found_reset.image = 0;
    boot();
    REQUIRE(trial_state(&app.trial) == TRIAL_FELL_BACK && strcmp(trial_state_name((trial_state_t)9), "?") == 0);
    /* Without a flash nothing is tried. */
    fake_flash.present = false;
    boot();
    REQUIRE_TYPE("confirm\r", "confirm: no firmware is on trial\r\n");
    REQUIRE(trial_record(&app.trial, TRIAL_CONFIRMED, 0, 0) == STATUS_UNSUPPORTED);
    found_reset = (reset_report_t){0};
}

/* The reply to RESTART has a tenth of a second to be sent. */
static void test_restart(void)
{
    uint64_t begin;

    fake_frame_link.version = FRAME_LINK_VERSION;
    fake_frame_link.send    = send_nothing;
    boot();
    post(TYPE_HELLO, 0, (const uint8_t *)"abcd", 4);
    begin = now;
    post(TYPE_RESTART, 0, NULL, 0);
    while (resets == 0) {
        REQUIRE(now - begin < 110000);
        app_poll(&app);
    }
    REQUIRE(now - begin >= 100000 && last_reset == RESET_REQUESTED);
    fake_frame_link.version = 0;
}

int main(void)
{
    make_memory();
    test_udp();
    test_udp_session();
    test_update();
    test_trial();
    test_restart();
    return 0;
}
