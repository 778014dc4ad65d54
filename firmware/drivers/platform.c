/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "platform.h"

#include <generated/mem.h>
#include <irq.h>
#include <system.h>

#if !defined(CSR_TIMER0_UPTIME_CYCLES_ADDR)
#error "The firmware needs timer0 with its uptime counter: build the SoC with timer_uptime=True."
#endif

/* First byte after the program, from the linker script. */
extern uint8_t _end[];

/* The stack, from the linker script: it grows down from _fstack. */
extern uint32_t _stack_end[], _fstack[];

/* A value that functions hardly leave on the stack, and the words that the marking function itself uses. */
#define STACK_MARK 0x5afe57acu
#define STACK_SPARE 32

uint64_t clock_now(void)
{
    timer0_uptime_latch_write(1);
    return timer0_uptime_cycles_read();
}

uint32_t clock_hz(void)
{
    return CONFIG_CLOCK_FREQUENCY;
}

const char *platform_name(void)
{
    return LITESTEREO_NAME;
}

static void compiler_barrier(void)
{
    __asm__ volatile("" ::: "memory");
}

void memory_to_device(void)
{
    compiler_barrier();
#ifndef CONFIG_CPU_HAS_DMA_BUS
    /* The CPU's data cache writes through; an L2 cache, if there is one, does not. */
    flush_l2_cache();
#endif
}

void memory_from_device(void)
{
#ifndef CONFIG_CPU_HAS_DMA_BUS
    flush_cpu_dcache();
    flush_l2_cache();
#endif
    compiler_barrier();
}

void platform_attach_stereo(void (*handler)(void))
{
    irq_attach(STEREO_INTERRUPT, handler);
    irq_setmask(1u << STEREO_INTERRUPT);
    irq_setie(1);
}

void platform_attach_watchdog(void (*handler)(void))
{
#ifdef WATCHDOG0_INTERRUPT
    irq_attach(WATCHDOG0_INTERRUPT, handler);
    irq_setmask(irq_getmask() | 1u << WATCHDOG0_INTERRUPT);
    irq_setie(1);
#else
    (void)handler;
#endif
}

uint32_t platform_interrupted_at(void)
{
    return (uint32_t)csrr(mepc);
}

void platform_stack_mark(void)
{
    volatile uint32_t *end = (volatile uint32_t *)__builtin_frame_address(0) - STACK_SPARE;

    for (volatile uint32_t *word = _stack_end; word < end; word++) {
        *word = STACK_MARK;
    }
}

size_t platform_stack_used(size_t *size)
{
    const volatile uint32_t *word = _stack_end;

    while (word < _fstack && *word == STACK_MARK) {
        word++;
    }
    *size = (uintptr_t)_fstack - (uintptr_t)_stack_end;
    return (uintptr_t)_fstack - (uintptr_t)word;
}

void *platform_frame_memory(size_t *size)
{
    *size = MAIN_RAM_BASE + MAIN_RAM_SIZE - (uintptr_t)_end;
    return _end;
}
