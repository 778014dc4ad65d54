/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* A file of frames for Wireshark: classic pcap with nanoseconds; a clock counts as one. */

#ifndef CAPTURE_H
#define CAPTURE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "frames.h"

#define CLOCKS_PER_S 1000000000

/* In this computer's byte order, which the reader knows by the magic number. */
static inline bool capture_begin(FILE *file)
{
    static const struct {
        uint32_t magic;
        uint16_t major, minor;
        uint32_t zone, accuracy, longest, link;
    } header = {.magic = 0xa1b23c4d, .major = 2, .minor = 4, .longest = FRAME_MOST, .link = 1 /* Ethernet */};

    return fwrite(&header, sizeof(header), 1, file) == 1 && !fflush(file);
}

/*
 * Of a frame longer than FRAME_MOST, `frame` is the beginning. Nothing is buffered: the simulator may be killed at any
 * time.
 */
static inline bool capture_frame(FILE *file, uint64_t clock, const uint8_t *frame, size_t length)
{
    uint32_t kept     = length < FRAME_MOST ? (uint32_t)length : FRAME_MOST;
    uint32_t header[] = {(uint32_t)(clock / CLOCKS_PER_S), (uint32_t)(clock % CLOCKS_PER_S), kept, (uint32_t)length};

    return fwrite(header, sizeof(header), 1, file) == 1 && fwrite(frame, kept, 1, file) == 1 && !fflush(file);
}

#endif
