/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Polled driver of the UART that link and console share. */

#ifndef LITESTEREO_SERIAL_H
#define LITESTEREO_SERIAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/** Bytes kept while the sender waits for the line; a power of two. */
#define SERIAL_BACKLOG_SIZE 512u

/** Handle of the UART. */
typedef struct {
    uint8_t  backlog[SERIAL_BACKLOG_SIZE];  /**< Bytes received while sending. */
    uint32_t head;                          /**< Bytes ever put in the backlog, modulo 2**32. */
    uint32_t tail;                          /**< Bytes ever taken from it. */
    bool     stalled;                       /**< The line took nothing for too long; bytes are dropped until it does. */
} serial_t;

/** Takes the UART over from whoever had it: no interrupts, nothing pending. */
void serial_init(serial_t *serial);

/** Takes bytes that have come, at most `capacity`; returns how many, 0 at once if there are none. */
size_t serial_receive(serial_t *serial, uint8_t *bytes, size_t capacity);

/** Sends bytes; returns once the FIFO has them, or when the line does not move. */
void serial_send(serial_t *serial, const uint8_t *bytes, size_t length);

/** Sends text when nothing else works any more: in an interrupt, or from within the driver. Returns once the line has it,
 * or when the line does not move. */
void serial_say(const char *text);

#endif
