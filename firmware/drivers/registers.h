/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The registers that LiteX generates, and access to their fields.
 *
 * A peripheral that the SoC lacks has registers that read as a constant and ignore writes, and fields at bit 0. Drivers
 * are the same with and without their hardware, and recognise by what they read that there is none. */

#ifndef LITESTEREO_DRIVERS_REGISTERS_H
#define LITESTEREO_DRIVERS_REGISTERS_H

#include <generated/csr.h>
#include <generated/soc.h>

#include <stdint.h>

/* Mask of the lowest bit of a field, such as REGISTER_BIT(STEREO_CONTROL_START). */
#define REGISTER_BIT(field) (1u << CSR_##field##_OFFSET)

/* Value of a field in the value of its register. */
#define REGISTER_FIELD(field, value) (((value) >> CSR_##field##_OFFSET) & ((1u << CSR_##field##_SIZE) - 1))

#define READS(name)  READS_AS(name, 0)
#define READS_AS(name, value) static inline uint32_t name##_read(void) { return value; }
#define WRITES(name) static inline void name##_write(uint32_t value) { (void)value; }

#ifndef CSR_FRAME_LINK_BASE

READS(frame_link_version)
READS(frame_link_slots)
READS(frame_link_max_chunks)
READS(frame_link_mailbox_entries)
READS(frame_link_alignment)
READS(frame_link_port)
READS(frame_link_slot_status)
READS(frame_link_arrived)
READS(frame_link_mailbox_produced)
READS(frame_link_send_status)
READS(frame_link_streaming)
READS(frame_link_counter)
WRITES(frame_link_counter_index)
WRITES(frame_link_mac_high)
WRITES(frame_link_mac_low)
WRITES(frame_link_netmask)
WRITES(frame_link_gateway)
WRITES(frame_link_address)
WRITES(frame_link_control)
WRITES(frame_link_token)
WRITES(frame_link_peer_address)
WRITES(frame_link_peer_port)
WRITES(frame_link_slot_frame_id)
WRITES(frame_link_slot_base)
WRITES(frame_link_slot_pixels)
WRITES(frame_link_slot_control)
WRITES(frame_link_arrived_index)
WRITES(frame_link_mailbox_base)
WRITES(frame_link_mailbox_consumed)
WRITES(frame_link_send_address)
WRITES(frame_link_send_port)
WRITES(frame_link_send_type)
WRITES(frame_link_send_session)
WRITES(frame_link_send_sequence)
WRITES(frame_link_send_frame_id)
WRITES(frame_link_send_offset)
WRITES(frame_link_send_base)
WRITES(frame_link_send_length)
WRITES(frame_link_send_control)

#define CSR_FRAME_LINK_CONTROL_ENABLE_OFFSET 0
#define CSR_FRAME_LINK_SLOT_CONTROL_OPEN_OFFSET 0
#define CSR_FRAME_LINK_SLOT_CONTROL_CLOSE_OFFSET 0
#define CSR_FRAME_LINK_SLOT_STATUS_CLEARING_OFFSET 0
#define CSR_FRAME_LINK_SLOT_STATUS_WRITING_OFFSET 0
#define CSR_FRAME_LINK_SLOT_STATUS_SLOT_OFFSET 0
#define CSR_FRAME_LINK_SLOT_STATUS_SLOT_SIZE 1
#define CSR_FRAME_LINK_SEND_CONTROL_REPLY_OFFSET 0
#define CSR_FRAME_LINK_SEND_CONTROL_RUN_OFFSET 0
#define CSR_FRAME_LINK_SEND_CONTROL_ABORT_OFFSET 0
#define CSR_FRAME_LINK_SEND_STATUS_REPLY_BUSY_OFFSET 0
#define CSR_FRAME_LINK_SEND_STATUS_RUN_BUSY_OFFSET 0

#endif

/* A SoC with a frame link has constants with its addresses. */
#ifndef NETWORK_ADDRESS

#define NETWORK_MAC_HIGH 0
#define NETWORK_MAC_LOW  0
#define NETWORK_NETMASK  0
#define NETWORK_GATEWAY  0
#define NETWORK_ADDRESS  0

#endif

