/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Measures frames per second: the next frame starts as soon as the interrupt reports the end of the previous one. */

#include "lib/pattern.h"
#include "litestereo/crc32.h"
#include "litestereo/platform.h"
#include "litestereo/print.h"
#include "litestereo/stereo.h"

enum { WIDTH = 320, HEIGHT = 240, FRAMES = 8 };

/* Two maps: one is read or sent while the matcher writes the other. */
static STEREO_ALIGNED uint8_t left[WIDTH * HEIGHT];
static STEREO_ALIGNED uint8_t right[WIDTH * HEIGHT];
static STEREO_ALIGNED int16_t maps[2][WIDTH * HEIGHT];

static stereo_t      stereo;
static serial_t      serial;
static volatile bool ended;

static void handle_interrupt(void)
{
    stereo_isr(&stereo);
}

static void note_end(void *context)
{
    *(volatile bool *)context = true;
}

/* Waits for the interrupt, bounded by the job's budget. A real program does other work meanwhile. */
static status_t wait_for_end(stereo_result_t *result)
{
    status_t status = STATUS_BUSY;

    while (status == STATUS_BUSY) {
        status = stereo_poll(&stereo, clock_now(), result);
    }
    return ended || status != STATUS_OK ? status : STATUS_STATE;
}

static status_t match_all(stereo_job_t *job)
{
    status_t status = STATUS_OK;

    for (unsigned frame = 0; frame < FRAMES && status == STATUS_OK; frame++) {
        stereo_result_t result;

        job->map = maps[frame % 2];
        ended    = false;
        status   = stereo_submit(&stereo, job, clock_now());
        if (status == STATUS_OK) {
            status = wait_for_end(&result);
        }
    }
    return status;
}

int main(void)
{
    stereo_job_t job = {.left = left, .right = right};
    uint64_t     begin;
    uint32_t     clocks;
    status_t     status;

    serial_init(&serial);
    if (stereo_init(&stereo) != STATUS_OK) {
        print(&serial, "throughput: no matcher that this program knows\n");
        return 1;
    }
    platform_attach_stereo(handle_interrupt);
    stereo_on_end(&stereo, note_end, (void *)&ended);
    job.settings        = stereo_settings_default(&stereo.capabilities.limits);
    job.settings.width  = WIDTH;
    job.settings.height = HEIGHT;
    pattern_fill(left, WIDTH * HEIGHT, 1);
    pattern_fill(right, WIDTH * HEIGHT, 2);

    begin  = clock_now();
    status = match_all(&job);
    clocks = (uint32_t)(clock_now() - begin) / FRAMES;
    if (status != STATUS_OK) {
        print(&serial, "throughput: FAILED: %s\n", status_name(status));
        return 1;
    }
    print(&serial, "throughput: width=%d height=%d frames=%d clocks_per_frame=%u matcher_clocks=%u crc32=0x%08x\n",
        WIDTH, HEIGHT, FRAMES, (unsigned)clocks, (unsigned)(stereo.statistics.clocks / FRAMES),
        (unsigned)crc32_update(0, (const uint8_t *)maps[(FRAMES - 1) % 2], sizeof(maps[0])));
    print(&serial, "throughput: %u.%02u clocks per pixel, %u frames per second at %u Hz\n", (unsigned)(clocks
        / (WIDTH * HEIGHT)), (unsigned)(clocks % (WIDTH * HEIGHT) * 100 / (WIDTH * HEIGHT)),
        (unsigned)(clock_hz() / clocks), (unsigned)clock_hz());
    print(&serial, "throughput: end\n");
    return 0;
}
