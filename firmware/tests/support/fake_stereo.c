/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "fake_stereo.h"

#include <stdlib.h>
#include <string.h>

#include "fake_grids.h"
#include "fake_rectifier.h"
#include "fake_stream.h"
#include "generated/csr.h"
#include "reference/stereo_bm.h"

enum { CODE_NONE, CODE_CONFIG, CODE_BUS, CODE_ABORTED };
enum { EVENT_DONE = 1, EVENT_ERROR = 2 };

fake_stereo_t fake_stereo = {
    .max_width         = 1024,
    .max_disparities   = 64,
    .max_block_size    = 21,
    .max_prefilter_cap = 63,
    .features          = 0xff,
    .clocks_per_pixel  = 1,
};

static struct {
    uint32_t left, right, map;
    uint32_t out[2];      /* Addresses of the images that come out. */
    stereo_settings_t settings;
    bool     streamed;
    bool     rectified;
    unsigned grid;
    bool     wanted[2];   /* Left and right image come out. */
    uint8_t *images;      /* Both, as the matcher gets them. */
    bool     busy;
    uint32_t code, clocks, first_row_clocks, frames, pending, enable;
    uint64_t ready;
    int16_t *result;
    void   (*handler)(void);
} regs;

static void *memory_at(uint32_t address)
{
    return (void *)(uintptr_t)address;
}

static uint32_t map_size(void)
{
    return 2u * regs.settings.width * regs.settings.height;
}

static void end(uint32_t code)
{
    if (code == CODE_NONE) {
        regs.result[0] = fake_stereo.wrong_pixel ? 0 : regs.result[0];
        memcpy(memory_at(regs.map), regs.result, map_size());
        for (unsigned camera = 0; camera < 2; camera++) {
            if (regs.wanted[camera]) {
                memcpy(memory_at(regs.out[camera]), regs.images + camera * map_size() / 2, map_size() / 2);
            }
        }
        fake_grids.flags = regs.rectified ? fake_stereo.flags : 0;
        regs.frames++;
    }
    fake_grids.in_use = -1;
    free(regs.images);
    regs.images = NULL;
    free(regs.result);
    regs.result   = NULL;
    regs.busy     = false;
    regs.code     = code;
    regs.pending |= code == CODE_NONE ? EVENT_DONE : EVENT_ERROR;
}

/* The images that the matcher gets. */
static void make_images(const uint8_t *left, const uint8_t *right)
{
    const uint8_t *raw[2] = {left, right};
    uint32_t       pixels = map_size() / 2;

    regs.images = malloc(map_size());
    for (unsigned camera = 0; camera < 2; camera++) {
        if (regs.rectified) {
            fake_rectify(regs.grid, camera, regs.settings.width, regs.settings.height, raw[camera],
                regs.images + camera * pixels);
        } else {
            memcpy(regs.images + camera * pixels, raw[camera], pixels);
        }
    }
}

static void match(const uint8_t *left, const uint8_t *right)
{
    uint32_t *scratch = malloc(4 * stereo_bm_scratch_words(&regs.settings));

    make_images(left, right);
    left  = regs.images;
    right = regs.images + map_size() / 2;
    /* Computing on this computer takes no time of the device. */
    regs.ready  = fake_stereo.clock() + regs.clocks;
    regs.result = malloc(map_size());
    stereo_bm(&regs.settings, left, right, regs.result, scratch);
    free(scratch);
}

/* Matches a streamed frame once its pixels have arrived. The parts of its map are sent while the clock says it is
 * matched. */
static void match_stream(void)
{
    const uint8_t *pairs = fake_stream_pairs();
    uint32_t       pixels = map_size() / 2;
    uint8_t       *left;

    if (pairs == NULL) {
        return;
    }
    left = malloc(2 * pixels);
    for (uint32_t i = 0; i < pixels; i++) {
        left[i]          = pairs[2 * i];
        left[pixels + i] = pairs[2 * i + 1];
    }
    match(left, left + pixels);
    free(left);
    fake_stream_map(regs.result, map_size());
}

