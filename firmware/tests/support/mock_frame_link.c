/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Mock registers of the frame link that expect accesses in the order that a test has listed. */

#include "generated/csr.h"
#include "mock_csr.h"

#define READS(name, type)  type frame_link_##name##_read(void) { return (type)mock_take('r', #name, 0); }
#define WRITES(name, type) void frame_link_##name##_write(type value) { mock_take('w', #name, value); }

READS(version, uint16_t)
READS(slots, uint8_t)
READS(max_chunks, uint16_t)
READS(mailbox_entries, uint8_t)
READS(alignment, uint16_t)
READS(port, uint16_t)
READS(slot_status, uint8_t)
READS(arrived, uint32_t)
READS(mailbox_produced, uint8_t)
READS(send_status, uint8_t)
READS(streaming, uint8_t)
READS(stream_status, uint8_t)
READS(stream_offset, uint32_t)
READS(counter, uint32_t)
WRITES(mac_high, uint16_t)
WRITES(mac_low, uint32_t)
WRITES(netmask, uint32_t)
WRITES(gateway, uint32_t)
WRITES(address, uint32_t)
WRITES(control, uint8_t)
WRITES(token, uint32_t)
WRITES(peer_address, uint32_t)
WRITES(peer_port, uint16_t)
WRITES(slot_frame_id, uint32_t)
WRITES(slot_base, uint32_t)
WRITES(slot_pixels, uint32_t)
WRITES(slot_control, uint16_t)
WRITES(arrived_index, uint16_t)
WRITES(mailbox_base, uint32_t)
WRITES(mailbox_consumed, uint8_t)
WRITES(send_address, uint32_t)
WRITES(send_port, uint16_t)
WRITES(send_type, uint8_t)
WRITES(send_session, uint32_t)
WRITES(send_sequence, uint32_t)
WRITES(send_frame_id, uint32_t)
WRITES(send_offset, uint32_t)
WRITES(send_base, uint32_t)
WRITES(send_length, uint32_t)
WRITES(send_control, uint8_t)
WRITES(stream_frame_id, uint32_t)
WRITES(stream_pixels, uint32_t)
WRITES(stream_sequence, uint32_t)
WRITES(stream_control, uint8_t)
WRITES(counter_index, uint8_t)
