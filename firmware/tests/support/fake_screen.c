/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "fake_screen.h"

#include "generated/csr.h"
#include "generated/soc.h"
#include "require.h"

fake_screen_t fake_screen;

void video_framebuffer_dma_base_write(uint32_t value)
{
    REQUIRE(value % 64 == 0);
    fake_screen.base = value;
    fake_screen.shows += fake_screen.enable;
}

void video_framebuffer_dma_enable_write(uint32_t value)
{
    fake_screen.enable = value;
    fake_screen.off += value == 0;
}

uint8_t shown_pixel(unsigned column, unsigned row)
{
    REQUIRE(fake_screen.enable == 1 && column < VIDEO_FRAMEBUFFER_HRES && row < VIDEO_FRAMEBUFFER_VRES);
    return ((const uint8_t *)(uintptr_t)fake_screen.base)[row * VIDEO_FRAMEBUFFER_HRES + column];
}
