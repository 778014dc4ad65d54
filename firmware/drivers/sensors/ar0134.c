/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* AR0134, monochrome, on its parallel port: the upper 8 of 12 bits are wired. Registers and values have 16 bits.
 *
 * Sources: R oresat/oresat-prucam-ar013x src/kernel_module/ar0134_ctrl_regs.h and ar013x_sysfs.c; U pH5/ouvrt
 * AR0134 of a tracking camera; A Aptina's Linux driver of the sister AR0130, as sent to linux-media; D data sheet
 * of the AR0130, whose registers R uses for both. The data sheet of the AR0134 was not at hand: all of this is
 * less certain than the other two. */

#include "sensor_model.h"

/* Registers. Sources: U, R, A. */
enum {
    CHIP_VERSION            = 0x3000,
    Y_ADDR_START            = 0x3002,
    X_ADDR_START            = 0x3004,
    Y_ADDR_END              = 0x3006,
    X_ADDR_END              = 0x3008,
    FRAME_LENGTH_LINES      = 0x300a,
    LINE_LENGTH_PCK         = 0x300c,
    COARSE_INTEGRATION_TIME = 0x3012,
    FINE_INTEGRATION_TIME   = 0x3014,
    RESET_REGISTER          = 0x301a,
    VT_PIX_CLK_DIV          = 0x302a,
    VT_SYS_CLK_DIV          = 0x302c,
    PRE_PLL_CLK_DIV         = 0x302e,
    PLL_MULTIPLIER          = 0x3030,
    DIGITAL_BINNING         = 0x3032,
    READ_MODE               = 0x3040,
    GLOBAL_GAIN             = 0x305e,
    EMBEDDED_DATA_CTRL      = 0x3064,
    TEST_PATTERN_MODE       = 0x3070,
    Y_ODD_INC               = 0x30a6,
    DIGITAL_TEST            = 0x30b0,
    COLUMN_CORRECTION       = 0x30d4,
    AE_CTRL                 = 0x3100,
};

/* RESET_REGISTER: reset; parallel port, drivers and lock, without and with bit 2, frames. Sources: R, A. */
enum { RESET = 0x0001, STOPPED = 0x10d8, STREAMING = 0x10dc };

/* Identity. Source: U. */
static const sensor_write_t identity[] = {
    {CHIP_VERSION, 0x2406, 0xffff, 0},
};

/* Set-up. Sources: reset R; PLL A, for 24 MHz to 48 MHz: 24 x 32 / 2 / 2 / 4; COLUMN_CORRECTION, READ_MODE,
 * Y_ODD_INC, AE_CTRL R; EMBEDDED_DATA_CTRL is that of R without the bits 8 and 7, which U names: two rows that are
 * no image. R's values for registers of the analogue part (DAC_LD) are left out. */
static const sensor_write_t set_up[] = {
    {RESET_REGISTER, RESET, 0, 100},
    {RESET_REGISTER, STOPPED, 0, 0},
    {VT_SYS_CLK_DIV, 2, 0xffff, 0},
    {VT_PIX_CLK_DIV, 4, 0xffff, 0},
    {PRE_PLL_CLK_DIV, 2, 0xffff, 0},
    {PLL_MULTIPLIER, 32, 0xffff, 100},
    {COLUMN_CORRECTION, 0xe007, 0xffff, 0},
    {READ_MODE, 0, 0xffff, 0},
    {Y_ODD_INC, 1, 0xffff, 0},
    {AE_CTRL, 0, 0xffff, 0},
    {EMBEDDED_DATA_CTRL, 0x1802, 0x0180, 0},
    {FINE_INTEGRATION_TIME, 0, 0xffff, 0},
};

static const sensor_write_t start[] = {
    {RESET_REGISTER, STREAMING, 0x00dc, 0},
};

/* Rows have 1498 clocks at least, without the bit for shorter ones; 37 rows between frames. Source: U, which has
 * frames of 997 rows as the shortest for 960. */
enum { LEAST_ROW = 1498, LEAST_BLANK_ROWS = 37 };

