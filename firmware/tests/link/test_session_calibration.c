/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Requests about the calibration, and frames that are rectified, on a device with a flash and on one without. */

#include <stddef.h>
#include <string.h>

#include "drawn_calibration.h"
#include "fake_flash.h"
#include "fake_grids.h"
#include "fixture.h"
#include "litestereo/crc32.h"
#include "require.h"

#define HZ     60000000u
#define WIDTH  61
#define HEIGHT 43

static flash_t         flash;
static records_t       records;
static stereo_t        stereo;
static rectification_t rectification;
static calibrate_t     calibrate;
static uint8_t         memory[CALIBRATE_MEMORY_BYTES];
static uint8_t         record[DRAWN_CALIBRATION_MOST];
static uint32_t        size;

static void start(bool with_flash)
{
    set_up();
    stereo.capabilities.limits.features = LITESTEREO_FEATURE_RECTIFICATION;
    stereo.capabilities.max_width       = 640;
    fake_grids = (fake_grids_t){.rows = 16, .max_height = 480, .in_use = -1};
    REQUIRE(flash_init(&flash, HZ) == STATUS_OK);
    REQUIRE(records_init(&records, &flash) == STATUS_OK);
    REQUIRE(rectification_init(&rectification, &stereo) == STATUS_OK);
    calibrate_init(&calibrate, &rectification, with_flash ? &records : NULL, memory);
    session.calibrate = &calibrate;
    hello(1);
}

static void set_up_with_flash(void)
{
    fake_flash_reset();
    start(true);
}

static uint8_t announce(uint32_t length, uint32_t crc)
{
    uint8_t payload[8];

    put_u32(payload, length);
    put_u32(payload + 4, crc);
    return ask(TYPE_CALIBRATE, 0, 0, payload, sizeof(payload));
}

static uint8_t send_chunk(uint32_t offset)
{
    return ask(TYPE_RECORD, 0, offset, record + offset, size - offset < 1024 ? size - offset : 1024);
}

static uint8_t ask_number(uint8_t type, uint32_t offset, uint32_t number)
{
    uint8_t payload[4];

    put_u32(payload, number);
    return ask(type, 0, offset, payload, sizeof(payload));
}

static void load(int rows)
{
    size = draw_calibration(record, WIDTH, HEIGHT, 0, rows);
    REQUIRE(announce(size, get_u32(record + size - 4)) == 0x93);
    for (uint32_t offset = 0; offset < size; offset += 1024) {
        if (send_chunk(offset) != 0x94) {
            fprintf(stderr, "offset %u of %u: error %u, %u\n", (unsigned)offset, (unsigned)size, get_u16(reply.payload),
                (unsigned)get_u32(reply.payload + 4));
        }
        REQUIRE(reply.type == 0x94 && reply.length == 0);
    }
}

static void work(void)
{
    for (int polls = 0; calibrate_is_running(&calibrate); polls++) {
        REQUIRE(polls < 10000);
        calibrate_poll(&calibrate, uptime += 1000);
    }
}

static void require_state(calibrate_state_t state, calibrate_failure_t failure, bool kept, bool in_use)
{
    REQUIRE(ask(TYPE_CALIBRATION, 0, 0, NULL, 0) == 0x96 && reply.length == PROTOCOL_CALIBRATION_SIZE);
    REQUIRE(reply.payload[0] == state && reply.payload[1] == failure && reply.payload[2] == kept && reply.payload[3] == 0);
    REQUIRE(get_u16(reply.payload + 4) == rectification.rows_needed && get_u16(reply.payload + 6) == 16);
    REQUIRE(get_u16(reply.payload + 8) == (in_use ? WIDTH : 0) && get_u16(reply.payload + 10) == (in_use ? HEIGHT : 0));
    REQUIRE(get_u32(reply.payload + 12) == rectification.calibration.grid_crc);
    REQUIRE(get_u32(reply.payload + 16) == rectification.calibration.size && get_u32(reply.payload + 20) == CALIBRATE_ROOM);
}