/* A frame link may be built without streaming. */
#ifndef CSR_FRAME_LINK_STREAM_CONTROL_ADDR

READS(frame_link_stream_status)
READS(frame_link_stream_offset)
WRITES(frame_link_stream_frame_id)
WRITES(frame_link_stream_pixels)
WRITES(frame_link_stream_sequence)
WRITES(frame_link_stream_control)

#define CSR_FRAME_LINK_STREAM_CONTROL_OPEN_OFFSET 0
#define CSR_FRAME_LINK_STREAM_CONTROL_CLOSE_OFFSET 0
#define CSR_FRAME_LINK_STREAM_STATUS_OPEN_OFFSET 0

#endif

/* A matcher may be built without rectification. */
#ifndef CSR_STEREO_PLACE_ADDR

READS(stereo_rows)
READS(stereo_rectification)
WRITES(stereo_left_out_base)
WRITES(stereo_right_out_base)
WRITES(stereo_place)
WRITES(stereo_node)
WRITES(stereo_grid0_size)
WRITES(stereo_grid1_size)

#define CSR_STEREO_OPTIONS_RECTIFIED_OFFSET 0
#define CSR_STEREO_OPTIONS_GRID_OFFSET 0
#define CSR_STEREO_OPTIONS_LEFT_OUT_OFFSET 0
#define CSR_STEREO_OPTIONS_RIGHT_OUT_OFFSET 0
#define CSR_STEREO_PLACE_GRID_OFFSET 0
#define CSR_STEREO_PLACE_CAMERA_OFFSET 0
#define CSR_STEREO_RECTIFICATION_ROW_GONE_OFFSET 0
#define CSR_STEREO_RECTIFICATION_FOLDED_OFFSET 0
#define CSR_STEREO_RECTIFICATION_LOST_OFFSET 0

#endif

/* The boards' SoCs have constants that say where in the flash the images are. */
#ifndef FLASH_IMAGES

#define FLASH_IMAGES        0
#define FLASH_IMAGES_OFFSET 0
#define FLASH_IMAGE_BYTES   0

#endif

/* And where its records are. */
#ifndef FLASH_RECORDS_BYTES

#define FLASH_RECORDS_OFFSET 0
#define FLASH_RECORDS_BYTES  0

#endif

#ifndef CSR_FLASH_BASE

/* Nothing drives the pin, so it is high. */
READS_AS(flash_r, 1)
WRITES(flash_w)

#define CSR_FLASH_W_CLK_OFFSET 0
#define CSR_FLASH_W_MOSI_OFFSET 0
#define CSR_FLASH_W_OE_OFFSET 0
#define CSR_FLASH_W_CS_OFFSET 0
#define CSR_FLASH_R_MISO_OFFSET 0

#endif

#ifndef CSR_VIDEO_FRAMEBUFFER_BASE

#define VIDEO_FRAMEBUFFER_HRES  0
#define VIDEO_FRAMEBUFFER_VRES  0
#define VIDEO_FRAMEBUFFER_DEPTH 8

WRITES(video_framebuffer_dma_base)
WRITES(video_framebuffer_dma_enable)

#endif

#ifndef CSR_RESET_RECORD_BASE

/* RESET_UNKNOWN. */
READS_AS(reset_record_cause, 1)
READS(reset_record_place)
WRITES(reset_record_cause)
WRITES(reset_record_place)

#endif

#ifndef CSR_WATCHDOG0_BASE

READS(watchdog0_control)
READS(watchdog0_cycles)
WRITES(watchdog0_control)
WRITES(watchdog0_cycles)
WRITES(watchdog0_ev_pending)
WRITES(watchdog0_ev_enable)

#define CSR_WATCHDOG0_CONTROL_FEED_OFFSET 0
#define CSR_WATCHDOG0_CONTROL_ENABLE_OFFSET 0
#define CSR_WATCHDOG0_CONTROL_RESET_OFFSET 0
#define CSR_WATCHDOG0_EV_PENDING_WDT_OFFSET 0
#define CSR_WATCHDOG0_EV_ENABLE_WDT_OFFSET 0

#endif

#undef READS
#undef READS_AS
#undef WRITES

#endif
