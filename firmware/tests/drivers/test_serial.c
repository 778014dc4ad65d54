/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include <stdint.h>
#include <string.h>

#include "drivers/platform.h"
#include "litestereo/serial.h"
#include "require.h"

/* A UART whose receive FIFO is fed from a script, and whose transmit FIFO drains now and then. */
static struct {
    uint8_t  line[4096];    /* Bytes still to be received. */
    unsigned come, sent_in; /* Bytes taken by the firmware; bytes arrived in the FIFO. */
    unsigned total;
    uint8_t  out[4096];
    unsigned out_length, out_pending;
    unsigned accesses;
    bool     dead;
} uart;

static serial_t serial;

static void arrive(unsigned count)
{
    while (count-- > 0 && uart.sent_in < uart.total && uart.sent_in - uart.come < UART_RX_FIFO_DEPTH) {
        uart.sent_in++;
    }
}

static void tick(void)
{
    uart.accesses++;
    if (!uart.dead && uart.out_pending > 0 && uart.accesses % 5 == 0) {
        uart.out_pending--;
    }
}

uint32_t uart_rxempty_read(void) { tick(); return uart.come == uart.sent_in; }
uint32_t uart_rxfull_read(void)  { tick(); return uart.sent_in - uart.come >= UART_RX_FIFO_DEPTH; }
uint32_t uart_txempty_read(void) { tick(); return uart.out_pending == 0; }
uint32_t uart_txfull_read(void)  { tick(); return uart.out_pending >= UART_TX_FIFO_DEPTH; }
void     uart_ev_enable_write(uint32_t value) { REQUIRE(value == 0); }

uint32_t uart_rxtx_read(void)
{
    tick();
    REQUIRE(uart.come < uart.sent_in);
    return uart.line[uart.come];
}

void uart_ev_pending_write(uint32_t value)
{
    tick();
    if ((value & UART_EV_RX) != 0) {
        REQUIRE(uart.come < uart.sent_in);
        uart.come++;
    }
}

void uart_rxtx_write(uint32_t value)
{
    tick();
    REQUIRE(uart.out_pending < UART_TX_FIFO_DEPTH);
    uart.out[uart.out_length++] = (uint8_t)value;
    uart.out_pending++;
}

static void set_up(unsigned total)
{
    memset(&uart, 0, sizeof(uart));
    for (unsigned i = 0; i < total; i++) {
        uart.line[i] = (uint8_t)(i * 13 + i / 256);
    }
    uart.total = total;
    serial_init(&serial);
}

static void test_receive(void)
{
    uint8_t bytes[300];

    set_up(1000);
    REQUIRE(serial_receive(&serial, bytes, sizeof(bytes)) == 0);
    arrive(3);
    REQUIRE(serial_receive(&serial, bytes, 2) == 2 && serial_receive(&serial, bytes + 2, 2) == 1);
    REQUIRE(memcmp(bytes, uart.line, 3) == 0);
    arrive(256);
    uart.accesses = 0;
    REQUIRE(serial_receive(&serial, bytes, 256) == 256 && memcmp(bytes, uart.line + 3, 256) == 0);
    REQUIRE(uart.accesses <= 2 * 256 + 4);
    arrive(255);
    REQUIRE(serial_receive(&serial, bytes, 300) == 255 && memcmp(bytes, uart.line + 259, 255) == 0);
    arrive(256);
    REQUIRE(serial_receive(&serial, bytes, 300) == 256 && memcmp(bytes, uart.line + 514, 256) == 0);
    /* A full FIFO has more bytes than there is room for: the rest stays in it. */
    arrive(256);
    REQUIRE(serial_receive(&serial, bytes, 200) == 200 && memcmp(bytes, uart.line + 770, 200) == 0);
    arrive(256);
    REQUIRE(serial_receive(&serial, bytes, 300) == 30 && memcmp(bytes, uart.line + 970, 30) == 0);
}

static void test_send(void)
{
    set_up(0);
    REQUIRE(sizeof(uart.line) >= 1000);
    for (unsigned i = 0; i < 1000; i++) {
        uart.line[i] = (uint8_t)(i * 3);
    }
    serial_send(&serial, uart.line, 1000);
    REQUIRE(uart.out_length == 1000 && memcmp(uart.out, uart.line, 1000) == 0);
}

/* Bytes received while sending are kept in order, up to the size of the backlog. */
static void test_backlog(void)
{
    uint8_t out[200] = {0};
    uint8_t in[1024];
    size_t  got = 0;

    set_up(700);
    arrive(256);
    serial_send(&serial, out, sizeof(out));
    REQUIRE(uart.out_length == sizeof(out) && uart.come > 0);
    arrive(256);
    serial_send(&serial, out, sizeof(out));
    arrive(256);
    while (got < 700) {
        size_t n = serial_receive(&serial, in + got, 100);

        REQUIRE(n > 0);
        got += n;
        arrive(256);
    }
    REQUIRE(got == 700 && memcmp(in, uart.line, 700) == 0);
}

/* A backlog that is full leaves the rest to the FIFO. */
static void test_full_backlog(void)
{
    uint8_t out[64] = {0};
    uint8_t in[1024];

    set_up(1000);
    while (uart.come < SERIAL_BACKLOG_SIZE) {
        arrive(256);
        serial_send(&serial, out, sizeof(out));
        uart.out_length = 0;
    }
    arrive(256);
    serial_send(&serial, out, sizeof(out));
    REQUIRE(uart.come == SERIAL_BACKLOG_SIZE);
    REQUIRE(serial_receive(&serial, in, sizeof(in)) == SERIAL_BACKLOG_SIZE + 256);
    REQUIRE(memcmp(in, uart.line, SERIAL_BACKLOG_SIZE + 256) == 0);
}

/* A stalled line costs one bounded wait, and is used again when it moves. */
static void test_dead_line(void)
{
    uint8_t  out[64] = {0};
    unsigned first;

    set_up(0);
    uart.dead = true;
    serial_send(&serial, out, sizeof(out));
    first = uart.accesses;
    REQUIRE(uart.out_length == UART_TX_FIFO_DEPTH && serial.stalled && first < 2000000);
    serial_send(&serial, out, sizeof(out));
    REQUIRE(uart.out_length == UART_TX_FIFO_DEPTH && uart.accesses - first < 10);
    uart.dead        = false;
    uart.out_pending = 0;
    serial_send(&serial, out, sizeof(out));
    REQUIRE(!serial.stalled && uart.out_length == UART_TX_FIFO_DEPTH + sizeof(out));
}

/* Text before a reset is sent before the reset, unless the line is dead. */
static void test_say(void)
{
    unsigned accesses;

    set_up(0);
    serial_say("said before the end, and longer than the FIFO");
    REQUIRE(uart.out_length == 45 && memcmp(uart.out, "said before the end, and longer than the FIFO", 45) == 0);
    REQUIRE(uart.out_pending == 0);
    uart.dead = true;
    accesses  = uart.accesses;
    serial_say("said before the end, and longer than the FIFO");
    REQUIRE(uart.accesses - accesses < 500000 && uart.out_length == 45 + UART_TX_FIFO_DEPTH);
    /* Nor does a line whose FIFO accepts everything but sends nothing. */
    set_up(0);
    uart.dead = true;
    serial_say("short");
    REQUIRE(uart.accesses < 500000 && uart.out_length == 5 && uart.out_pending == 5);
}

int main(void)
{
    test_receive();
    test_send();
    test_backlog();
    test_full_backlog();
    test_dead_line();
    test_say();
    return 0;
}
