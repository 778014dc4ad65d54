/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The driver of the frame link in a SoC that has none. */

#define WITHOUT_FRAME_LINK

#include "drivers/frame_link.c"
#include "drivers/frame_link_stream.c"

#include "mock_csr.h"
#include "require.h"

int main(void)
{
    static _Alignas(FRAME_LINK_MAX_ALIGNMENT) uint8_t mailbox[FRAME_LINK_MAILBOX_SIZE];
    frame_link_t link;

    REQUIRE(frame_link_init(&link, mailbox) == STATUS_UNSUPPORTED && link.capabilities.version == 0);
    require_all_done();
    return 0;
}
