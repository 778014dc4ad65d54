/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#define _DEFAULT_SOURCE

#include "tcp_uart.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <signal.h>
#include <stddef.h>
#include <sys/socket.h>
#include <unistd.h>

#include "generated/csr.h"
#include "libbase/uart.h"

static struct {
    int     listener;
    int     client;  /* -1 while no client is connected. */
    uint8_t in[65536];
    size_t  in_length, in_used;
    uint8_t out[65536];
    size_t  out_length;
} line = {.client = -1};

static volatile sig_atomic_t stopped;

void tcp_uart_stop(void)
{
    stopped = 1;
}

void tcp_uart_hang_up(void)
{
    if (line.client >= 0) {
        close(line.client);
    }
    line.client     = -1;
    line.in_length  = 0;
    line.in_used    = 0;
    line.out_length = 0;
}

void tcp_uart_flush(void)
{
    size_t sent = 0;

    while (sent < line.out_length && line.client >= 0 && !stopped) {
        ssize_t n = send(line.client, line.out + sent, line.out_length - sent, MSG_NOSIGNAL);

        if (n > 0) {
            sent += (size_t)n;
        } else if (n < 0 && (errno == EAGAIN || errno == EINTR)) {
            poll(&(struct pollfd){.fd = line.client, .events = POLLOUT}, 1, 100);
        } else {
            tcp_uart_hang_up();
        }
    }
    line.out_length = 0;
}

static void fetch(void)
{
    ssize_t n;

    if (line.in_used < line.in_length || line.client < 0) {
        return;
    }
    n = recv(line.client, line.in, sizeof(line.in), 0);
    line.in_used   = 0;
    line.in_length = n > 0 ? (size_t)n : 0;
    if (n == 0 || (n < 0 && errno != EAGAIN && errno != EINTR)) {
        tcp_uart_hang_up();
    }
}

uint32_t uart_rxempty_read(void)
{
    fetch();
    return line.in_used == line.in_length;
}

uint32_t uart_rxfull_read(void)
{
    return line.in_length - line.in_used >= 256;
}

uint32_t uart_rxtx_read(void)
{
    return line.in_used < line.in_length ? line.in[line.in_used] : 0;
}

void uart_ev_pending_write(uint32_t value)
{
    if ((value & UART_EV_RX) != 0 && line.in_used < line.in_length) {
        line.in_used++;
    }
}

void uart_rxtx_write(uint32_t value)
{
    if (line.client < 0) {
        return;
    }
    line.out[line.out_length++] = (uint8_t)value;
    if (line.out_length == sizeof(line.out)) {
        tcp_uart_flush();
    }
}

uint32_t uart_txempty_read(void)
{
    return 1;
}

uint32_t uart_txfull_read(void)
{
    return 0;
}

void uart_ev_enable_write(uint32_t value)
{
    (void)value;
}

uint16_t tcp_uart_listen(uint16_t port)
{
    struct sockaddr_in address = {
        .sin_family = AF_INET,
        .sin_port   = htons(port),
        .sin_addr   = {htonl(INADDR_LOOPBACK)},
    };
    socklen_t length = sizeof(address);
    int       on     = 1;

    line.listener = socket(AF_INET, SOCK_STREAM, 0);
    setsockopt(line.listener, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
    if (bind(line.listener, (struct sockaddr *)&address, length) != 0 || listen(line.listener, 128) != 0) {
        return 0;
    }
    getsockname(line.listener, (struct sockaddr *)&address, &length);
    return ntohs(address.sin_port);
}

static void accept_client(void)
{
    int on = 1;

    line.client = accept(line.listener, NULL, NULL);
    if (line.client >= 0) {
        fcntl(line.client, F_SETFL, O_NONBLOCK);
        setsockopt(line.client, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
    }
}

bool tcp_uart_wait(int other, bool busy)
{
    struct pollfd wait[] = {
        {.fd = line.client >= 0 ? line.client : line.listener, .events = POLLIN},
        {.fd = other, .events = POLLIN},
    };

    if (line.in_used == line.in_length && poll(wait, 2, busy ? 0 : 1) > 0 && wait[0].revents != 0 && line.client < 0) {
        accept_client();
    }
    return !stopped;
}