/* DIGITAL_BINNING: bits 1:0, 2 for both directions. Source: A. */
enum { BINNING_BOTH = 2 };

/* DIGITAL_TEST: bit 7 monochrome (U); bits 5:4 the exponent of the analogue gain (R, D). */
enum { MONOCHROME = 0x0080 };

static sensor_timing_t timing(const sensor_settings_t *settings)
{
    return (sensor_timing_t){
        .least_row_clocks = LEAST_ROW, .most_row_clocks = UINT16_MAX,
        .least_frame_rows = (uint16_t)(settings->height * settings->binning + LEAST_BLANK_ROWS),
        .most_frame_rows  = UINT16_MAX,
    };
}

static size_t write_frame(const sensor_settings_t *settings, sensor_write_t *writes)
{
    const sensor_write_t list[] = {
        {DIGITAL_BINNING, settings->binning == 2 ? BINNING_BOTH : 0, 0x0003, 0},
        {Y_ADDR_START, settings->row, 0xffff, 0},
        {X_ADDR_START, settings->column, 0xffff, 0},
        {Y_ADDR_END, (uint16_t)(settings->row + settings->height * settings->binning - 1), 0xffff, 0},
        {X_ADDR_END, (uint16_t)(settings->column + settings->width * settings->binning - 1), 0xffff, 0},
        {LINE_LENGTH_PCK, settings->row_clocks, 0xffff, 0},
        {FRAME_LENGTH_LINES, settings->frame_rows, 0xffff, 0},
    };

    return sensor_append(writes, list, sizeof(list) / sizeof(list[0]));
}

/* Exposure is in rows, less 410 clocks (D). The gain is 1, 2, 4 or 8 analogue, times a digital one in 32nds (D). */
static size_t write_exposure(const sensor_settings_t *settings, sensor_write_t *writes)
{
    uint16_t             rest;
    unsigned             exponent = sensor_gain_exponent(settings->gain, &rest);
    const sensor_write_t list[]   = {
        {COARSE_INTEGRATION_TIME, settings->exposure, 0xffff, 0},
        {DIGITAL_TEST, (uint16_t)(MONOCHROME | exponent << 4), 0x00b0, 0},
        {GLOBAL_GAIN, (uint16_t)(rest * 2), 0x00ff, 0},
    };

    return sensor_append(writes, list, sizeof(list) / sizeof(list[0]));
}

/* Off: R. Bars: 2 in the menu of Linux drivers/media/i2c/ar0521.c, a later sister with the same register. */
static size_t write_pattern(const sensor_settings_t *settings, sensor_write_t *writes)
{
    const sensor_write_t list[] = {
        {TEST_PATTERN_MODE, settings->pattern ? 2 : 0, 0xffff, 0},
    };

    return sensor_append(writes, list, sizeof(list) / sizeof(list[0]));
}

const sensor_model_t sensor_ar0134 = {
    .name           = "AR0134",
    .address        = 0x10,                 /* Address pin low (R). */
    .register_bytes = 2,
    .value_bytes    = 2,
    .format         = {.two_bytes = false},
    .wake_ms        = 10,                   /* Ours; A waits for 1 to 2 ms. */
    .least_hz       = 24000000,             /* The PLL's oscillator, 16 times as fast, has 384 MHz at least (A). */
    .most_hz        = 37125000,             /* The clock of pixels is 74.25 MHz at most (D). */
    .clocks         = 2,
    .identity       = SENSOR_LIST(identity),
    .set_up         = SENSOR_LIST(set_up),
    .start          = SENSOR_LIST(start),
    .witness        = {RESET_REGISTER, STREAMING, 0x0004, 0}, /* After a reset it sends no frames (R, A). */
    .columns        = 1280,
    .rows           = 960,
    .binnings       = 1 | 2,
    .multiple       = 2,
    .blank_rows     = 100,                  /* Ours. */
    .exposure_rows  = 0,                    /* A frame becomes longer with more (D). */
    .most_gain      = 8 * 31,
    .timing         = timing,
    .frame          = write_frame,
    .expose         = write_exposure,
    .pattern        = write_pattern,
};
