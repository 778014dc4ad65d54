/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Replaces the header that LiteX generates: a test supplies the functions. */

#ifndef STUB_GENERATED_CSR_H
#define STUB_GENERATED_CSR_H

#include <stdint.h>

#define CSR_STEREO_BASE 0xf0001000L
#ifndef WITHOUT_FRAME_LINK
#define CSR_FRAME_LINK_BASE 0xf0000800L
#define CSR_FRAME_LINK_STREAM_CONTROL_ADDR 0xf0000880L
#endif
#define CSR_UART_BASE   0xf0002000L
#ifndef WITHOUT_FLASH
#define CSR_FLASH_BASE  0xf0005000L
#endif
#ifndef WITHOUT_SCREEN
#define CSR_VIDEO_FRAMEBUFFER_BASE 0xf0006000L
#endif
#define CSR_TIMER0_UPTIME_CYCLES_ADDR 0xf0003000L

#define CSR_STEREO_CONTROL_START_OFFSET 0
#define CSR_STEREO_CONTROL_ABORT_OFFSET 1
#define CSR_STEREO_STATUS_BUSY_OFFSET 0
#define CSR_STEREO_STATUS_ERROR_OFFSET 8
#define CSR_STEREO_STATUS_ERROR_SIZE 4
#define CSR_STEREO_OPTIONS_XSOBEL_OFFSET 0
#define CSR_STEREO_OPTIONS_SUBPIXEL_OFFSET 1
#define CSR_STEREO_OPTIONS_MEDIAN_OFFSET 2
#define CSR_STEREO_OPTIONS_STREAMED_OFFSET 3
#define CSR_STEREO_OPTIONS_RECTIFIED_OFFSET 4
#define CSR_STEREO_OPTIONS_GRID_OFFSET 5
#define CSR_STEREO_OPTIONS_LEFT_OUT_OFFSET 6
#define CSR_STEREO_OPTIONS_RIGHT_OUT_OFFSET 7
#define CSR_STEREO_PLACE_ADDR 0xf0001070L
#define CSR_STEREO_PLACE_GRID_OFFSET 16
#define CSR_STEREO_PLACE_CAMERA_OFFSET 17
#define CSR_STEREO_RECTIFICATION_ROW_GONE_OFFSET 0
#define CSR_STEREO_RECTIFICATION_FOLDED_OFFSET 1
#define CSR_STEREO_RECTIFICATION_LOST_OFFSET 2
#define CSR_STEREO_FEATURES_XSOBEL_OFFSET 0
#define CSR_STEREO_FEATURES_RAW_OFFSET 1
#define CSR_STEREO_FEATURES_TEXTURE_OFFSET 2
#define CSR_STEREO_FEATURES_UNIQUENESS_OFFSET 3
#define CSR_STEREO_FEATURES_SUBPIXEL_OFFSET 4
#define CSR_STEREO_FEATURES_LEFT_RIGHT_OFFSET 5
#define CSR_STEREO_FEATURES_MIN_DISPARITY_OFFSET 6
#define CSR_STEREO_FEATURES_MEDIAN_OFFSET 7
#define CSR_STEREO_EV_PENDING_DONE_OFFSET 0
#define CSR_STEREO_EV_PENDING_ERROR_OFFSET 1

void stereo_left_base_write(uint32_t value);
void stereo_right_base_write(uint32_t value);
void stereo_disparity_base_write(uint32_t value);
void stereo_width_write(uint16_t value);
void stereo_height_write(uint16_t value);
void stereo_disparities_write(uint16_t value);
void stereo_block_size_write(uint8_t value);
void stereo_min_disparity_write(uint8_t value);
void stereo_prefilter_cap_write(uint8_t value);
void stereo_texture_threshold_write(uint32_t value);
void stereo_uniqueness_ratio_write(uint8_t value);
void stereo_disp12_max_diff_write(uint8_t value);
void stereo_options_write(uint8_t value);
void stereo_control_write(uint8_t value);
void stereo_left_out_base_write(uint32_t value);
void stereo_right_out_base_write(uint32_t value);
void stereo_place_write(uint32_t value);
void stereo_node_write(uint32_t value);
void stereo_grid0_size_write(uint32_t value);
void stereo_grid1_size_write(uint32_t value);
void stereo_ev_pending_write(uint32_t value);
void stereo_ev_enable_write(uint32_t value);

uint32_t stereo_status_read(void);
uint32_t stereo_clocks_read(void);
uint32_t stereo_first_row_clocks_read(void);
uint32_t stereo_frames_read(void);
uint32_t stereo_version_read(void);
uint32_t stereo_max_width_read(void);
uint32_t stereo_max_disparities_read(void);
uint32_t stereo_block_sizes_read(void);
uint32_t stereo_max_prefilter_cap_read(void);
uint32_t stereo_features_read(void);
uint32_t stereo_dma_alignment_read(void);
uint32_t stereo_rows_read(void);
uint32_t stereo_rectification_read(void);
uint32_t stereo_ev_pending_read(void);

