/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Replaces the header that LiteX generates. */

#ifndef STUB_GENERATED_SOC_H
#define STUB_GENERATED_SOC_H

#define CONFIG_CLOCK_FREQUENCY 1000000

#define UART_RX_FIFO_DEPTH 256
#define UART_TX_FIFO_DEPTH 16

#define NETWORK_MAC_HIGH 0x10e2
#define NETWORK_MAC_LOW  0xd5000002
#define NETWORK_NETMASK  0xffffff00
#define NETWORK_GATEWAY  0xc0a80101
#define NETWORK_ADDRESS  0xc0a80132

#ifndef WITHOUT_FLASH
#define FLASH_IMAGES        2
#define FLASH_IMAGES_OFFSET 0x100000
#define FLASH_IMAGE_BYTES   0x40000
#define FLASH_RECORDS_OFFSET 0x180000
#define FLASH_RECORDS_BYTES  0x50000
#endif

#ifndef WITHOUT_SCREEN
#define VIDEO_FRAMEBUFFER_HRES  64
#define VIDEO_FRAMEBUFFER_VRES  48
#define VIDEO_FRAMEBUFFER_DEPTH 8
#endif

#endif