static void adopt(int rows, bool keep)
{
    load(rows);
    REQUIRE(ask_number(TYPE_ADOPT, 0, keep) == 0x95 && reply.payload[0] == CALIBRATE_CHECKING);
    work();
}

/* After a restart the calibration in flash is used. */
static void test_keep(void)
{
    uint32_t crc;

    set_up_with_flash();
    require_state(CALIBRATE_EMPTY, 0, false, false);
    adopt(3, true);
    require_state(CALIBRATE_DONE, 0, true, true);
    REQUIRE(get_u32(reply.payload + 12) == get_u32(record + 24) && rectification.rows_needed == 8);
    REQUIRE(fake_grids.size[rectification.grid] == (WIDTH | HEIGHT << 16));
    REQUIRE(fake_grids.node[rectification.grid][1][19] == 3u << 23 && fake_grids.node[rectification.grid][0][19] == 0);
    crc = rectification.calibration.grid_crc;
    start(true);
    REQUIRE(calibrate_recall(&calibrate) == STATUS_OK && rectification.calibration.grid_crc == crc);
    require_state(CALIBRATE_EMPTY, 0, true, true);
    /* Another one, until the next restart. */
    adopt(5, false);
    require_state(CALIBRATE_DONE, 0, false, true);
    REQUIRE(rectification.calibration.grid_crc != crc);
    start(true);
    REQUIRE(calibrate_recall(&calibrate) == STATUS_OK && rectification.calibration.grid_crc == crc);
    REQUIRE(ask(TYPE_FORGET, 0, 0, NULL, 0) == 0x98);
    require_state(CALIBRATE_EMPTY, 0, false, false);
    REQUIRE(fake_grids.size[0] == 0 && fake_grids.size[1] == 0);
    REQUIRE(ask(TYPE_FORGET, 0, 0, NULL, 0) == 0x98);
    start(true);
    REQUIRE(calibrate_recall(&calibrate) == STATUS_NO_RECORD);
}

static void test_recall(void)
{
    set_up_with_flash();
    REQUIRE(ask_number(TYPE_RECALL, 0, 1) == TYPE_ERROR);
    require_error(ERROR_CALIBRATION, 0);
    adopt(1, false);
    for (uint32_t offset = 0; offset < size; offset += 100) {
        uint32_t length = size - offset < 100 ? size - offset : 100;

        REQUIRE(ask_number(TYPE_RECALL, offset, length) == 0x97 && reply.length == length);
        REQUIRE(memcmp(reply.payload, record + offset, length) == 0);
    }
    REQUIRE(ask_number(TYPE_RECALL, 0, 0) == TYPE_ERROR);
    require_error(ERROR_LENGTH, 1024);
    REQUIRE(ask_number(TYPE_RECALL, 0, 1025) == TYPE_ERROR);
    require_error(ERROR_LENGTH, 1024);
    REQUIRE(ask_number(TYPE_RECALL, size, 1) == TYPE_ERROR);
    require_error(ERROR_OFFSET, size);
    REQUIRE(ask_number(TYPE_RECALL, size - 5, 6) == TYPE_ERROR);
    require_error(ERROR_OFFSET, size - 5);
}

