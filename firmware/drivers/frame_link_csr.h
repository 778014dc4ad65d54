/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Registers of the frame link. In a SoC that has none they read as 0, which is not a version that the driver
 * supports. */

#ifndef LITESTEREO_DRIVERS_FRAME_LINK_CSR_H
#define LITESTEREO_DRIVERS_FRAME_LINK_CSR_H

#include "platform.h"

#define READS(name)  static inline uint32_t frame_link_##name##_read(void) { return 0; }
#define WRITES(name) static inline void frame_link_##name##_write(uint32_t value) { (void)value; }

#ifndef CSR_FRAME_LINK_BASE

READS(version)
READS(slots)
READS(max_chunks)
READS(mailbox_entries)
READS(alignment)
READS(address)
READS(port)
READS(slot_status)
READS(arrived)
READS(mailbox_produced)
READS(send_status)
READS(streaming)
READS(datagrams_received)
READS(datagrams_sent)
READS(datagrams_malformed)
READS(datagrams_overrun)
READS(mailbox_overrun)
READS(uploads_foreign)
READS(uploads_unfit)
READS(chunks_received)
READS(chunks_repeated)
READS(chunks_while_matching)
WRITES(control)
WRITES(token)
WRITES(peer_address)
WRITES(peer_port)
WRITES(slot_frame_id)
WRITES(slot_base)
WRITES(slot_pixels)
WRITES(slot_control)
WRITES(arrived_index)
WRITES(mailbox_base)
WRITES(mailbox_consumed)
WRITES(send_address)
WRITES(send_port)
WRITES(send_type)
WRITES(send_session)
WRITES(send_sequence)
WRITES(send_frame_id)
WRITES(send_offset)
WRITES(send_base)
WRITES(send_length)
WRITES(send_control)

#endif

/* A frame link may be built without streaming. */
#ifndef CSR_FRAME_LINK_STREAM_CONTROL_ADDR

READS(stream_status)
READS(stream_offset)
WRITES(stream_frame_id)
WRITES(stream_pixels)
WRITES(stream_sequence)
WRITES(stream_control)

#endif

#undef READS
#undef WRITES

#endif
