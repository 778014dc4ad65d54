/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Stands in for the header that LiteX generates: a test supplies the functions. */

#ifndef STUB_GENERATED_CSR_H
#define STUB_GENERATED_CSR_H

#include <stdint.h>

#define CSR_STEREO_BASE 0xf0001000L
#define CSR_UART_BASE   0xf0002000L
#define CSR_TIMER0_UPTIME_CYCLES_ADDR 0xf0003000L

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
uint32_t stereo_features_read(void);
uint32_t stereo_dma_alignment_read(void);
uint32_t stereo_ev_pending_read(void);

uint32_t uart_rxtx_read(void);
uint32_t uart_rxempty_read(void);
uint32_t uart_rxfull_read(void);
uint32_t uart_txempty_read(void);
uint32_t uart_txfull_read(void);
void     uart_rxtx_write(uint32_t value);
void     uart_ev_pending_write(uint32_t value);
void     uart_ev_enable_write(uint32_t value);

#endif
