/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Prints the distance of the nearest surface in each of five sectors, a line per frame, with an alarm if one is too
 * near.
 *
 * Where a program for a camera would wait for a pair, this one draws a scene: an obstacle that comes nearer from frame
 * to frame, each time in another sector. */

#include "litestereo/depth.h"
#include "litestereo/platform.h"
#include "litestereo/print.h"
#include "litestereo/sectors.h"
#include "litestereo/stereo.h"
#include "scene.h"

enum { WIDTH = 160, HEIGHT = 80, SECTORS = 5 };

/* Least pixels of an obstacle, and the distance below which there is an alarm. */
enum { LEAST_PIXELS = 60, ALARM_MM = 1200 };

/* Focal length of 200 pixels, cameras 100 mm apart: a disparity of 1 pixel is at 20 m, one of 20 pixels at 1 m.
 * Both principal points are in the same column. */
static const stereo_camera_t camera = {.focal_px16 = 200 * 16, .baseline_um = 100000, .doffs_px16 = 0};

static STEREO_ALIGNED uint8_t left[WIDTH * HEIGHT];
static STEREO_ALIGNED uint8_t right[WIDTH * HEIGHT];
static STEREO_ALIGNED int16_t map[WIDTH * HEIGHT];

static stereo_t stereo;
static serial_t serial;

/* Draws the pair of a frame: a wall at 4 m, and in one of the sectors a box with a disparity of 8 to 24 pixels. */
static void take_pair(const stereo_settings_t *settings, uint32_t frame)
{
    static uint32_t seed = 1;
    uint32_t        first = settings->disparities - 1u + settings->block_size / 2u;
    uint32_t        width = (WIDTH - settings->block_size / 2u - first) / SECTORS;
    scene_box_t     box   = {
        .column    = (uint16_t)(first + width * (frame * 2 % SECTORS) + 2),
        .row       = 20,
        .width     = (uint16_t)(width - 4),
        .height    = 40,
        .disparity = (uint8_t)(8 + 4 * (frame % 5)),
    };

    scene_fill(left, right, settings, 5, &box, 1, &seed);
}

static status_t match(const stereo_job_t *job)
{
    stereo_result_t result;
    status_t        status = stereo_submit(&stereo, job, clock_now());

    return status == STATUS_OK ? stereo_wait(&stereo, &result) : status;
}

static void report(const stereo_settings_t *settings, uint32_t frame)
{
    sector_t sectors[SECTORS];
    unsigned nearest = 0;

    sectors_find(settings, map, LEAST_PIXELS, sectors, SECTORS);
    print(&serial, "obstacle: frame %u:", (unsigned)frame);
    for (unsigned i = 0; i < SECTORS; i++) {
        print(&serial, sectors[i].found ? " %u" : " -", (unsigned)depth_mm(&camera, sectors[i].disparity));
        if (sectors[i].disparity > sectors[nearest].disparity) {
            nearest = i;
        }
    }
    print(&serial, " mm, nearest in sector %u%s\n", nearest,
        depth_mm(&camera, sectors[nearest].disparity) < ALARM_MM ? ", ALARM" : "");
}

int main(void)
{
    stereo_job_t job = {.left = left, .right = right, .map = map};

    serial_init(&serial);
    if (stereo_init(&stereo) != STATUS_OK) {
        print(&serial, "obstacle: no matcher that this program knows\n");
        return 1;
    }
    job.settings             = stereo_settings_default(&stereo.capabilities.limits);
    job.settings.width       = WIDTH;
    job.settings.height      = HEIGHT;
    job.settings.disparities = 32;
    /* Pixels that only one camera sees are mismatched: the left-right check removes them, if it is built. */
    stereo_settings_set(&job.settings, &stereo.capabilities.limits, STEREO_FIELD_DISP12_MAX_DIFF, 1);
    for (uint32_t frame = 0;; frame++) {
        take_pair(&job.settings, frame);
        if (match(&job) == STATUS_OK) {
            report(&job.settings, frame);
        } else {
            print(&serial, "obstacle: frame %u: FAILED\n", (unsigned)frame);
        }
    }
}