static void start(void)
{
    stereo_limits_t limits = {fake_stereo.max_disparities, 5, fake_stereo.max_block_size, fake_stereo.features,
        fake_stereo.max_prefilter_cap};

    if (regs.busy) {
        return;
    }
    regs.busy             = true;
    regs.clocks           = (uint32_t)regs.settings.width * regs.settings.height * fake_stereo.clocks_per_pixel;
    regs.first_row_clocks = regs.settings.width * (regs.settings.block_size / 2u + 1) * fake_stereo.clocks_per_pixel;
    if (stereo_settings_check(&regs.settings, &limits) != STEREO_FIELD_NONE || regs.settings.height > 4095
        || regs.settings.width > fake_stereo.max_width
        || (regs.rectified && fake_grids.size[regs.grid] != (regs.settings.width | (uint32_t)regs.settings.height << 16))) {
        end(CODE_CONFIG);
        return;
    }
    fake_grids.in_use = regs.rectified ? (int)regs.grid : -1;
    /* The images are read now and the map is written at the end: the firmware must allow for both. */
    if (!regs.streamed) {
        match(memory_at(regs.left), memory_at(regs.right));
    }
}

void fake_stereo_attach(void (*handler)(void))
{
    regs.handler = handler;
}

void fake_stereo_advance(void)
{
    if (regs.busy && regs.result == NULL) {
        match_stream();
    }
    if (regs.busy && regs.result != NULL && !fake_stereo.hang && fake_stereo.clock() >= regs.ready) {
        end(fake_stereo.bus_error ? CODE_BUS : CODE_NONE);
    }
    if ((regs.pending & regs.enable) != 0 && regs.handler != NULL) {
        regs.handler();
    }
}

void stereo_control_write(uint8_t value)
{
    if ((value & 1) != 0) {
        start();
    }
    if ((value & 2) != 0 && regs.busy && fake_stereo.deaf > 0) {
        fake_stereo.deaf--;
    } else if ((value & 2) != 0 && regs.busy && !fake_stereo.stuck) {
        end(CODE_ABORTED);
    }
}

void stereo_left_base_write(uint32_t value)         { regs.left = value; }
void stereo_right_base_write(uint32_t value)        { regs.right = value; }
void stereo_disparity_base_write(uint32_t value)    { regs.map = value; }
void stereo_width_write(uint16_t value)             { regs.settings.width = value; }
void stereo_height_write(uint16_t value)            { regs.settings.height = value; }
void stereo_disparities_write(uint16_t value)       { regs.settings.disparities = value; }
void stereo_block_size_write(uint8_t value)         { regs.settings.block_size = value; }
void stereo_min_disparity_write(uint8_t value)      { regs.settings.min_disparity = value; }
void stereo_prefilter_cap_write(uint8_t value)      { regs.settings.prefilter_cap = value; }
void stereo_texture_threshold_write(uint32_t value) { regs.settings.texture_threshold = value; }
void stereo_uniqueness_ratio_write(uint8_t value)   { regs.settings.uniqueness_ratio = value; }
void stereo_disp12_max_diff_write(uint8_t value)    { regs.settings.disp12_max_diff = value == 255 ? -1 : value; }
void stereo_ev_pending_write(uint32_t value)        { regs.pending &= ~value; }
void stereo_ev_enable_write(uint32_t value)         { regs.enable = value; }
void stereo_left_out_base_write(uint32_t value)     { regs.out[0] = value; }
void stereo_right_out_base_write(uint32_t value)    { regs.out[1] = value; }

void stereo_options_write(uint8_t value)
{
    regs.settings.xsobel   = (value & 1) != 0;
    regs.settings.subpixel = (value & 2) != 0;
    regs.settings.median   = (value & 4) != 0;
    regs.streamed          = (value & 8) != 0;
    regs.rectified         = (value & 16) != 0;
    regs.grid              = (value & 32) != 0;
    regs.wanted[0]         = (value & 64) != 0;
    regs.wanted[1]         = (value & 128) != 0;
}

uint32_t stereo_status_read(void)           { return regs.busy | regs.code << 8; }
uint32_t stereo_clocks_read(void)           { return regs.clocks; }
uint32_t stereo_first_row_clocks_read(void) { return regs.first_row_clocks; }
uint32_t stereo_frames_read(void)           { return regs.frames; }
uint32_t stereo_version_read(void)          { return 0x0004; }
uint32_t stereo_max_width_read(void)        { return fake_stereo.max_width; }
uint32_t stereo_max_disparities_read(void)  { return fake_stereo.max_disparities; }
uint32_t stereo_block_sizes_read(void)      { return 5 | fake_stereo.max_block_size << 8; }
uint32_t stereo_max_prefilter_cap_read(void) { return fake_stereo.max_prefilter_cap; }
uint32_t stereo_features_read(void)         { return fake_stereo.features; }
uint32_t stereo_dma_alignment_read(void)    { return 16; }
uint32_t stereo_ev_pending_read(void)       { return regs.pending; }