/* The calibration in use stays. */
static void test_refused(void)
{
    uint32_t crc;

    set_up_with_flash();
    adopt(1, true);
    crc = rectification.calibration.grid_crc;
    adopt(12, true);
    require_state(CALIBRATE_FAILED, CALIBRATE_ROWS, true, true);
    REQUIRE(get_u16(reply.payload + 4) == 18 && get_u16(reply.payload + 6) == 16);
    /* The same one may be sent again. */
    load(12);
    record[900] ^= 1;
    REQUIRE(send_chunk(0) == 0x94 && ask_number(TYPE_ADOPT, 0, 1) == 0x95);
    require_state(CALIBRATE_FAILED, CALIBRATE_CHECKSUM, true, true);
    put_u32(record + size - 4, crc32_update(0, record, size - 4));
    REQUIRE(announce(size, get_u32(record + size - 4)) == 0x93 && send_chunk(0) == 0x94);
    REQUIRE(ask_number(TYPE_ADOPT, 0, 1) == 0x95);
    require_state(CALIBRATE_FAILED, CALIBRATE_FORMAT, true, true);
    REQUIRE(announce(3, 0) == 0x93 && ask(TYPE_RECORD, 0, 0, record, 3) == 0x94 && ask_number(TYPE_ADOPT, 0, 1) == 0x95);
    require_state(CALIBRATE_FAILED, CALIBRATE_CHECKSUM, true, true);
    size = draw_calibration(record, WIDTH, 481, 0, 0);
    REQUIRE(announce(size, get_u32(record + size - 4)) == 0x93);
    for (uint32_t offset = 0; offset < size; offset += 1024) {
        REQUIRE(send_chunk(offset) == 0x94);
    }
    REQUIRE(ask_number(TYPE_ADOPT, 0, 1) == 0x95);
    require_state(CALIBRATE_FAILED, CALIBRATE_SIZE, true, true);
    load(0);
    set_calibration_node(record, size, 0, 1, -2048, 0);
    REQUIRE(announce(size, get_u32(record + size - 4)) == 0x93 && send_chunk(0) == 0x94);
    REQUIRE(ask_number(TYPE_ADOPT, 0, 0) == 0x95);
    require_state(CALIBRATE_FAILED, CALIBRATE_FOLDED, true, true);
    REQUIRE(rectification.calibration.grid_crc == crc);
    start(true);
    REQUIRE(calibrate_recall(&calibrate) == STATUS_OK && rectification.calibration.grid_crc == crc);
}

static void test_order(void)
{
    set_up_with_flash();
    REQUIRE(ask_number(TYPE_ADOPT, 0, 0) == TYPE_ERROR);
    require_error(ERROR_STATE, CALIBRATE_EMPTY);
    REQUIRE(send_chunk(0) == TYPE_ERROR);
    require_error(ERROR_STATE, CALIBRATE_EMPTY);
    REQUIRE(announce(0, 0) == TYPE_ERROR);
    require_error(ERROR_SIZE, SIZE_TOO_LONG);
    REQUIRE(announce(CALIBRATE_ROOM + 1, 0) == TYPE_ERROR);
    require_error(ERROR_SIZE, SIZE_TOO_LONG);
    REQUIRE(announce(CALIBRATE_ROOM, 0) == 0x93);
    load(1);
    REQUIRE(ask(TYPE_RECORD, 0, 512, record, 1024) == TYPE_ERROR);
    require_error(ERROR_OFFSET, 512);
    REQUIRE(ask(TYPE_RECORD, 0, 0, record, 100) == TYPE_ERROR);
    require_error(ERROR_LENGTH, size < 1024 ? size : 1024);
    REQUIRE(ask_number(TYPE_ADOPT, 0, 1) == 0x95 && reply.payload[0] == CALIBRATE_CHECKING);
    /* Repetitions, and what would disturb the check. */
    REQUIRE(ask_number(TYPE_ADOPT, 0, 1) == 0x95 && reply.payload[0] == CALIBRATE_CHECKING);
    REQUIRE(announce(size, get_u32(record + size - 4)) == 0x93);
    REQUIRE(announce(size, 1) == TYPE_ERROR);
    require_error(ERROR_STATE, CALIBRATE_CHECKING);
    REQUIRE(send_chunk(0) == TYPE_ERROR);
    require_error(ERROR_STATE, CALIBRATE_CHECKING);
    REQUIRE(ask(TYPE_FORGET, 0, 0, NULL, 0) == TYPE_ERROR);
    require_error(ERROR_STATE, CALIBRATE_CHECKING);
    REQUIRE(ask(TYPE_RESTART, 0, 0, NULL, 0) == TYPE_ERROR);
    require_error(ERROR_STATE, CALIBRATE_CHECKING);
    hello(2);
    work();
    require_state(CALIBRATE_DONE, 0, true, true);
    /* A new session discards what the one before has announced. */
    hello(3);
    require_state(CALIBRATE_EMPTY, 0, true, true);
}

