/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The calibration of a device: any sequence of announcements, chunks, adoptions, polls and erases, of drawn, damaged
 * and made-up records, with frames under way, restarts and power failures, against a model of what is in use and in
 * flash. */

#include <stdbool.h>
#include <string.h>

#include "drawn_calibration.h"
#include "fake_flash.h"
#include "fake_grids.h"
#include "fuzz.h"
#include "lib/bytes.h"
#include "link/protocol/protocol.h"
#include "link/update/calibrate.h"
#include "litestereo/crc32.h"
#include "litestereo/platform.h"

#define HZ         1000000u
#define MAX_WIDTH  72
#define MAX_HEIGHT 48
#define ROWS       24
#define MOST_STEPS 48u
#define MOST_BYTES 2048u

/* Bytes of a record; none if its size is 0. */
typedef struct {
    uint32_t size;
    uint8_t  bytes[MOST_BYTES];
} content_t;

static const stereo_t stereo = {
    .capabilities = {.max_width = MAX_WIDTH, .limits = {.features = LITESTEREO_FEATURE_RECTIFICATION}}};

static flash_t         flash;
static records_t       records;
static rectification_t rectification;
static calibrate_t     calibrate;
static uint8_t         memory[CALIBRATE_MEMORY_BYTES];
static uint64_t        now;
static content_t       sent;      /* The record that the host sends. */
static content_t       adopted;   /* What was announced when it was adopted. */
static content_t       in_use;    /* The record in use. */
static content_t       kept;      /* The record in flash; */
static content_t       replacing; /* until a write or an erase has ended, that may be there as well. */
static bool            changing;  /* There is such a write or erase. */

uint64_t clock_now(void)
{
    return now += 1000;
}

static bool is_same(const content_t *one, const content_t *other)
{
    return one->size == other->size && memcmp(one->bytes, other->bytes, one->size) == 0;
}

/* Starts the device: it uses the record in flash, which is the one before the last change, or the one after it. */
static void start(void)
{
    static content_t found;
    status_t         status;

    fake_flash_power_up();
    fake_grids.in_use = -1;
    HOLDS(flash_init(&flash, HZ) == STATUS_OK && records_init(&records, &flash) == STATUS_OK);
    HOLDS(rectification_init(&rectification, &stereo) == STATUS_OK);
    calibrate_init(&calibrate, &rectification, &records, memory);
    status = calibrate_recall(&calibrate);
    HOLDS(status == STATUS_OK || status == STATUS_NO_RECORD);
    HOLDS((status == STATUS_OK) == (rectification.calibration.width != 0));
    found.size = rectification.calibration.size;
    if (found.size > 0) {
        HOLDS(found.size <= MOST_BYTES);
        memcpy(found.bytes, rectification.calibration.record, found.size);
    }
    HOLDS(is_same(&found, &kept) || (changing && is_same(&found, &replacing)));
    kept     = found;
    in_use   = found;
    changing = false;
}

/* Draws the next record: a good one, one that folds over or needs too many rows, a damaged one, or no record at all. */
static void draw(input_t *input)
{
    uint32_t kind   = take(input) % 8;
    uint16_t width  = (uint16_t)(2 + take(input) % MAX_WIDTH);
    uint16_t height = (uint16_t)(2 + take(input) % MAX_HEIGHT);
    int      rows   = take(input) % 32;

    sent.size = draw_calibration(sent.bytes, width, height, 0, rows);
    if (kind >= 2 && kind < 5) {
        for (unsigned changes = take(input) % 4; changes > 0; changes--) {
            unsigned camera = take(input) % 2, node = take(input) % 8;
            int16_t  column = (int16_t)(take_u32(input) >> 16), row = (int16_t)(take(input) << 4);

            set_calibration_node(sent.bytes, sent.size, camera, node, column, row);
        }
    } else if (kind == 5) {
        sent.bytes[take(input) % CALIBRATION_HEADER_BYTES] ^= take(input);
        put_u32(sent.bytes + sent.size - 4, crc32_update(0, sent.bytes, sent.size - 4));
    } else if (kind == 6) {
        sent.bytes[(take(input) * 16u + take(input)) % sent.size] ^= take(input);
    } else if (kind == 7) {
        sent.size = take(input) * 8u % (sent.size + 1);
    }
}

static void announce(input_t *input)
{
    bool     running = calibrate_is_running(&calibrate);
    uint32_t crc;
    status_t status;

    draw(input);
    crc    = sent.size >= 4 ? get_u32(sent.bytes + sent.size - 4) : 0;
    status = calibrate_begin(&calibrate, sent.size, crc);
    HOLDS(status == STATUS_OK || status == (running ? STATUS_STATE : STATUS_SIZE) || sent.size == 0);
    if (calibrate.state != CALIBRATE_LOADING) {
        return;
    }
    for (uint32_t offset = 0; offset < sent.size; offset += PROTOCOL_CHUNK_SIZE) {
        uint32_t length = calibrate_chunk_length(&calibrate, offset);
        uint8_t  how    = take(input);

        HOLDS(calibrate_store(&calibrate, offset, sent.bytes + offset, length + 1) == STATUS_LENGTH);
        HOLDS(calibrate_store(&calibrate, offset + 1, sent.bytes, length) == STATUS_OFFSET);
        if (how != 1) {
            HOLDS(calibrate_store(&calibrate, offset, sent.bytes + offset, length) == STATUS_OK);
        }
    }
}

