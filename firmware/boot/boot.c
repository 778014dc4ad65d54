/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The program in ROM that the CPU runs after reset: initialises the main RAM, copies the firmware there from flash, and
 * jumps to it.
 *
 * The flash has room for several images. One with a wrong checksum is not started, nor one that has failed on trial. So a
 * device whose image was written only in part, or does not work, still has another one to start. */

#include "start.h"

#include <generated/csr.h>
#include <generated/mem.h>
#include <generated/soc.h>
#include <liblitedram/sdram.h>
#include <system.h>

#include <stdint.h>
#include <stdio.h>

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
        if (start_load((void *)MAIN_RAM_BASE) < FLASH_IMAGES) {
            flush_cpu_icache();
            flush_cpu_dcache();
            ((void (*)(void))MAIN_RAM_BASE)();
        }
        say("boot: no firmware in flash: make flash\n");
    }
}
