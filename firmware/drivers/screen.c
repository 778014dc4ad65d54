/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "litestereo/screen.h"

#include <string.h>

#include "dma_memory.h"
#include "platform.h"

enum { WIDTH = VIDEO_FRAMEBUFFER_HRES, HEIGHT = VIDEO_FRAMEBUFFER_VRES, PICTURE_BYTES = WIDTH * HEIGHT };

/* Bytes; more than any memory port needs. */
enum { ALIGNMENT = 64 };

_Static_assert(VIDEO_FRAMEBUFFER_DEPTH == 8, "pixels are bytes");
_Static_assert(WIDTH % 4 == 0 && PICTURE_BYTES % ALIGNMENT == 0, "both pictures are aligned");

/* The gateware uses the new address from the next word on, so during one refresh the screen may show parts of both. */
static void show(const uint8_t *picture)
{
    memory_to_device();
    video_framebuffer_dma_base_write((uint32_t)(uintptr_t)picture);
}

size_t screen_bytes(void)
{
    return 2 * PICTURE_BYTES;
}

status_t screen_init(screen_t *screen, uint8_t *memory)
{
    *screen = (screen_t){0};
    if (PICTURE_BYTES == 0) {
        return STATUS_UNSUPPORTED;
    }
    if (!dma_reaches(memory, PICTURE_BYTES + PICTURE_BYTES, ALIGNMENT)) {
        return STATUS_BAD_ARGUMENT;
    }
    /* After a restart of the firmware alone the gateware may still read from the old address. */
    video_framebuffer_dma_enable_write(0);
    memset(memory, 0, screen_bytes());
    *screen = (screen_t){.width = WIDTH, .height = HEIGHT, .pictures = memory, .hidden = 1};
    show(memory);
    video_framebuffer_dma_enable_write(1);
    return STATUS_OK;
}

uint8_t *screen_hidden(const screen_t *screen)
{
    return screen->width != 0 ? screen->pictures + screen->hidden * PICTURE_BYTES : NULL;
}

void screen_show(screen_t *screen)
{
    if (screen->width != 0) {
        show(screen_hidden(screen));
        screen->hidden ^= 1;
    }
}
