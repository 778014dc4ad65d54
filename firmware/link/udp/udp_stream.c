/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The path of streamed frames over UDP. */

#include "udp_link.h"

static status_t udp_stream_open(void *context, const frame_t *frame)
{
    udp_link_t *link   = context;
    status_t    status = frame_link_open_stream(link->driver, frame->id, frame_pixels(frame), frame->sequence);

    if (status == STATUS_OK) {
        link->streamed = frame->slot;
    }
    return status;
}

static uint32_t udp_stream_wanted(void *context)
{
    udp_link_t *link = context;

    return frame_link_stream_wanted(link->driver);
}

static status_t udp_stream_close(void *context)
{
    udp_link_t *link = context;

    return frame_link_close_stream(link->driver);
}

void udp_stream_init(udp_link_t *link)
{
    link->streamed = -1;
    link->stream   = (frame_stream_t){
        .context = link,
        .open    = udp_stream_open,
        .wanted  = udp_stream_wanted,
        .close   = udp_stream_close,
    };
    if (link->driver->capabilities.streaming) {
        link->transfer.stream = &link->stream;
    }
}

void udp_stream_forget(udp_link_t *link, const frame_t *frame)
{
    /* A matched frame whose map the host fetched by READ before gateware had sent all its parts. */
    if (frame->streamed && link->streamed == frame->slot && frame_link_stream_busy(link->driver)) {
        (void)frame_link_close_stream(link->driver);
    }
}
