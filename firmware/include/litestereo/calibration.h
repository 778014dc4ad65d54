/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The calibration of a pair of cameras, as a record in flash and the link's messages have it: docs/rectification.md. */

#ifndef LITESTEREO_CALIBRATION_H
#define LITESTEREO_CALIBRATION_H

#include <stdbool.h>
#include <stdint.h>

#include "litestereo/depth.h"
#include "litestereo/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/** First bytes of a calibration, and its version. */
#define CALIBRATION_MAGIC   0x4143534cu
#define CALIBRATION_VERSION 1u

/** Bytes before the nodes, and of the checksum after them. */
#define CALIBRATION_HEADER_BYTES 848u
#define CALIBRATION_CRC_BYTES    4u

/** Bytes of a camera's name. */
#define CALIBRATION_NAME_BYTES 32u

/** Pixels between two nodes. */
#define CALIBRATION_STEP 16u

/** Bytes of a node: its displacement in columns and in rows, 128ths of a pixel. */
#define CALIBRATION_NODE_BYTES 4u

/** A calibration; its nodes, and all else about the cameras, stay in the record. */
typedef struct {
    uint16_t        width;       /**< Of the images, pixels; 0 if there is no calibration. */
    uint16_t        height;      /**< Pixels. */
    uint16_t        span;        /**< Rows of the images that must be there at once, as the host found them. */
    uint32_t        grid_crc;    /**< CRC-32 of all nodes. */
    stereo_camera_t camera;      /**< The rectified cameras, for depth_mm. */
    char            left[CALIBRATION_NAME_BYTES + 1];   /**< Name of the left camera. */
    char            right[CALIBRATION_NAME_BYTES + 1];  /**< Name of the right camera. */
    const uint8_t  *record;      /**< The record that all this is from, */
    uint32_t        size;        /**< and its bytes. */
} calibration_t;

/** Columns of nodes of a camera. */
static inline uint32_t calibration_columns(const calibration_t *calibration)
{
    return (calibration->width - 1u) / CALIBRATION_STEP + 2;
}

/** Nodes of a camera. */
static inline uint32_t calibration_nodes(const calibration_t *calibration)
{
    return calibration_columns(calibration) * ((calibration->height - 1u) / CALIBRATION_STEP + 2);
}

/** Displacement of a node: `camera` 0 is the left one; `axis` 0 is columns, 1 rows. */
static inline int16_t calibration_node(const calibration_t *calibration, unsigned camera, uint32_t node, unsigned axis)
{
    const uint8_t *at = calibration->record + CALIBRATION_HEADER_BYTES
                      + CALIBRATION_NODE_BYTES * (camera * calibration_nodes(calibration) + node) + 2 * axis;

    return (int16_t)(at[0] | at[1] << 8);
}

/** Reads a calibration from a record, which must stay where it is.
 *
 * STATUS_HEADER if it is none of this version, STATUS_SIZE if its images have less than 2 pixels in a direction,
 * STATUS_LENGTH if it has not the bytes that its size needs, STATUS_CRC if it or its nodes do not have their checksum.
 */
status_t calibration_parse(calibration_t *calibration, const uint8_t *record, uint32_t size);

/** Whether the map of a camera folds over: two rectified pixels show the same part of its image. */
bool calibration_folds(const calibration_t *calibration);

/** Counts the rows of the raw images that must be there at once. */
typedef struct {
    const calibration_t *calibration;  /**< Of this calibration. */
    uint32_t             row;          /**< Rectified rows that have been counted. */
    uint32_t             newest;       /**< Raw rows needed so far. */
    uint32_t             span;         /**< Most rows at once. */
} row_budget_t;

/** Begins to count. */
void row_budget_begin(row_budget_t *budget, const calibration_t *calibration);

/** Counts the next rectified row, which takes about a millisecond; returns whether there are more. */
bool row_budget_step(row_budget_t *budget);

/** Rows that gateware must keep, when all have been counted: an even number. */
uint32_t row_budget_rows(const row_budget_t *budget);

#ifdef __cplusplus
}
#endif

#endif
