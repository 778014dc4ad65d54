/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The way of streamed frames: pairs from datagrams to the matcher, parts of maps from the matcher to datagrams. */

#include <stddef.h>

#include "frame_link.h"
#include "frame_link_csr.h"
#include "frame_link_wait.h"

#define STREAM_OPEN    (1u << 0)  /* Of stream_control, and of stream_status: pairs are missing. */
#define STREAM_CLOSE   (1u << 1)  /* Of stream_control. */

static bool is_busy(void)
{
    return frame_link_stream_status_read() != 0;
}

status_t frame_link_open_stream(frame_link_t *link, uint32_t frame_id, uint32_t pixels, uint32_t sequence)
{
    if (link == NULL || pixels == 0) {
        return STATUS_BAD_ARGUMENT;
    }
    if (!link->capabilities.streaming) {
        return STATUS_UNSUPPORTED;
    }
    if (is_busy()) {
        return STATUS_BUSY;
    }
    frame_link_stream_frame_id_write(frame_id);
    frame_link_stream_pixels_write(pixels);
    frame_link_stream_sequence_write(sequence);
    frame_link_stream_control_write(STREAM_OPEN);
    return STATUS_OK;
}

bool frame_link_stream_busy(const frame_link_t *link)
{
    (void)link;
    return is_busy();
}

uint32_t frame_link_stream_wanted(const frame_link_t *link)
{
    uint32_t offset = frame_link_stream_offset_read();

    (void)link;
    /* The offset first: if the last pairs come in between it counts no more. */
    return (frame_link_stream_status_read() & STREAM_OPEN) != 0 ? offset : PROTOCOL_NO_OFFSET;
}

status_t frame_link_close_stream(frame_link_t *link)
{
    if (link == NULL) {
        return STATUS_BAD_ARGUMENT;
    }
    frame_link_stream_control_write(STREAM_CLOSE);
    return wait_while(is_busy);
}
