/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* OV7670: YUV with the grey value first, all automatic functions off. The whole array is read at all sizes; the
 * smaller ones are made of it.
 *
 * Sources: L Linux drivers/media/i2c/ov7670.c; O OpenMV src/omv/sensors/ov7670.c; D data sheet 2.0 of the sister
 * OV7675. The tables of Linux for gamma, colour and reserved registers are left out: what they do to grey values
 * was not tried. */

#include "sensor_model.h"

/* Registers, 8 bits each. Sources: L; DM_LNL and DM_LNH D and common headers of the OV7670. */
enum {
    GAIN             = 0x00,
    VREF             = 0x03,
    COM1             = 0x04,
    AECHH            = 0x07,
    PID              = 0x0a,
    VER              = 0x0b,
    COM3             = 0x0c,
    AECH             = 0x10,
    CLKRC            = 0x11,
    COM7             = 0x12,
    COM8             = 0x13,
    COM10            = 0x15,
    HSTART           = 0x17,
    HSTOP            = 0x18,
    VSTART           = 0x19,
    VSTOP            = 0x1a,
    MIDH             = 0x1c,
    MIDL             = 0x1d,
    HREF             = 0x32,
    TSLB             = 0x3a,
    COM13            = 0x3d,
    COM14            = 0x3e,
    COM15            = 0x40,
    DBLV             = 0x6b,
    SCALING_XSC      = 0x70,
    SCALING_YSC      = 0x71,
    SCALING_DCWCTR   = 0x72,
    SCALING_PCLK_DIV = 0x73,
    RGB444           = 0x8c,
    DM_LNL           = 0x92,
    DM_LNH           = 0x93,
    SCALING_PCLK     = 0xa2,
};

/* Identity: product and manufacturer. Source: L. */
static const sensor_write_t identity[] = {
    {PID, 0x76, 0xff, 0},
    {VER, 0x73, 0xff, 0},
    {MIDH, 0x7f, 0xff, 0},
    {MIDL, 0xa2, 0xff, 0},
};

/* Set-up. Source: L, with its bits named in ov7670.c. COM7 is read back here only because nothing is written soon
 * after: Linux warns of that. */
static const sensor_write_t set_up[] = {
    {COM7, 0x80, 0, 5},      /* Reset. */
    {COM7, 0x00, 0xff, 0},   /* VGA, YUV. */
    {CLKRC, 0x40, 0x7f, 0},  /* The master clock as it is: the divider 0 would halve it. */
    {DBLV, 0x0a, 0xff, 0},   /* No PLL. */
    {COM8, 0xc0, 0xff, 0},   /* Automatic gain, white balance, exposure and the band filter off. */
    {COM10, 0x00, 0xff, 0},  /* HREF high in a row, VSYNC high between frames, PCLK always. */
    {TSLB, 0x04, 0xff, 0},   /* These two: YUYV. */
    {COM13, 0xc0, 0xff, 0},
    {COM15, 0xc0, 0xff, 0},  /* Values from 0 to 255. */
    {RGB444, 0x00, 0xff, 0},
};

/* Windows: the middle of the array in all of them, and how it is scaled. Sources: 640 x 480 L, the others O
 * (`qvga_regs` and `qqvga_regs` of its version 70). The test pattern is bit 7 of SCALING_YSC. */
typedef struct {
    uint8_t com3, com14, dcwctr, pclk_div, hstart, hstop, href;
} scaling_t;

static const scaling_t full    = {0x00, 0x00, 0x11, 0xf0, 0x13, 0x01, 0xb6};
static const scaling_t half    = {0x04, 0x19, 0x11, 0xf1, 0x15, 0x04, 0xa4};
static const scaling_t quarter = {0x04, 0x1a, 0x22, 0xf2, 0x16, 0x04, 0xa4};

enum { XSC = 0x3a, YSC = 0x35, YSC_BARS = 0x80 }; /* L */
enum { VSTART_ALL = 0x02, VSTOP_ALL = 0x7a, VREF_ALL = 0x0a, PCLK_DELAY = 0x02 }; /* L, O */

/* A frame has 510 rows of 784 pixels, two clocks each, and dummy rows after them. Sources: D; L, whose frame rates
 * agree. */
enum { ROW_CLOCKS = 2 * 784, FRAME_ROWS = 510, ARRAY_COLUMNS = 640, ARRAY_ROWS = 480 };