static void test_flash(void)
{
    set_up_with_flash();
    fake_flash.protect = true;
    adopt(1, true);
    require_state(CALIBRATE_FAILED, CALIBRATE_FLASH, false, true);
    fake_flash_reset();
    start(false);
    REQUIRE(calibrate_recall(&calibrate) == STATUS_NO_RECORD);
    load(1);
    REQUIRE(ask_number(TYPE_ADOPT, 0, 1) == TYPE_ERROR);
    require_error(ERROR_FLASH, 0);
    REQUIRE(ask_number(TYPE_ADOPT, 0, 0) == 0x95);
    work();
    require_state(CALIBRATE_DONE, 0, false, true);
    REQUIRE(ask(TYPE_FORGET, 0, 0, NULL, 0) == 0x98);
    require_state(CALIBRATE_EMPTY, 0, false, false);
}

static void test_forget_while_another_record_is_written(void)
{
    static const uint8_t other[300] = {1, 2, 3};

    set_up_with_flash();
    adopt(1, true);
    REQUIRE(records_begin_write(&records, RECORD_PROGRAM, other, sizeof(other)) == STATUS_OK);
    REQUIRE(ask(TYPE_FORGET, 0, 0, NULL, 0) == TYPE_ERROR);
    require_error(ERROR_STATE, CALIBRATE_WRITING);
    require_state(CALIBRATE_DONE, 0, true, true);
    while (records_poll(&records, uptime += 1000) == STATUS_BUSY) {
    }
    REQUIRE(ask(TYPE_FORGET, 0, 0, NULL, 0) == 0x98);
    require_state(CALIBRATE_EMPTY, 0, false, false);
}

static void test_without_rectification(void)
{
    static const uint8_t types[] = {TYPE_CALIBRATE, TYPE_RECORD, TYPE_ADOPT, TYPE_CALIBRATION, TYPE_RECALL, TYPE_FORGET};
    uint8_t              payload[8] = {WIDTH, 0, HEIGHT, 0, 1};

    set_up();
    hello(1);
    REQUIRE((get_u32(reply.payload + 20) & LITESTEREO_FEATURE_RECTIFICATION) == 0);
    for (size_t i = 0; i < sizeof(types); i++) {
        REQUIRE(ask(types[i], 0, 0, NULL, 0) == TYPE_ERROR);
        require_error(ERROR_TYPE, types[i]);
    }
    for (payload[4] = 1; payload[4] < 8; payload[4]++) {
        REQUIRE(ask(TYPE_OPEN, 5, 0, payload, 8) == TYPE_ERROR);
        require_error(ERROR_LENGTH, 4);
    }
    payload[4] = 0;
    REQUIRE(ask(TYPE_OPEN, 5, 0, payload, 6) == TYPE_ERROR);
    require_error(ERROR_LENGTH, 4);
}

static uint8_t open_with(uint32_t frame_id, unsigned width, uint16_t options)
{
    uint8_t payload[8] = {0};

    put_u16(payload, (uint16_t)width);
    put_u16(payload + 2, HEIGHT);
    put_u16(payload + 4, options);
    return ask(TYPE_OPEN, frame_id, 0, payload, 8);
}

static void test_open(void)
{
    uint8_t parameters[16] = {PARAMETER_DISPARITIES, 0, 0, 0, 16, 0, 0, 0, PARAMETER_BLOCK_SIZE, 0, 0, 0, 5, 0, 0, 0};

    set_up_with_flash();
    device_info.limits.features |= LITESTEREO_FEATURE_RECTIFICATION;
    hello(2);
    REQUIRE((get_u32(reply.payload + 20) & LITESTEREO_FEATURE_RECTIFICATION) != 0);
    REQUIRE(ask(TYPE_CONFIGURE, 0, 0, parameters, sizeof(parameters)) == 0x82);
    REQUIRE(open_with(5, WIDTH, OPTION_RECTIFIED) == TYPE_ERROR);
    require_error(ERROR_CALIBRATION, 0);
    REQUIRE(open_with(5, WIDTH, 8) == TYPE_ERROR);
    require_error(ERROR_FEATURE, 0);
    adopt(1, false);
    REQUIRE(open_with(5, WIDTH + 1, OPTION_RECTIFIED) == TYPE_ERROR);
    require_error(ERROR_CALIBRATION, WIDTH << 16 | HEIGHT);
    REQUIRE(open_with(5, WIDTH, OPTION_RECTIFIED | OPTION_LEFT) == 0x83);
    REQUIRE(open_with(5, WIDTH, OPTION_RECTIFIED | OPTION_LEFT) == 0x83);
    REQUIRE(open_with(5, WIDTH, OPTION_RECTIFIED) == TYPE_ERROR);
    require_error(ERROR_DUPLICATE, 5);
    REQUIRE(open_with(6, WIDTH, 0) == 0x83);
    REQUIRE(ask(TYPE_STATUS, 6, 0, NULL, 0) == 0x86 && reply.length == PROTOCOL_STATUS_SIZE);
}

