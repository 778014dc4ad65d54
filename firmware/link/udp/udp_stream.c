/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The way of streamed frames over UDP. */

#include "udp_link.h"

static status_t open(void *context, const frame_t *frame)
{
    udp_link_t *link   = context;
    status_t    status = frame_link_open_stream(link->driver, frame->id, frame_pixels(frame), frame->sequence);

    if (status == STATUS_OK) {
        link->streamed = frame->slot;
    }
    return status;
}

static uint32_t wanted(void *context)
{
    udp_link_t *link = context;

    return frame_link_stream_wanted(link->driver);
}

static status_t close(void *context)
{
    udp_link_t *link = context;

    return frame_link_close_stream(link->driver);
}

void udp_stream_init(udp_link_t *link)
{
    link->streamed = -1;
    link->stream   = (frame_stream_t){.context = link, .open = open, .wanted = wanted, .close = close};
    if (link->driver->capabilities.streaming) {
        link->transfer.stream = &link->stream;
    }
}

void udp_stream_forget(udp_link_t *link, const frame_t *frame)
{
    /* A frame that is through, whose map was fetched by READ before its parts had left. */
    if (frame->streamed && link->streamed == frame->slot && frame_link_stream_busy(link->driver)) {
        (void)frame_link_close_stream(link->driver);
    }
}
