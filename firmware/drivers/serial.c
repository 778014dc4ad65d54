/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "litestereo/serial.h"

#include <string.h>

#include "platform.h"

/* Polls of a full FIFO, about ten clocks each, before the line counts as stalled: many times what a byte takes at the
 * slowest rates in use. */
#define STALL_POLLS 200000u

void serial_init(serial_t *serial)
{
    memset(serial, 0, sizeof(*serial));
    uart_ev_enable_write(0);
    uart_ev_pending_write(UART_EV_TX);
}

/* Takes bytes out of the FIFO. Each register access costs about ten clocks, so a full FIFO, whose depth is known, is
 * emptied without a poll before each byte. */
static size_t drain(uint8_t *bytes, size_t capacity)
{
    uint8_t *out = bytes;
    uint8_t *end = bytes + capacity;

    while (out < end && !uart_rxempty_read()) {
        size_t   sure = uart_rxfull_read() ? UART_RX_FIFO_DEPTH : 1;
        uint8_t *stop = (size_t)(end - out) < sure ? end : out + sure;

        while (out < stop) {
            *out++ = (uint8_t)uart_rxtx_read();
            uart_ev_pending_write(UART_EV_RX);
        }
    }
    return (size_t)(out - bytes);
}

size_t serial_receive(serial_t *serial, uint8_t *bytes, size_t capacity)
{
    size_t length = 0;

    while (length < capacity && serial->tail != serial->head) {
        bytes[length++] = serial->backlog[serial->tail++ % SERIAL_BACKLOG_SIZE];
    }
    return length + drain(bytes + length, capacity - length);
}

/* Keeps received bytes while the sender waits for the line, so that the FIFO does not overflow. */
static void fill_backlog(serial_t *serial)
{
    while (serial->head - serial->tail < SERIAL_BACKLOG_SIZE && !uart_rxempty_read()) {
        serial->backlog[serial->head++ % SERIAL_BACKLOG_SIZE] = (uint8_t)uart_rxtx_read();
        uart_ev_pending_write(UART_EV_RX);
    }
}

/* Waits for room in the FIFO; returns for how many bytes there is room at least. */
static size_t wait_for_room(serial_t *serial)
{
    uint32_t polls = serial->stalled ? 1 : STALL_POLLS;

    if (uart_txempty_read()) {
        serial->stalled = false;
        return UART_TX_FIFO_DEPTH;
    }
    for (; polls > 0; polls--) {
        if (!uart_txfull_read()) {
            serial->stalled = false;
            return 1;
        }
        fill_backlog(serial);
    }
    serial->stalled = true;
    return 0;
}

void serial_send(serial_t *serial, const uint8_t *bytes, size_t length)
{
    while (length > 0) {
        size_t room = wait_for_room(serial);

        if (room == 0) {
            return;
        }
        if (room > length) {
            room = length;
        }
        length -= room;
        for (; room > 0; room--) {
            uart_rxtx_write(*bytes++);
        }
    }
}

void serial_say(const char *text)
{
    for (; *text != 0; text++) {
        for (uint32_t polls = STALL_POLLS; uart_txfull_read(); polls--) {
            if (polls == 0) {
                return;
            }
        }
        uart_rxtx_write((uint8_t)*text);
    }
    /* A reset would lose what is still in the FIFO. */
    for (uint32_t polls = STALL_POLLS; polls > 0 && !uart_txempty_read(); polls--) {
    }
}
