/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The driver of the screen: black at first, then two pictures alternately, and a shown picture has left the caches. */

#include "fake_screen.h"
#include "generated/mem.h"
#include "generated/soc.h"
#include "litestereo/platform.h"
#include "litestereo/screen.h"
#include "require.h"

enum { PIXELS = VIDEO_FRAMEBUFFER_HRES * VIDEO_FRAMEBUFFER_VRES };

static _Alignas(64) uint8_t memory[2 * PIXELS + 64];
static unsigned flushes;
static uint32_t base_at_flush;

void memory_to_device(void)
{
    flushes++;
    base_at_flush = fake_screen.base;
}

static void fill(uint8_t value)
{
    for (unsigned i = 0; i < sizeof(memory); i++) {
        memory[i] = value;
    }
}

static void test_init(void)
{
    screen_t screen;

    fill(0xaa);
    fake_screen = (fake_screen_t){.base = 0x123400, .enable = 1};
    REQUIRE(screen_bytes() == 2 * PIXELS);
    REQUIRE(screen_init(&screen, NULL) == STATUS_BAD_ARGUMENT && screen.width == 0);
    REQUIRE(screen_init(&screen, memory + 32) == STATUS_BAD_ARGUMENT && screen_hidden(&screen) == NULL);
    screen_show(&screen);
    REQUIRE(fake_screen.base == 0x123400 && fake_screen.off == 0 && flushes == 0);

    REQUIRE(screen_init(&screen, memory) == STATUS_OK);
    REQUIRE(screen.width == VIDEO_FRAMEBUFFER_HRES && screen.height == VIDEO_FRAMEBUFFER_VRES);
    /* Disabled before its memory changes, and enabled once that is black. */
    REQUIRE(fake_screen.off == 1 && fake_screen.enable == 1 && fake_screen.shows == 0);
    REQUIRE(fake_screen.base == (uint32_t)(uintptr_t)memory && flushes == 1);
    for (unsigned i = 0; i < sizeof(memory); i++) {
        REQUIRE(memory[i] == (i < 2 * PIXELS ? 0 : 0xaa));
    }
}

static void test_two_alternate(void)
{
    screen_t screen;

    REQUIRE(screen_init(&screen, memory) == STATUS_OK);
    for (unsigned round = 0; round < 5; round++) {
        uint32_t shown  = fake_screen.base;
        uint8_t *hidden = screen_hidden(&screen);

        REQUIRE((uintptr_t)hidden != shown && hidden == memory + (round % 2 == 0 ? PIXELS : 0));
        hidden[PIXELS - 1] = (uint8_t)(round + 1);
        flushes = 0;
        screen_show(&screen);
        REQUIRE(fake_screen.base == (uint32_t)(uintptr_t)hidden && flushes == 1 && base_at_flush == shown);
        REQUIRE(shown_pixel(VIDEO_FRAMEBUFFER_HRES - 1, VIDEO_FRAMEBUFFER_VRES - 1) == round + 1);
        REQUIRE(fake_screen.off == 2);
    }
}

/* The gateware never gets memory that is not all in main RAM. */
static void test_outside_of_memory(void)
{
    const uint64_t base = (uintptr_t)memory;
    screen_t       screen;

    for (uint32_t missing = 0; missing < 2; missing++) {
        stub_ram_base  = base;
        stub_ram_bytes = 2 * PIXELS - missing;
        REQUIRE(screen_init(&screen, memory) == (missing == 0 ? STATUS_OK : STATUS_BAD_ARGUMENT));
        stub_ram_base  = base + missing;
        stub_ram_bytes = 2 * PIXELS;
        REQUIRE(screen_init(&screen, memory) == (missing == 0 ? STATUS_OK : STATUS_BAD_ARGUMENT));
    }
    stub_ram_base  = 0;
    stub_ram_bytes = 1ull << 32;
}

int main(void)
{
    test_init();
    test_two_alternate();
    test_outside_of_memory();
    return 0;
}
