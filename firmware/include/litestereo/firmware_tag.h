/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The last bytes of every program: its version and the SoC that it is built for. They are checked before the program is
 * written to a flash. */

#ifndef LITESTEREO_FIRMWARE_TAG_H
#define LITESTEREO_FIRMWARE_TAG_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/** Major x 256 + minor. */
#ifndef FIRMWARE_VERSION
#define FIRMWARE_VERSION 0x0001u
#endif

/** Flag: the program takes part in trials, see trial.h. */
#define FIRMWARE_TAG_CONFIRMS 1u

#define FIRMWARE_TAG_MAGIC     "LSFW"
#define FIRMWARE_TAG_NAME_SIZE 16u

/** The tag; little-endian. */
typedef struct {
    char     magic[4];                      /**< FIRMWARE_TAG_MAGIC, without its zero. */
    uint32_t soc;                           /**< Checksum of the SoC's addresses, sizes and constants. */
    uint32_t version;                       /**< FIRMWARE_VERSION. */
    uint32_t flags;                         /**< FIRMWARE_TAG_CONFIRMS or 0. */
    char     name[FIRMWARE_TAG_NAME_SIZE];  /**< Name of the device. */
} firmware_tag_t;

/** The tag of this program. */
extern const firmware_tag_t firmware_tag;

#ifdef __cplusplus
}
#endif

#endif
