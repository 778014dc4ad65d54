/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The driver of the frame link in a SoC that has none. */

#define WITHOUT_FRAME_LINK

#include "drivers/frame_link.c"

#include <string.h>

#include "mock_csr.h"
#include "require.h"

int main(void)
{
    static _Alignas(FRAME_LINK_MAX_ALIGNMENT) uint8_t mailbox[FRAME_LINK_MAILBOX_SIZE];
    static const peer_t    peer = {.udp = true};
    const message_t        part = {.payload = mailbox, .length = 4};
    frame_link_message_t   message;
    frame_link_counters_t  counters;
    frame_link_t           link;

    REQUIRE(frame_link_init(&link, mailbox) == STATUS_UNSUPPORTED && link.capabilities.version == 0);
    require_all_done();

    /* If it is used all the same, nothing waits and nothing happens. */
    link.capabilities.slots      = 1;
    link.capabilities.alignment  = 4;
    link.capabilities.max_chunks = 32;
    link.capabilities.streaming  = true;
    REQUIRE(frame_link_arrived(&link, 0, 0) == 0 && frame_link_peek(&link, &message) == STATUS_IDLE);
    expect_call("memory_to_device");
    expect_call("memory_to_device");
    REQUIRE(frame_link_reply(&link, &peer, &part) == STATUS_OK && !frame_link_reply_busy(&link));
    REQUIRE(frame_link_send_burst(&link, &peer, &part) == STATUS_OK && !frame_link_burst_busy(&link));
    REQUIRE(frame_link_abort_burst(&link) == STATUS_OK && frame_link_set_session(&link, 1, &peer) == STATUS_OK);
    require_all_done();
    expect_call("memory_to_device");
    expect_call("memory_from_device");
    REQUIRE(frame_link_open_slot(&link, 0, 1, mailbox, 1024) == STATUS_OK);
    REQUIRE(frame_link_close_slot(&link, 0) == STATUS_OK);
    require_all_done();
    REQUIRE(frame_link_open_stream(&link, 1, 64, 1) == STATUS_OK && !frame_link_stream_busy(&link));
    REQUIRE(frame_link_stream_wanted(&link) == PROTOCOL_NO_OFFSET && frame_link_close_stream(&link) == STATUS_OK);
    memset(&counters, 0xff, sizeof(counters));
    frame_link_count(&link, &counters);
    REQUIRE(memcmp(&counters, &(frame_link_counters_t){0}, sizeof(counters)) == 0);
    require_all_done();
    return 0;
}
