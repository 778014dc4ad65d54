/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Calibrations: what is in one, what is refused, folds, and rows. */

#include <string.h>

#include "drawn_calibration.h"
#include "lib/bytes.h"
#include "litestereo/crc32.h"
#include "require.h"

static uint8_t       record[DRAWN_CALIBRATION_MOST];
static calibration_t calibration;

static uint32_t rows_of(void)
{
    row_budget_t budget;
    uint32_t     rows = 1;

    row_budget_begin(&budget, &calibration);
    while (row_budget_step(&budget)) {
        rows++;
    }
    REQUIRE(rows == calibration.height);
    return row_budget_rows(&budget);
}

static uint32_t bits_of(float value)
{
    uint32_t bits;

    memcpy(&bits, &value, sizeof(bits));
    return bits;
}

static void test_fields(void)
{
    uint32_t size = draw_calibration(record, 640, 480, 0, 0);

    REQUIRE(size == 11020);
    REQUIRE(calibration_parse(&calibration, record, size) == STATUS_OK);
    REQUIRE(calibration.width == 640 && calibration.height == 480 && calibration.span == 2);
    REQUIRE(calibration_columns(&calibration) == 41 && calibration_nodes(&calibration) == 31 * 41);
    REQUIRE(strcmp(calibration.left, "left of rig 7") == 0 && strcmp(calibration.right, "right of rig 7") == 0);
    REQUIRE(calibration.record == record && calibration.size == size);
    REQUIRE(calibration.camera.focal_px16 == 6408 && calibration.camera.baseline_um == 60000);
    REQUIRE(calibration.camera.doffs_px16 == -24);
    /* 400.5 x 60 mm over 24 pixels. */
    REQUIRE(depth_mm(&calibration.camera, 24 * 16 + 24) == 1001);
    memset(record + 64, 'x', 32);
    seal_calibration(record, size);
    REQUIRE(calibration_parse(&calibration, record, size) == STATUS_OK && strlen(calibration.left) == 32);
}

/* Numbers of any size: what does not fit is 0. */
static void test_numbers(void)
{
    static const struct {
        uint32_t bits;
        int32_t  doffs;
    } numbers[] = {
        {0, 0}, {0x80000000, 0}, {1, 0}, {0x7f800000, 0}, {0xff800000, 0}, {0x7fc00000, 0}, {0x7f7fffff, 0},
        {0x3d000000, 1}, {0x3cffffff, 0}, {0xbd000000, -1}, {0x4cffffff, 2147483520}, {0x4d000000, 0}, {0x4b7fffff, 268435440},
        {0x4b800000, 268435456}, {0xccffffff, -2147483520}, {0x20000000, 0}, {0x00800000, 0},
    };

    for (size_t i = 0; i < sizeof(numbers) / sizeof(numbers[0]); i++) {
        uint32_t size = draw_calibration(record, 20, 20, 0, 0);

        put_u32(record + 44, numbers[i].bits);
        put_u32(record + 28, numbers[i].bits);
        put_u32(record + 48, bits_of(-0.5f));
        seal_calibration(record, size);
        REQUIRE(calibration_parse(&calibration, record, size) == STATUS_OK);
        if (calibration.camera.doffs_px16 != numbers[i].doffs) {
            fprintf(stderr, "0x%08x: %d\n", (unsigned)numbers[i].bits, (int)calibration.camera.doffs_px16);
        }
        REQUIRE(calibration.camera.doffs_px16 == numbers[i].doffs && calibration.camera.baseline_um == 0);
        REQUIRE(calibration.camera.focal_px16 == (numbers[i].doffs > 0 ? (uint32_t)numbers[i].doffs : 0));
    }
}

static void test_refused(void)
{
    static const struct {
        uint32_t at;
        uint16_t value;
        status_t status;
    } wrong[] = {
        {0, 0, STATUS_HEADER}, {4, 2, STATUS_HEADER}, {6, 64, STATUS_HEADER}, {16, 8, STATUS_HEADER}, {12, 1, STATUS_SIZE},
        {14, 0, STATUS_SIZE}, {12, 66, STATUS_LENGTH}, {14, 65, STATUS_LENGTH}, {8, 5, STATUS_LENGTH},
        {24, 0x1234, STATUS_CRC}, {850, 1, STATUS_CRC}, {700, 1, STATUS_CRC},
    };
    uint32_t size;

    for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
        size = draw_calibration(record, 64, 48, 0, 0);
        REQUIRE(calibration_parse(&calibration, record, size) == STATUS_OK);
        put_u16(record + wrong[i].at, wrong[i].value);
        REQUIRE(calibration_parse(&calibration, record, size) == wrong[i].status);
    }
    /* The whole record has its checksum, its nodes do not. */
    size = draw_calibration(record, 64, 48, 0, 0);
    put_u32(record + 24, 7);
    put_u32(record + size - 4, crc32_update(0, record, size - 4));
    REQUIRE(calibration_parse(&calibration, record, size) == STATUS_CRC);
    size = draw_calibration(record, 17, 17, 0, 0);
    for (uint32_t length = 0; length < size; length++) {
        REQUIRE(calibration_parse(&calibration, record, length) == (length < 848 ? STATUS_HEADER : STATUS_LENGTH));
    }
}

static void test_folds(void)
{
    uint32_t size = draw_calibration(record, 64, 48, 0, 0);

    REQUIRE(calibration_parse(&calibration, record, size) == STATUS_OK && !calibration_folds(&calibration));
    for (unsigned camera = 0; camera < 2; camera++) {
        /* To the left of its neighbour by a step, and a unit less than that. */
        set_calibration_node(record, size, camera, 6, -2048, 0);
        REQUIRE(calibration_folds(&calibration));
        set_calibration_node(record, size, camera, 6, -2047, 0);
        REQUIRE(!calibration_folds(&calibration));
        /* The last node of a row is not beside the first one of the next. */
        set_calibration_node(record, size, camera, 6, 0, 0);
        set_calibration_node(record, size, camera, 5, -2048, 0);
        REQUIRE(!calibration_folds(&calibration));
        set_calibration_node(record, size, camera, 5, 0, -2048);
        REQUIRE(calibration_folds(&calibration));
        set_calibration_node(record, size, camera, 5, 0, -2047);
        REQUIRE(!calibration_folds(&calibration));
        set_calibration_node(record, size, camera, 5, 0, 0);
    }
}

static void test_rows(void)
{
    static const struct { int left, right; uint32_t rows; } shifts[] = {
        {0, 0, 6}, {0, 1, 6}, {1, 0, 6}, {0, 2, 8}, {-3, 0, 8}, {0, 20, 26}, {7, 7, 6}, {-200, 0, 6},
    };

    for (size_t i = 0; i < sizeof(shifts) / sizeof(shifts[0]); i++) {
        uint32_t size = draw_calibration(record, 61, 43, shifts[i].left, shifts[i].right);

        REQUIRE(calibration_parse(&calibration, record, size) == STATUS_OK);
        if (rows_of() != shifts[i].rows) {
            fprintf(stderr, "%d %d: %u rows\n", shifts[i].left, shifts[i].right, (unsigned)rows_of());
        }
        REQUIRE(rows_of() == shifts[i].rows);
    }
}

int main(void)
{
    test_fields();
    test_numbers();
    test_refused();
    test_folds();
    test_rows();
    return 0;
}
