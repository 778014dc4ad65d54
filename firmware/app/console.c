/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "console.h"

#include <string.h>

#include "commands.h"
#include "litestereo/platform.h"
#include "litestereo/reset.h"
#include "litestereo/watchdog.h"

#define PROMPT "litestereo> "

/* Arguments of commands that match a frame. all: every stage that is built; sad: sum of absolute differences alone. */
#define FRAME_ARGUMENTS " WIDTH HEIGHT DISPARITIES BLOCK_SIZE sad|all"

static bool command_help(console_t *console, char **argv);
static bool command_info(console_t *console, char **argv);
static bool command_stats(console_t *console, char **argv);
static bool command_confirm(console_t *console, char **argv);
static bool command_reset(console_t *console, char **argv);

static const struct {
    const char       *name;
    int               words;  /* The name and its arguments. */
    const char       *arguments;
    const char       *help;
    console_command_t run;
} commands[] = {
    {"help",     1, "",              "show the commands",                  command_help},
    {"info",     1, "",              "show what the device can do",        command_info},
    {"stats",    1, "",              "show the counters",                  command_stats},
    {"confirm",  1, "",              "keep a firmware that is on trial",   command_confirm},
    {"reset",    1, "",              "restart the device",                 command_reset},
    {"selftest", 1, "",              "compare accelerator and CPU",        command_selftest},
    {"bench",     6, FRAME_ARGUMENTS, "match a fixed pattern",             command_bench},
    {"cpu_bench", 6, FRAME_ARGUMENTS, "match it on the CPU",               command_cpu_bench},
};

#define COMMANDS (sizeof(commands) / sizeof(commands[0]))

static bool command_help(console_t *console, char **argv)
{
    (void)argv;
    for (size_t i = 0; i < COMMANDS; i++) {
        console_printf(console, "%s%s: %s\n", commands[i].name, commands[i].arguments, commands[i].help);
    }
    return true;
}

static bool command_info(console_t *console, char **argv)
{
    const device_info_t *info = console->info;
    const frame_pool_t  *pool = console->matcher->pool;
    size_t               stack;
    size_t               used = platform_stack_used(&stack);

    (void)argv;
    console_printf(console, "name: %s\n", info->name);
    console_printf(console, "firmware: %u.%u\n", info->firmware_version >> 8, info->firmware_version & 0xff);
    console_printf(console, "gateware: %u.%u\n", info->gateware_version >> 8, info->gateware_version & 0xff);
    console_printf(console, "features:");
    for (unsigned bit = 0; bit < LITESTEREO_FEATURES; bit++) {
        if ((info->limits.features & 1u << bit) != 0) {
            console_printf(console, " %s", stereo_feature_name(bit));
        }
    }
    console_printf(console, "\n");
    console_printf(console, "clock: %u Hz\n", (unsigned)info->sys_clk_hz);
    console_printf(console, "disparities: 16 to %u\n", info->limits.max_disparities);
    console_printf(console, "block size: %u to %u\n", info->limits.min_block_size, info->limits.max_block_size);
    console_printf(console, "frames: %u slots of %u pixels, at most %u wide\n", pool->slots,
        (unsigned)pool->max_pixels, info->max_width);
    console_printf(console, "stack: %u of %u bytes used so far\n", (unsigned)used, (unsigned)stack);
    if (console->session->update != NULL) {
        const flash_t *flash = console->session->update->flash;

        console_printf(console, "flash: id 0x%06x, %u images of %u bytes\n", (unsigned)flash->id,
            (unsigned)flash->images, (unsigned)flash->image_bytes);
        console_printf(console, "newest firmware: %s\n", trial_state_name(trial_state(console->trial)));
    } else {
        console_printf(console, "flash: none\n");
    }
    if (console->session->transfer != NULL) {
        console_printf(console, "udp: %u.%u.%u.%u port %u\n", (unsigned)(info->address >> 24),
            (unsigned)(info->address >> 16 & 0xff), (unsigned)(info->address >> 8 & 0xff),
            (unsigned)(info->address & 0xff), info->port);
        console_printf(console, "streaming: %s\n", console->session->transfer->stream != NULL ? "yes" : "no");
    }
    return true;
}