static sensor_timing_t timing(const sensor_settings_t *settings)
{
    (void)settings;
    return (sensor_timing_t){
        .least_row_clocks = ROW_CLOCKS, .most_row_clocks = ROW_CLOCKS,
        .least_frame_rows = FRAME_ROWS, .most_frame_rows = UINT16_MAX,
    };
}

static uint8_t scaling_y(const sensor_settings_t *settings)
{
    return settings->pattern ? YSC | YSC_BARS : YSC;
}

static size_t write_frame(const sensor_settings_t *settings, sensor_write_t *writes)
{
    const scaling_t     *scaling = settings->binning == 4 ? &quarter : settings->binning == 2 ? &half : &full;
    uint16_t             dummies = (uint16_t)(settings->frame_rows - FRAME_ROWS);
    const sensor_write_t list[]  = {
        {COM3, scaling->com3, 0xff, 0},
        {COM14, scaling->com14, 0xff, 0},
        {SCALING_XSC, XSC, 0xff, 0},
        {SCALING_YSC, scaling_y(settings), 0xff, 0},
        {SCALING_DCWCTR, scaling->dcwctr, 0xff, 0},
        {SCALING_PCLK_DIV, scaling->pclk_div, 0xff, 0},
        {SCALING_PCLK, PCLK_DELAY, 0x7f, 0},
        {HSTART, scaling->hstart, 0xff, 0},
        {HSTOP, scaling->hstop, 0xff, 0},
        {HREF, scaling->href, 0xff, 0},
        {VSTART, VSTART_ALL, 0xff, 0},
        {VSTOP, VSTOP_ALL, 0xff, 0},
        {VREF, VREF_ALL, 0xff, 0},
        {DM_LNL, dummies & 0xff, 0xff, 0},
        {DM_LNH, dummies >> 8, 0xff, 0},
    };

    return sensor_append(writes, list, sizeof(list) / sizeof(list[0]));
}

/* Exposure is in rows, with 16 bits: AECHH[5:0], AECH, COM1[1:0]. Each of the bits 7 to 4 of GAIN doubles, 3 to 0
 * are sixteenths. Two more bits of the gain are in VREF; Linux found that they do not do what D says, so they stay
 * 0. Sources: L, D. */
static size_t write_exposure(const sensor_settings_t *settings, sensor_write_t *writes)
{
    uint16_t             rest;
    unsigned             exponent = sensor_gain_exponent(settings->gain, &rest);
    const sensor_write_t list[]   = {
        {AECHH, settings->exposure >> 10, 0x3f, 0},
        {AECH, (settings->exposure >> 2) & 0xff, 0xff, 0},
        {COM1, settings->exposure & 3, 0x43, 0},
        {GAIN, (uint16_t)(((1u << exponent) - 1) << 4 | (rest - 16u)), 0xff, 0},
    };

    return sensor_append(writes, list, sizeof(list) / sizeof(list[0]));
}

/* Eight bars. Source: L. */
static size_t write_pattern(const sensor_settings_t *settings, sensor_write_t *writes)
{
    const sensor_write_t list[] = {
        {SCALING_YSC, scaling_y(settings), 0xff, 0},
    };

    return sensor_append(writes, list, sizeof(list) / sizeof(list[0]));
}

const sensor_model_t sensor_ov7670 = {
    .name           = "OV7670",
    .address        = 0x21,                 /* Fixed (L, D). */
    .register_bytes = 1,
    .value_bytes    = 1,
    .sccb           = true,
    .format         = {.two_bytes = true, .grey_second = false, .href_low = false, .vsync_low = true},
    .wake_ms        = 5,                    /* L */
    .least_hz       = 20000000,             /* Ours. */
    .most_hz        = 25000000,             /* Ours: 31.25 frames per second, its data sheet says 30. */
    .clocks         = 1,
    .identity       = SENSOR_LIST(identity),
    .set_up         = SENSOR_LIST(set_up),
    .witness        = {COM8, 0xc0, 0x07, 0}, /* After a reset all three are on (L turns them off first). */
    .columns        = ARRAY_COLUMNS,
    .rows           = ARRAY_ROWS,
    .whole          = true,
    .binnings       = 1 | 2 | 4,
    .multiple       = 1,
    .blank_rows     = FRAME_ROWS - ARRAY_ROWS,
    .exposure_rows  = 0,                    /* Up to all rows of a frame, dummies included (D). */
    .most_gain      = 16 * 31,
    .timing         = timing,
    .frame          = write_frame,
    .expose         = write_exposure,
    .pattern        = write_pattern,
};
