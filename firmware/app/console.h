/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Commands typed by a user, on the same serial line as the link. */

#ifndef LITESTEREO_APP_CONSOLE_H
#define LITESTEREO_APP_CONSOLE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "link/session.h"
#include "litestereo/trial.h"
#include "matcher.h"

/** Most characters of a line. */
#define CONSOLE_LINE_SIZE 80u

/** Most words of a command, including its name. */
#define CONSOLE_WORDS 8

/** The console. */
typedef struct {
    const device_info_t *info;     /**< What the device is. */
    matcher_t           *matcher;  /**< Runs the frames of selftest and bench. */
    counters_t          *counters; /**< Shown by stats. */
    session_t           *session;  /**< Updates the counters. */
    trial_t             *trial;    /**< The trial that confirm ends. */
    void               (*write)(void *context, const uint8_t *bytes, size_t length);  /**< Sends text. */
    void                *context;  /**< First argument of `write`. */
    char                 line[CONSOLE_LINE_SIZE + 1];  /**< The line being typed. */
    size_t               length;   /**< Characters in it. */
    bool                 garbage;  /**< The line has unprintable bytes or is too long; it will be dropped. */
    bool                 returned; /**< The last character was a carriage return. */
} console_t;

/** Prints a greeting and the prompt. */
void console_start(console_t *console);

/** Handles typed characters; runs a command at the end of its line. */
void console_receive(console_t *console, const uint8_t *text, size_t length);

/** Prints as printf does; see print_to(). */
void console_printf(console_t *console, const char *format, ...) __attribute__((format(printf, 2, 3)));

/** A command: `argv`[0] is its name, and its arguments follow; returns false to have its usage shown. */
typedef bool (*console_command_t)(console_t *console, char **argv);

#endif
