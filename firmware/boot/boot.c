/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* What the CPU runs after reset, from ROM: starts the main RAM, copies the firmware there from flash, and jumps to it.
 *
 * The flash has room for several images. The first one whose checksum is right is started, so that one that was written
 * halfway leaves the device with the one before. */

#include "image.h"

#include <generated/csr.h>
#include <generated/mem.h>
#include <generated/soc.h>
#include <liblitedram/sdram.h>
#include <system.h>

#include <stdint.h>
#include <stdio.h>

/* An image has eight bytes before the firmware. */
enum { LARGEST_BYTES = FLASH_IMAGE_BYTES - 8 };

static void say(const char *text)
{
    for (; *text != '\0'; text++) {
        while (uart_txfull_read()) {
        }
        uart_rxtx_write((uint8_t)*text);
    }
}

/* LiteDRAM's start reports its progress; nobody needs it, and libc's printf is larger than this ROM. */
int printf(const char *format, ...)
{
    (void)format;
    return 0;
}

/* Interrupts stay off. */
void isr(void);

void isr(void)
{
}

int main(void)
{
    if (!sdram_init()) {
        say("boot: the main memory does not answer\n");
        for (;;) {
        }
    }
    for (;;) {
        for (uint32_t image = 0; image < FLASH_IMAGES; image++) {
            if (image_load(FLASH_IMAGES_OFFSET + image * FLASH_IMAGE_BYTES, (void *)MAIN_RAM_BASE, LARGEST_BYTES) > 0) {
                flush_cpu_icache();
                flush_cpu_dcache();
                ((void (*)(void))MAIN_RAM_BASE)();
            }
        }
        say("boot: no firmware in flash: make flash\n");
    }
}
