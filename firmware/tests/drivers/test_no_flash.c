/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The flash's driver on a SoC that has none: it says so, and touches nothing. */

#define WITHOUT_FLASH

#include "drivers/flash.c"
#include "drivers/flash_read.c"

#include "require.h"

int main(void)
{
    uint8_t bytes[2] = {0};
    flash_t flash;

    REQUIRE(flash_init(&flash, 1) == STATUS_UNSUPPORTED && flash.images == 0);
    REQUIRE(flash_begin_erase(&flash, 0, 0) == STATUS_UNSUPPORTED);
    REQUIRE(flash_begin_program(&flash, 0, bytes, 1, 0) == STATUS_UNSUPPORTED);
    REQUIRE(flash_poll(&flash, 0) == STATUS_UNSUPPORTED && !flash_is_protected(&flash));
    flash_read(0, bytes, 1);
    REQUIRE(bytes[0] == 0xff && bytes[1] == 0);
    return 0;
}
