/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* MT9V034: context A alone, in master mode with simultaneous exposure and readout.
 *
 * Sources: L Linux drivers/media/i2c/mt9v032.c; P PX4-Flow src/modules/flow/mt9v034.c, which quotes data sheet
 * revision G; O OpenMV src/omv/sensors/mt9v0xx_regs.h and mt9v0xx.c; 22, 24, 32 data sheets of the sisters
 * MT9V022, MT9V024, MT9V032. */

#include "sensor_model.h"

/* Registers, 16 bits each. Sources: L, P, O. */
enum {
    CHIP_VERSION         = 0x00,
    COLUMN_START         = 0x01,
    ROW_START            = 0x02,
    WINDOW_HEIGHT        = 0x03,
    WINDOW_WIDTH         = 0x04,
    HORIZONTAL_BLANKING  = 0x05,
    VERTICAL_BLANKING    = 0x06,
    CHIP_CONTROL         = 0x07,
    COARSE_SHUTTER_WIDTH = 0x0b,
    SOFT_RESET           = 0x0c,
    READ_MODE            = 0x0d,
    PIXEL_OPERATION_MODE = 0x0f,
    ADC_COMPANDING_MODE  = 0x1c,
    ANALOG_GAIN          = 0x35,
    ROW_NOISE_CORRECTION = 0x70,
    PIXEL_CLOCK          = 0x72,
    TEST_PATTERN         = 0x7f,
    AEC_AGC_ENABLE       = 0xaf,
    FINE_SHUTTER_WIDTH   = 0xd5,
};

/* Identity. Sources: L, P. */
static const sensor_write_t identity[] = {
    {CHIP_VERSION, 0x1324, 0xffff, 0},
};

/* Set-up. Sources: the reset and CHIP_CONTROL L; the reserved registers P (data sheet, table 8); all others P, O,
 * L. The reserved ones are not read back: no source says that they can be. */
static const sensor_write_t set_up[] = {
    {SOFT_RESET, 1, 0, 1},
    {SOFT_RESET, 0, 0, 1},
    {CHIP_CONTROL, 0, 0, 0},                 /* No frames until the end of the set-up. */
    {0x13, 0x2d2e, 0, 0},                    /* Reserved, */
    {0x20, 0x03c7, 0, 0},                    /* with recommended values. */
    {0x24, 0x001b, 0, 0},
    {0x2b, 0x0003, 0, 0},
    {0x2f, 0x0003, 0, 0},
    {PIXEL_OPERATION_MODE, 0, 0x0103, 0},    /* Linear, monochrome. */
    {ADC_COMPANDING_MODE, 0x0202, 0x0303, 0}, /* 10 bits, linear. */
    /* Data is stable at the clock's rising edge; LINE_VALID and FRAME_VALID are high. */
    {PIXEL_CLOCK, 0, 0x001f, 0},
    {AEC_AGC_ENABLE, 0, 0x0303, 0},
    {FINE_SHUTTER_WIDTH, 0, 0xffff, 0},
};

/* Bits 3, 7 and 8: master, parallel port, exposure while the frame before is read; bit 9 cleared. Sources: L, P, O. */
static const sensor_write_t start[] = {
    {CHIP_CONTROL, 0x0188, 0x03ff, 0},
};

enum { FIRST_COLUMN = 1, FIRST_ROW = 4 };            /* L, P, O */
enum { LEAST_ROW = 690, MOST_BLANKING = 1023 };      /* Clocks. P, L */
enum { LEAST_BLANK_ROWS = 2, MOST_BLANK_ROWS = 32288 }; /* L */

/* READ_MODE of a binning: bits 9:8 are always 3. Sources: P, L. */
enum { READ_1 = 0x0300, READ_2 = 0x0305, READ_4 = 0x030a };

/* TEST_PATTERN: enabled, shades in one direction. With it row noise correction is off, as it would change the pattern.
 * Sources: P, O. */
enum { PATTERN_SHADES = 0x3000, ROW_NOISE_ON = 0x0101 };

/* Columns and rows of the sensor in a window. */
static uint16_t columns(const sensor_settings_t *settings)
{
    return (uint16_t)(settings->width * settings->binning);
}

