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

#ifdef __cplusplus
extern "C" {
#endif

/** Received bytes that are kept while the sender waits for the line; a power of two. */
#define SERIAL_BACKLOG_SIZE 512u

/** Handle of the UART. */
typedef struct {
    uint8_t  backlog[SERIAL_BACKLOG_SIZE];  /**< Bytes received while sending. */
    uint32_t head;                          /**< Bytes put in the backlog so far, modulo 2**32. */
    uint32_t tail;                          /**< Bytes taken from it so far, modulo 2**32. */
    bool     stalled;                       /**< The line does not move; bytes are dropped until it does. */
} serial_t;

/** Takes over the UART: disables its interrupts and clears its events. */
void serial_init(serial_t *serial);

/** Reads at most `capacity` received bytes; returns their number, without waiting. */
size_t serial_receive(serial_t *serial, uint8_t *bytes, size_t capacity);

/** Sends bytes; returns once all are in the FIFO, or when the line stalls. */
void serial_send(serial_t *serial, const uint8_t *bytes, size_t length);

/** Sends text without the handle, for emergencies: in an interrupt, or before a reset. Returns once the text is sent,
 * or when the line stalls. */
void serial_say(const char *text);

#ifdef __cplusplus
}
#endif

#endif