static uint8_t read_of(uint32_t offset, uint32_t length)
{
    uint8_t payload[4];

    put_u32(payload, length);
    return ask(TYPE_READ, 5, offset, payload, 4);
}

static void test_images(void)
{
    const uint32_t pitch = 3072, pixels = WIDTH * HEIGHT;
    frame_t       *frame;

    test_open();
    frame = frame_pool_find(&pool, FRAME_OWNER_LINK, 5);
    REQUIRE(frame->pitch == pitch && frame_left_out(frame) == frame->memory + 4 * pitch);
    REQUIRE(frame_right_out(frame) == NULL);
    frame_fill(frame);
    REQUIRE(frame_pool_start(&pool, frame) == STATUS_OK && frame_pool_begin(&pool, frame) == STATUS_OK);
    REQUIRE(ask(TYPE_STATUS, 5, 0, NULL, 0) == 0x86 && reply.length == 24 && get_u32(reply.payload + 20) == 0);
    frame_finish(frame, &(frame_result_t){.flags = FLAG_RECTIFIED | FLAG_FOLDED, .grid_crc = 0x12345678});
    REQUIRE(ask(TYPE_STATUS, 5, 0, NULL, 0) == 0x86 && reply.length == 24 && get_u16(reply.payload + 16) == 5);
    REQUIRE(get_u16(reply.payload + 18) == 0 && get_u32(reply.payload + 20) == 0x12345678);
    for (uint32_t i = 0; i < pixels; i++) {
        frame_left_out(frame)[i] = (uint8_t)(i * 7);
    }
    REQUIRE(read_of(2 * pitch, 1024) == 0x87 && reply.length == 1024 && reply.payload[1000] == (uint8_t)7000);
    REQUIRE(read_of(2 * pitch + pixels - 3, 3) == 0x87 && reply.payload[2] == (uint8_t)((pixels - 1) * 7));
    REQUIRE(read_of(2 * pixels - 2, 2) == 0x87);
    for (unsigned i = 0; i < 5; i++) {
        const uint32_t wrong[][2] = {{2 * pixels - 2, 3}, {2 * pitch - 1, 2}, {2 * pitch + pixels - 3, 4},
            {3 * pitch, 1}, {0xffffffff, 2}};

        REQUIRE(read_of(wrong[i][0], wrong[i][1]) == TYPE_ERROR);
        require_error(ERROR_OFFSET, wrong[i][0]);
    }
}

/* A slot that holds a frame need not hold its images too. */
static void test_too_large(void)
{
    uint8_t payload[8] = {0};

    set_up_with_flash();
    put_u16(payload, 128);
    put_u16(payload + 2, 160);
    REQUIRE(pool.max_pixels >= 128 * 160);
    REQUIRE(ask(TYPE_OPEN, 5, 0, payload, 8) == 0x83);
    payload[4] = OPTION_RIGHT;
    REQUIRE(ask(TYPE_OPEN, 6, 0, payload, 8) == TYPE_ERROR);
    require_error(ERROR_SIZE, SIZE_TOO_LARGE);
    REQUIRE(frame_pool_find(&pool, FRAME_OWNER_LINK, 6) == NULL);
}

int main(void)
{
    test_keep();
    test_recall();
    test_refused();
    test_order();
    test_flash();
    test_forget_while_another_record_is_written();
    test_without_rectification();
    test_open();
    test_images();
    test_too_large();
    return 0;
}