#ifdef CSR_FRAME_LINK_BASE
#define CSR_FRAME_LINK_CONTROL_ENABLE_OFFSET 0
#define CSR_FRAME_LINK_SLOT_CONTROL_OPEN_OFFSET 8
#define CSR_FRAME_LINK_SLOT_CONTROL_CLOSE_OFFSET 9
#define CSR_FRAME_LINK_SLOT_STATUS_CLEARING_OFFSET 0
#define CSR_FRAME_LINK_SLOT_STATUS_WRITING_OFFSET 1
#define CSR_FRAME_LINK_SLOT_STATUS_SLOT_OFFSET 4
#define CSR_FRAME_LINK_SLOT_STATUS_SLOT_SIZE 4
#define CSR_FRAME_LINK_SEND_CONTROL_REPLY_OFFSET 0
#define CSR_FRAME_LINK_SEND_CONTROL_RUN_OFFSET 1
#define CSR_FRAME_LINK_SEND_CONTROL_ABORT_OFFSET 2
#define CSR_FRAME_LINK_SEND_STATUS_REPLY_BUSY_OFFSET 0
#define CSR_FRAME_LINK_SEND_STATUS_RUN_BUSY_OFFSET 1
#define CSR_FRAME_LINK_STREAM_CONTROL_OPEN_OFFSET 0
#define CSR_FRAME_LINK_STREAM_CONTROL_CLOSE_OFFSET 1
#define CSR_FRAME_LINK_STREAM_STATUS_OPEN_OFFSET 0

void frame_link_mac_high_write(uint16_t value);
void frame_link_mac_low_write(uint32_t value);
void frame_link_netmask_write(uint32_t value);
void frame_link_gateway_write(uint32_t value);
void frame_link_address_write(uint32_t value);
void frame_link_control_write(uint8_t value);
void frame_link_token_write(uint32_t value);
void frame_link_peer_address_write(uint32_t value);
void frame_link_peer_port_write(uint16_t value);
void frame_link_slot_frame_id_write(uint32_t value);
void frame_link_slot_base_write(uint32_t value);
void frame_link_slot_pixels_write(uint32_t value);
void frame_link_slot_control_write(uint16_t value);
void frame_link_arrived_index_write(uint16_t value);
void frame_link_mailbox_base_write(uint32_t value);
void frame_link_mailbox_consumed_write(uint8_t value);
void frame_link_send_address_write(uint32_t value);
void frame_link_send_port_write(uint16_t value);
void frame_link_send_type_write(uint8_t value);
void frame_link_send_session_write(uint32_t value);
void frame_link_send_sequence_write(uint32_t value);
void frame_link_send_frame_id_write(uint32_t value);
void frame_link_send_offset_write(uint32_t value);
void frame_link_send_base_write(uint32_t value);
void frame_link_send_length_write(uint32_t value);
void frame_link_send_control_write(uint8_t value);
void frame_link_stream_frame_id_write(uint32_t value);
void frame_link_stream_pixels_write(uint32_t value);
void frame_link_stream_sequence_write(uint32_t value);
void frame_link_stream_control_write(uint8_t value);
void frame_link_counter_index_write(uint8_t value);

uint16_t frame_link_version_read(void);
uint8_t frame_link_slots_read(void);
uint16_t frame_link_max_chunks_read(void);
uint8_t frame_link_mailbox_entries_read(void);
uint16_t frame_link_alignment_read(void);
uint16_t frame_link_port_read(void);
uint8_t frame_link_slot_status_read(void);
uint32_t frame_link_arrived_read(void);
uint8_t frame_link_mailbox_produced_read(void);
uint8_t frame_link_send_status_read(void);
uint8_t frame_link_streaming_read(void);
uint8_t frame_link_stream_status_read(void);
uint32_t frame_link_stream_offset_read(void);
uint32_t frame_link_counter_read(void);
#endif

#define CSR_RESET_RECORD_BASE 0xf0004000L

uint32_t reset_record_cause_read(void);
uint32_t reset_record_place_read(void);
void     reset_record_cause_write(uint32_t value);
void     reset_record_place_write(uint32_t value);

#ifdef WITH_WATCHDOG
#define CSR_WATCHDOG0_BASE    0xf0004800L

#define CSR_WATCHDOG0_CONTROL_FEED_OFFSET 0
#define CSR_WATCHDOG0_CONTROL_ENABLE_OFFSET 8
#define CSR_WATCHDOG0_CONTROL_RESET_OFFSET 16
#define CSR_WATCHDOG0_EV_PENDING_WDT_OFFSET 0
#define CSR_WATCHDOG0_EV_ENABLE_WDT_OFFSET 0

uint32_t watchdog0_control_read(void);
uint32_t watchdog0_cycles_read(void);
void     watchdog0_control_write(uint32_t value);
void     watchdog0_cycles_write(uint32_t value);
void     watchdog0_ev_pending_write(uint32_t value);
void     watchdog0_ev_enable_write(uint32_t value);
#endif

#define CSR_CTRL_RESET_SOC_RST_OFFSET 0

void     ctrl_reset_write(uint32_t value);

#ifdef CSR_VIDEO_FRAMEBUFFER_BASE
void     video_framebuffer_dma_base_write(uint32_t value);
void     video_framebuffer_dma_enable_write(uint32_t value);
#endif

#ifdef CSR_FLASH_BASE
#define CSR_FLASH_W_CLK_OFFSET 0
#define CSR_FLASH_W_MOSI_OFFSET 1
#define CSR_FLASH_W_OE_OFFSET 2
#define CSR_FLASH_W_CS_OFFSET 4
#define CSR_FLASH_R_MISO_OFFSET 0

void     flash_w_write(uint32_t value);
uint32_t flash_r_read(void);
#endif

uint32_t uart_rxtx_read(void);
uint32_t uart_rxempty_read(void);
uint32_t uart_rxfull_read(void);
uint32_t uart_txempty_read(void);
uint32_t uart_txfull_read(void);
void     uart_rxtx_write(uint32_t value);
void     uart_ev_pending_write(uint32_t value);
void     uart_ev_enable_write(uint32_t value);

#endif
