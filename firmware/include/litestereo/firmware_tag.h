/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The last bytes of each program that is built for a SoC: what it is and what it runs on, for whoever is about to write it
 * to a flash. */

#ifndef LITESTEREO_FIRMWARE_TAG_H
#define LITESTEREO_FIRMWARE_TAG_H

#include <stdint.h>

/** Major x 256 + minor. */
#ifndef FIRMWARE_VERSION
#define FIRMWARE_VERSION 0x0001u
#endif

#define FIRMWARE_TAG_MAGIC     "LSFW"
#define FIRMWARE_TAG_NAME_SIZE 16u

/** As it stands in a program; little-endian. */
typedef struct {
    char     magic[4];                      /**< FIRMWARE_TAG_MAGIC, without its zero. */
    uint32_t soc;                           /**< Checksum of the SoC's addresses, sizes and constants. */
    uint32_t version;                       /**< FIRMWARE_VERSION. */
    uint32_t zero;                          /**< 0. */
    char     name[FIRMWARE_TAG_NAME_SIZE];  /**< What the device calls itself. */
} firmware_tag_t;

/** That of this program. */
extern const firmware_tag_t firmware_tag;

#endif
