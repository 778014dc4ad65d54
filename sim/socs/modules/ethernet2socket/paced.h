/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/*
 * A host in the device's time, so that what is measured depends neither on this computer nor on its load: while the
 * host computes, the simulation is paused, and while the host waits, it goes on.
 *
 * The host connects to an abstract socket of packets. It sends datagrams, as the byte 'D' and the payload, and waits, as
 * the byte 'W' and the clock at which it wakes without a datagram. A wait is answered with the clock, and the first
 * datagram, if there is one. All words have 64 bits in this computer's byte order. A datagram reaches the host
 * `latency` clocks after its last byte. Datagrams to the device wait in a queue, and leave at the pace of the wire.
 */

#ifndef PACED_H
#define PACED_H

#include <errno.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "frames.h"
#include "settings.h"

#define LETTERS    1024
#define PACED_PORT 40001
/* The host's time begins at a multiple, so that it begins in the same clock each time. */
#define FIRST_CLOCKS (1u << 20)

struct letter {
    uint64_t due; /* clock */
    size_t length;
    uint8_t bytes[PAYLOAD_MOST];
};

struct letters {
    struct letter letter[LETTERS];
    size_t put, taken; /* modulo 2**64 */
};

struct paced {
    int listener; /* -1: there is no such host */
    int client;   /* -1: it is not connected */
    uint64_t latency;
    uint64_t wakes; /* clock */
    struct letters to_soc, to_host;
};

static inline struct letter *first_letter(struct letters *letters)
{
    return letters->put == letters->taken ? NULL : &letters->letter[letters->taken % LETTERS];
}

static inline void put_letter(struct letters *letters, uint64_t due, const uint8_t *bytes, size_t length)
{
    struct letter *letter = &letters->letter[letters->put++ % LETTERS];

    if (letters->put - letters->taken > LETTERS || length > PAYLOAD_MOST) {
        fail("more than %d datagrams wait, or one has more than %d bytes", LETTERS, PAYLOAD_MOST);
    }
    letter->due    = due;
    letter->length = length;
    memcpy(letter->bytes, bytes, length);
}

static inline void paced_init(struct paced *paced, const char *name, unsigned latency)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    size_t length = name ? strlen(name) : 0;

    paced->listener = paced->client = -1;
    paced->latency  = latency;
    if (!name) {
        return;
    }
    if (length + 1 > sizeof(address.sun_path)) {
        fail("the name %s is too long", name);
    }
    memcpy(address.sun_path + 1, name, length);
    paced->listener = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (paced->listener < 0
        || bind(paced->listener, (struct sockaddr *)&address, (socklen_t)(offsetof(struct sockaddr_un, sun_path) + 1 + length))
        || listen(paced->listener, 1)) {
        fail("cannot listen at %s: %s", name, strerror(errno));
    }
}

/* Let the host compute, until it waits or is gone. */
static inline void paced_compute(struct paced *paced)
{
    uint8_t packet[1 + PAYLOAD_MOST];

    for (;;) {
        ssize_t length = recv(paced->client, packet, sizeof(packet), 0);

        if (length < 0 && errno == EINTR) {
            continue;
        }
        if (length == 1 + sizeof(uint64_t) && packet[0] == 'W') {
            memcpy(&paced->wakes, packet + 1, sizeof(uint64_t));
            return;
        }
        if (length > 0 && packet[0] == 'D') {
            put_letter(&paced->to_soc, 0, packet + 1, (size_t)length - 1);
            continue;
        }
        close(paced->client);
        paced->client = -1;
        return;
    }
}

static inline void paced_tick(struct paced *paced, uint64_t clock)
{
    struct {
        uint64_t clock;
        uint8_t bytes[PAYLOAD_MOST];
    } answer = {.clock = clock};
    struct letter *letter;
    size_t length = 0;

    if (paced->client < 0) {
        if (paced->listener >= 0 && clock % FIRST_CLOCKS == 0) {
            paced->client = accept(paced->listener, NULL, NULL);
            if (paced->client >= 0) {
                paced_compute(paced);
            }
        }
        return;
    }
    letter = first_letter(&paced->to_host);
    letter = letter && letter->due <= clock ? letter : NULL;
    if (!letter && clock < paced->wakes) {
        return;
    }
    if (letter) {
        length = letter->length;
        memcpy(answer.bytes, letter->bytes, length);
        paced->to_host.taken++;
    }
    /* If the host is gone, the next read tells. */
    (void)!send(paced->client, &answer, sizeof(answer.clock) + length, MSG_NOSIGNAL);
    paced_compute(paced);
}

#endif
