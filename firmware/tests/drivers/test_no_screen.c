/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The driver of the screen in a SoC that has none: it says so, and touches nothing. */

#define WITHOUT_SCREEN

#include "drivers/screen.c"

#include "mock_csr.h"
#include "require.h"

int main(void)
{
    uint8_t  memory[1] = {7};
    screen_t screen;

    REQUIRE(screen_bytes() == 0);
    REQUIRE(screen_init(&screen, memory) == STATUS_UNSUPPORTED && memory[0] == 7);
    REQUIRE(screen.width == 0 && screen.height == 0 && screen_hidden(&screen) == NULL);
    screen_show(&screen);
    require_all_done();
    return 0;
}