static uint16_t rows(const sensor_settings_t *settings)
{
    return (uint16_t)(settings->height * settings->binning);
}

/* The least blanking of a row is 61, 71 or 91 clocks, by the binning, and a row has 690 at least. Sources: P, O.
 * The MT9V024 needs 704 (24). */
static sensor_timing_t timing(const sensor_settings_t *settings)
{
    uint16_t blanking = settings->binning == 4 ? 91 : settings->binning == 2 ? 71 : 61;
    uint16_t row      = (uint16_t)(columns(settings) + blanking);

    return (sensor_timing_t){
        .least_row_clocks = row < LEAST_ROW ? LEAST_ROW : row,
        .most_row_clocks  = (uint16_t)(columns(settings) + MOST_BLANKING),
        .least_frame_rows = (uint16_t)(rows(settings) + LEAST_BLANK_ROWS),
        .most_frame_rows  = (uint16_t)(rows(settings) + MOST_BLANK_ROWS),
    };
}

static size_t write_frame(const sensor_settings_t *settings, sensor_write_t *writes)
{
    const sensor_write_t list[] = {
        {READ_MODE, settings->binning == 4 ? READ_4 : settings->binning == 2 ? READ_2 : READ_1, 0x033f, 0},
        {COLUMN_START, (uint16_t)(FIRST_COLUMN + settings->column), 0xffff, 0},
        {ROW_START, (uint16_t)(FIRST_ROW + settings->row), 0xffff, 0},
        {WINDOW_WIDTH, columns(settings), 0xffff, 0},
        {WINDOW_HEIGHT, rows(settings), 0xffff, 0},
        {HORIZONTAL_BLANKING, (uint16_t)(settings->row_clocks - columns(settings)), 0xffff, 0},
        {VERTICAL_BLANKING, (uint16_t)(settings->frame_rows - rows(settings)), 0xffff, 0},
    };

    return sensor_append(writes, list, sizeof(list) / sizeof(list[0]));
}

/* Exposure is in rows, gain in sixteenths of which odd ones above 32 have no effect. Sources: P, 22, 32. */
static size_t write_exposure(const sensor_settings_t *settings, sensor_write_t *writes)
{
    const sensor_write_t list[] = {
        {COARSE_SHUTTER_WIDTH, settings->exposure, 0xffff, 0},
        {ANALOG_GAIN, settings->gain, 0x007f, 0},
    };

    return sensor_append(writes, list, sizeof(list) / sizeof(list[0]));
}

static size_t write_pattern(const sensor_settings_t *settings, sensor_write_t *writes)
{
    const sensor_write_t list[] = {
        {TEST_PATTERN, settings->pattern ? PATTERN_SHADES : 0, 0x7fff, 0},
        {ROW_NOISE_CORRECTION, settings->pattern ? 0 : ROW_NOISE_ON, 0x0303, 0},
    };

    return sensor_append(writes, list, sizeof(list) / sizeof(list[0]));
}

const sensor_model_t sensor_mt9v034 = {
    .name           = "MT9V034",
    .address        = 0x48,                 /* Both address pins low; 0x90 with the bit of direction (24). */
    .register_bytes = 1,
    .value_bytes    = 2,
    .format         = {.two_bytes = false}, /* A byte a clock, bits 9 to 2; LINE_VALID is HREF, FRAME_VALID is VSYNC. */
    .wake_ms        = 1,
    .least_hz       = 20000000,             /* Ours. */
    .most_hz        = 27000000,             /* The data sheets' timing is at 26.6 MHz (24, L). */
    .clocks         = 1,
    .identity       = SENSOR_LIST(identity),
    .set_up         = SENSOR_LIST(set_up),
    .start          = SENSOR_LIST(start),
    .witness        = {AEC_AGC_ENABLE, 0, 0x0303, 0}, /* After a reset both are enabled (L). */
    .columns        = 752,
    .rows           = 480,
    .binnings       = 1 | 2 | 4,
    .multiple       = 1,
    .blank_rows     = 45,                   /* L, O */
    .exposure_rows  = 2,                    /* A frame becomes longer with more (24). */
    .most_gain      = 64,                   /* L, O */
    .timing         = timing,
    .frame          = write_frame,
    .expose         = write_exposure,
    .pattern        = write_pattern,
};
