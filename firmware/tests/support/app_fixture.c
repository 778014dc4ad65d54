/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#define _DEFAULT_SOURCE

#include "app_fixture.h"

#include <sys/mman.h>

#include "fake_frame_link.h"
#include "fake_screen.h"
#include "generated/csr.h"
#include "libbase/uart.h"
#include "litestereo/platform.h"

/* Frame memory below 4 GiB, as the registers require, with an inaccessible page on either side. */
#define MEMORY_BASE 0x50000000u
#define MEMORY_SIZE (1u << 20)
#define PAGE        4096u

app_t         app;
app_buffers_t app_buffers;
char          out[1 << 16];
uint64_t      now;
size_t        frame_memory = MEMORY_SIZE;

reset_report_t found_reset;
reset_cause_t  last_reset;
unsigned       resets;
unsigned       forgotten_starts;

static uint8_t       *memory;
static const uint8_t *line;
static size_t         line_length;
static size_t         out_length;

static uint64_t look_at_clock(void)
{
    return now;
}

uint64_t clock_now(void)
{
    now += 100;
    fake_stereo_advance();
    fake_frame_link_advance();
    return now;
}

const char *platform_name(void)          { return "test"; }
uint32_t clock_hz(void)                  { return 1000000; }
void     memory_to_device(void)          {}
void     memory_from_device(void)        {}
uint32_t uart_rxempty_read(void)         { return line_length == 0; }
uint32_t uart_rxfull_read(void)          { return line_length >= 256; }
uint32_t uart_rxtx_read(void)            { return *line; }
uint32_t uart_txempty_read(void)         { return 1; }
uint32_t uart_txfull_read(void)          { return 0; }
void     uart_ev_enable_write(uint32_t value) { (void)value; }

void reset_begin(reset_report_t *report)
{
    *report = found_reset;
    resets  = 0;
}

void reset_now(reset_cause_t cause, uint32_t place, uint16_t line_number)
{
    (void)place;
    (void)line_number;
    last_reset = cause;
    resets++;
}

void reset_forget_starts(void)
{
    forgotten_starts++;
}

const char *reset_cause_name(reset_cause_t cause)
{
    return cause == RESET_WATCHDOG ? "watchdog" : "?";
}

void uart_ev_pending_write(uint32_t value)
{
    if ((value & UART_EV_RX) != 0) {
        line++;
        line_length--;
    }
}

void uart_rxtx_write(uint32_t value)
{
    if (out_length < sizeof(out) - 1) {
        out[out_length++] = (char)value;
        out[out_length]   = 0;
    }
}

size_t platform_stack_used(size_t *size)
{
    *size = 4096;
    return 1000;
}

void *platform_frame_memory(size_t *size)
{
    *size = frame_memory;
    return memory;
}

static void handle_interrupt(void)
{
    stereo_isr(&app.stereo);
}

void receive(const void *bytes, size_t length)
{
    line        = bytes;
    line_length = length;
    do {
        app_poll(&app);
    } while (line_length > 0);
}

const char *type(const char *text)
{
    out_length = 0;
    out[0]     = 0;
    receive(text, strlen(text));
    return out;
}

void make_memory(void)
{
    memory = mmap((void *)(uintptr_t)(MEMORY_BASE - PAGE), MEMORY_SIZE + 2 * PAGE, PROT_NONE,
        MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED_NOREPLACE, -1, 0);
    REQUIRE(memory != MAP_FAILED);
    memory += PAGE;
    REQUIRE(mprotect(memory, MEMORY_SIZE, PROT_READ | PROT_WRITE) == 0);
    fake_stereo.clock = look_at_clock;
}

void boot(void)
{
    fake_stereo.hang      = false;
    fake_stereo.bus_error = false;
    fake_screen           = (fake_screen_t){0};
    memset(memory, 0, MEMORY_SIZE);
    out_length = 0;
    REQUIRE(app_init(&app, &app_buffers) == STATUS_OK);
    fake_stereo_attach(handle_interrupt);
}

frame_t *load_frame(uint32_t id)
{
    stereo_settings_t settings = stereo_settings_bare(&app.info.limits);
    frame_t          *frame;

    settings.width       = 40;
    settings.height      = 20;
    settings.disparities = 16;
    settings.block_size  = 5;
    REQUIRE(frame_pool_open(&app.pool, FRAME_OWNER_LINK, id, &settings, &frame) == STATUS_OK);
    REQUIRE(frame_fill(frame) == STATUS_OK && frame_pool_start(&app.pool, frame) == STATUS_OK);
    return frame;
}
