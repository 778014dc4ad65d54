/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The program in ROM that the CPU runs after reset: initialises the main RAM, copies the firmware there from flash, and
 * jumps to it.
 *
 * The flash has room for several images, and the first one with a valid checksum is started. So a device whose image
 * was written only in part still has another one to start. */

#include "image.h"

#include <generated/csr.h>
#include <generated/mem.h>
#include <generated/soc.h>
#include <liblitedram/sdram.h>
#include <system.h>

#include <litestereo/flash.h>

#include <stdint.h>
#include <stdio.h>

enum { LARGEST_BYTES = FLASH_IMAGE_BYTES - FLASH_HEADER_BYTES };

static void say(const char *text)
{
    for (; *text != '\0'; text++) {
        while (uart_txfull_read()) {
        }
        uart_rxtx_write((uint8_t)*text);
    }
}

/* LiteDRAM reports its progress by printf, which is not needed here; libc's is larger than this ROM. */
int printf(const char *format, ...)
{
    (void)format;
    return 0;
}

/* Interrupts stay off, but the start-up code needs the symbol. */
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
