/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#define _DEFAULT_SOURCE

#include "udp_wire.h"

#include <arpa/inet.h>
#include <errno.h>
#include <sys/socket.h>

#include "fake_frame_link.h"

/* Datagrams received per poll, and requests that may wait in the mailbox. The firmware answers a request
 * while the next one arrives over a wire; here it would lose some of those that are sent at once. */
#define BURST    64
#define REQUESTS 4

#define BUFFER_BYTES (4 << 20)

static int wire = -1;

static bool send_datagram(const peer_t *peer, const uint8_t *bytes, size_t length)
{
    struct sockaddr_in to = {
        .sin_family = AF_INET,
        .sin_port   = htons(peer->port),
        .sin_addr   = {htonl(peer->address)},
    };
    ssize_t sent = sendto(wire, bytes, length, MSG_DONTWAIT, (struct sockaddr *)&to, sizeof(to));

    /* Any other error loses the datagram, as a wire would. */
    return sent >= 0 || (errno != EAGAIN && errno != EINTR);
}

uint16_t udp_wire_listen(uint16_t port)
{
    struct sockaddr_in address = {
        .sin_family = AF_INET,
        .sin_port   = htons(port),
        .sin_addr   = {htonl(INADDR_LOOPBACK)},
    };
    socklen_t length = sizeof(address);
    int       bytes  = BUFFER_BYTES;

    wire = socket(AF_INET, SOCK_DGRAM, 0);
    if (setsockopt(wire, SOL_SOCKET, SO_RCVBUFFORCE, &bytes, sizeof(bytes)) != 0) {
        /* Only root may exceed the system's limit. */
        setsockopt(wire, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof(bytes));
    }
    if (bind(wire, (struct sockaddr *)&address, length) != 0) {
        return 0;
    }
    getsockname(wire, (struct sockaddr *)&address, &length);
    fake_frame_link.send = send_datagram;
    return ntohs(address.sin_port);
}

int udp_wire_socket(void)
{
    return wire;
}

void udp_wire_receive(void)
{
    if (wire < 0) {
        return;
    }
    for (int i = 0; i < BURST && fake_frame_link_waiting() < REQUESTS; i++) {
        uint8_t            bytes[2048];
        struct sockaddr_in from;
        socklen_t          size   = sizeof(from);
        ssize_t            length = recvfrom(wire, bytes, sizeof(bytes), MSG_DONTWAIT, (struct sockaddr *)&from, &size);
        peer_t             peer;

        if (length < 0) {
            return;
        }
        peer = (peer_t){.udp = true, .port = ntohs(from.sin_port), .address = ntohl(from.sin_addr.s_addr)};
        fake_frame_link_receive(&peer, bytes, (size_t)length);
    }
}
