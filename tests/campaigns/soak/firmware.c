/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The unchanged firmware on this computer's processor, with the simulated SoC at its bus. At random it is reset, and
 * made to hang. */

#define _DEFAULT_SOURCE

#include <setjmp.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "app/app.h"
#include "litestereo/platform.h"
#include "litestereo/watchdog.h"
#include "machine.h"

#include <generated/csr.h>
#include <generated/soc.h>

/* Clocks: the watchdog's, and the mean time between resets and between hangs. */
#define WATCHDOG_CLOCKS 200000u
#define RESET_CLOCKS    6000000u
#define HANG_CLOCKS     30000000u

enum { RESET_STRIKES, HANG_STRIKES };

static struct {
    jmp_buf  start;
    void   (*stereo)(void);
    void   (*watchdog)(void);
    app_t   *app;      /* At the begin of memory. */
    uint64_t causes[RESET_MATCHER + 1];
} machine;

static volatile sig_atomic_t stopped;

static void stop(int signal)
{
    (void)signal;
    stopped = 1;
}

/* Functions that the machine calls. */

void machine_stereo_interrupt(void)
{
    if (machine.stereo != NULL) {
        machine.stereo();
    }
}

void machine_watchdog_interrupt(void)
{
    if (machine.watchdog != NULL) {
        machine.watchdog();
    }
}

void machine_restart(void)
{
    longjmp(machine.start, 1);
}

/* The platform. */

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
    return "soak";
}

void memory_to_device(void)
{
}

void memory_from_device(void)
{
}

void platform_attach_stereo(void (*handler)(void))
{
    machine.stereo = handler;
}

void platform_attach_watchdog(void (*handler)(void))
{
    machine.watchdog = handler;
}

uint32_t platform_interrupted_at(void)
{
    return 0;
}

size_t platform_stack_used(size_t *size)
{
    *size = 0;
    return 0;
}

/* The buffers of the program, which follow its variables. */
static app_buffers_t *buffers(void)
{
    return (app_buffers_t *)((MACHINE_MEMORY_BASE + sizeof(app_t) + 4095u) & ~(uintptr_t)4095);
}

void *platform_frame_memory(size_t *size)
{
    uintptr_t begin = ((uintptr_t)(buffers() + 1) + 4095u) & ~(uintptr_t)4095;

    *size = MACHINE_MEMORY_BASE + MACHINE_MEMORY_SIZE - begin;
    return (void *)begin;
}

/* The program, as app/main.c. */

static void handle_stereo(void)
{
    stereo_isr(&machine.app->stereo);
}

static void handle_watchdog(void)
{
    reset_now(RESET_WATCHDOG, 0, 0);
}

static void disturb(void)
{
    if (machine_strikes(RESET_STRIKES, RESET_CLOCKS)) {
        machine_counts.resets++;
        reset_now(RESET_REQUESTED, 0, 0);
    }
    if (machine_strikes(HANG_STRIKES, HANG_CLOCKS)) {
        machine_counts.hangs++;
        for (;;) {
            /* Short runs and register accesses: a reset ends the loop. */
            machine_run(1000);
            (void)clock_now();
        }
    }
}

static void report(void)
{
    printf("{\"clocks\": %llu, \"wire_clocks\": %llu, \"ratios\": %llu, \"stalls\": %llu, \"freezes\": %llu, "
        "\"bus_errors\": %llu, \"resets\": %llu, \"hangs\": %llu",
        (unsigned long long)machine_counts.clocks, (unsigned long long)machine_counts.wire_clocks,
        (unsigned long long)machine_counts.ratios, (unsigned long long)machine_counts.stalls,
        (unsigned long long)machine_counts.freezes, (unsigned long long)machine_counts.bus_errors,
        (unsigned long long)machine_counts.resets, (unsigned long long)machine_counts.hangs);
    for (unsigned cause = 0; cause <= RESET_MATCHER; cause++) {
        printf(", \"starts after %s\": %llu", reset_cause_name(cause), (unsigned long long)machine.causes[cause]);
    }
    puts("}");
}

int main(int argc, char **argv)
{
    struct sigaction on_term = {.sa_handler = stop};

    sigaction(SIGTERM, &on_term, NULL);
    sigaction(SIGINT, &on_term, NULL);
    if (argc != 3) {
        fprintf(stderr, "usage: soak SEED HASTE\n");
        return 2;
    }
    machine_begin(strtoull(argv[1], NULL, 0), (uint32_t)strtoul(argv[2], NULL, 0));
    machine.app = (app_t *)(uintptr_t)MACHINE_MEMORY_BASE;
    setjmp(machine.start);
    machine.stereo   = NULL;
    machine.watchdog = NULL;
    /* The C start-up code clears variables. */
    memset(machine.app, 0, sizeof(*machine.app));
    if (app_init(machine.app, buffers()) != STATUS_OK) {
        fprintf(stderr, "the firmware does not start\n");
        return 1;
    }
    machine.causes[machine.app->reset.cause]++;
    platform_attach_stereo(handle_stereo);
    platform_attach_watchdog(handle_watchdog);
    watchdog_start(WATCHDOG_CLOCKS);
    while (!stopped) {
        app_poll(machine.app);
        disturb();
    }
    report();
    return 0;
}