static bool command_stats(console_t *console, char **argv)
{
    const stereo_statistics_t *matcher = &console->matcher->stereo->statistics;

    (void)argv;
    session_update_counters(console->session, clock_now());
    for (unsigned i = 0; i < COUNTERS; i++) {
        console_printf(console, "%s: %u\n", counter_name(i), (unsigned)console->counters->value[i]);
    }
    console_printf(console, "matcher: %u submitted, %u refused, %u done\n", (unsigned)matcher->submitted,
        (unsigned)matcher->refused, (unsigned)matcher->done);
    console_printf(console,
        "matcher errors: %u config, %u bus, %u aborted, %u timeouts, %u stuck, %u lost interrupts\n",
        (unsigned)matcher->config_errors, (unsigned)matcher->bus_errors, (unsigned)matcher->aborted,
        (unsigned)matcher->timeouts, (unsigned)matcher->stuck, (unsigned)matcher->lost_interrupts);
    return true;
}

static bool command_confirm(console_t *console, char **argv)
{
    (void)argv;
    console_printf(console, trial_confirm(console->trial) ? "confirm: done\n" : "confirm: no firmware is on trial\n");
    return true;
}

static bool command_reset(console_t *console, char **argv)
{
    (void)console;
    (void)argv;
    reset_now(RESET_REQUESTED, 0, 0);
    return true;
}

/* Cuts the line into words; returns their number, CONSOLE_WORDS + 1 if there are more. */
static int split(char *line, char **argv)
{
    int argc = 0;

    for (line += strspn(line, " "); *line != 0 && argc <= CONSOLE_WORDS; line += strspn(line, " ")) {
        argv[argc++] = line;
        line += strcspn(line, " ");
        if (*line != 0) {
            *line++ = 0;
        }
    }
    return argc;
}

static void run_line(console_t *console)
{
    char *argv[CONSOLE_WORDS + 1];
    int   argc = split(console->line, argv);

    if (argc == 0) {
        return;
    }
    count(console->counters, COUNTER_CONSOLE_LINES);
    for (size_t i = 0; i < COMMANDS; i++) {
        if (strcmp(argv[0], commands[i].name) == 0) {
            bool done;

            /* A user waits for it and has chosen how long it takes. */
            watchdog_pause();
            done = argc == commands[i].words && commands[i].run(console, argv);
            watchdog_resume();
            if (!done) {
                console_printf(console, "usage: %s%s\n", commands[i].name, commands[i].arguments);
            }
            return;
        }
    }
    console_printf(console, "unknown command, try help\n");
}

static void end_line(console_t *console)
{
    /* Garbage is from a damaged frame, and gets no answer. */
    if (!console->garbage) {
        console->line[console->length] = 0;
        console_printf(console, "\n");
        run_line(console);
        console_printf(console, PROMPT);
    }
    console->length  = 0;
    console->garbage = false;
}

static void receive_character(console_t *console, char character)
{
    bool newline_of_return = character == '\n' && console->returned;

    console->returned = character == '\r';
    if (newline_of_return) {
        return;
    }
    if (character == '\r' || character == '\n') {
        end_line(console);
    } else if (character == '\b' || character == 0x7f) {
        if (console->length > 0) {
            console->length--;
            console_printf(console, "\b \b");
        }
    } else if (character < 0x20 || character > 0x7e || console->length == CONSOLE_LINE_SIZE) {
        console->garbage = true;
    } else if (!console->garbage) {
        console->line[console->length++] = character;
        console->write(console->context, (const uint8_t *)&character, 1);
    }
}

void console_start(console_t *console)
{
    console_printf(console, "\nLiteStereo on %s, firmware %u.%u, gateware %u.%u: try help\n" PROMPT,
        console->info->name, console->info->firmware_version >> 8, console->info->firmware_version & 0xff,
        console->info->gateware_version >> 8, console->info->gateware_version & 0xff);
}

void console_receive(console_t *console, const uint8_t *text, size_t length)
{
    for (size_t i = 0; i < length; i++) {
        receive_character(console, (char)text[i]);
    }
}