static void adopt(bool keep)
{
    calibrate_state_t before = calibrate.state;

    HOLDS((calibrate_adopt(&calibrate, keep) == STATUS_OK) == (before != CALIBRATE_EMPTY));
    if (before == CALIBRATE_LOADING && calibrate.state == CALIBRATE_CHECKING) {
        adopted.size = calibrate.length;
        HOLDS(adopted.size <= MOST_BYTES);
        memcpy(adopted.bytes, calibrate.memory[calibrate.announced], adopted.size);
    }
}

static void poll(void)
{
    calibrate_state_t before = calibrate.state;

    calibrate_poll(&calibrate, clock_now());
    if (before == CALIBRATE_CHECKING && (calibrate.state == CALIBRATE_WRITING || calibrate.state == CALIBRATE_DONE)) {
        in_use = adopted;
    }
    if (calibrate.state == CALIBRATE_WRITING) {
        replacing = in_use;
        changing  = true;
    }
    if (before == CALIBRATE_WRITING && calibrate.state != CALIBRATE_WRITING) {
        HOLDS(fake_flash.dead || (calibrate.state == CALIBRATE_DONE && calibrate.kept));
        if (!fake_flash.dead) {
            kept     = replacing;
            changing = false;
        }
    }
}

static void forget(void)
{
    bool     running = calibrate_is_running(&calibrate);
    status_t status  = calibrate_forget(&calibrate);

    HOLDS((status == STATUS_STATE) == running);
    if (!running) {
        in_use.size    = 0;
        replacing.size = 0;
        changing       = fake_flash.dead;
        if (!fake_flash.dead) {
            HOLDS(status == STATUS_OK);
            kept.size = 0;
        }
    }
}

/* What is in use is a whole record that passed the check, and the gateware has its grids. */
static void check(void)
{
    const calibration_t *calibration = &rectification.calibration;
    calibration_t        again;

    HOLDS((calibration->width != 0) == (in_use.size != 0));
    if (calibration->width == 0) {
        return;
    }
#ifdef PLANTED_FAULT
    /* The planted fault: something else writes to the memory of a calibration that is kept. */
    if (calibrate.kept) {
        ((uint8_t *)calibration->record)[100] ^= 1;
    }
#endif
    HOLDS(calibration->size == in_use.size && memcmp(calibration->record, in_use.bytes, in_use.size) == 0);
    HOLDS(calibration_parse(&again, in_use.bytes, in_use.size) == STATUS_OK && !calibration_folds(&again));
    HOLDS(again.width <= MAX_WIDTH && again.height <= fake_grids.max_height);
    HOLDS(fake_grids.size[rectification.grid] == (again.width | (uint32_t)again.height << 16));
    for (unsigned camera = 0; camera < 2; camera++) {
        for (uint32_t node = 0; node < calibration_nodes(&again); node++) {
            HOLDS(fake_grids.node[rectification.grid][camera][node]
                == ((uint16_t)calibration_node(&again, camera, node, 0)
                    | (uint32_t)(uint16_t)calibration_node(&again, camera, node, 1) << 16));
        }
    }
}

static void step(input_t *input)
{
    uint8_t what = take(input);

    switch (what % 8) {
    case 0:
    case 1:
        announce(input);
        break;
    case 2:
        adopt(what / 8 % 4 != 0);
        break;
    case 3:
    case 4:
        for (unsigned polls = what / 8 * 8; polls > 0; polls--) {
            poll();
        }
        break;
    case 5:
        forget();
        break;
    case 6:
        /* A frame with the grid in use begins, or the frame ends. */
        fake_grids.in_use = what / 8 % 2 != 0 && rectification.calibration.width != 0 ? rectification.grid : -1;
        break;
    default:
        if (what / 8 < 8) {
            fake_flash.operations_to_cut = what / 8;
            fake_flash.cut               = (enum fake_flash_cut)(take(input) % 3);
            fake_flash.random            = take(input) + 1u;
        } else if (what / 8 < 16) {
            calibrate_discard(&calibrate);
        } else {
            start();
        }
        break;
    }
    if (fake_flash.dead) {
        start();
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    input_t input = {data, size};

    fake_flash_reset();
    fake_flash.busy_polls = 0;
    fake_grids = (fake_grids_t){.rows = ROWS, .max_height = MAX_HEIGHT, .in_use = -1};
    kept.size  = replacing.size = in_use.size = 0;
    changing   = false;
    start();
    for (unsigned steps = 0; input.length > 0 && steps < MOST_STEPS; steps++) {
        step(&input);
        check();
    }
    fake_flash.operations_to_cut = 0;
    start();
    check();
    return 0;
}
