/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "litestereo/calibration.h"

#include <string.h>

#include "bytes.h"
#include "litestereo/crc32.h"

/* Where the fields are. */
enum {
    AT_MAGIC = 0, AT_VERSION = 4, AT_HEADER = 6, AT_LENGTH = 8, AT_WIDTH = 12, AT_HEIGHT = 14, AT_STEP = 16, AT_SPAN = 18,
    AT_GRID_CRC = 24, AT_FOCAL = 28, AT_DOFFS = 44, AT_BASELINE = 48, AT_LEFT = 64, AT_RIGHT = 456,
};

/* Displacements per node at which positions do not move on any more. */
#define FOLD (-(int32_t)CALIBRATION_STEP * 128)

/* A number of 32 bits as IEEE 754 has it, times `scale`, rounded; 0 if that is no number of 31 bits. In integers: the CPU
 * has no others. */
static int32_t get_scaled(const uint8_t *at, uint32_t scale)
{
    uint32_t bits     = get_u32(at);
    int32_t  exponent = (int32_t)(bits >> 23 & 0xff) - 127 - 23;
    uint64_t value    = ((bits & 0x7fffff) | 0x800000) * (uint64_t)scale;

    if (exponent < -62) {
        return 0;
    }
    if (exponent < 0) {
        value = (value + (1ull << (-exponent - 1))) >> -exponent;
    } else if (exponent < 8) {
        value <<= exponent;
    } else {
        return 0;
    }
    if (value > INT32_MAX) {
        return 0;
    }
    return bits >> 31 != 0 ? -(int32_t)value : (int32_t)value;
}

static stereo_camera_t get_camera(const uint8_t *record)
{
    int32_t focal    = get_scaled(record + AT_FOCAL, 16);
    int32_t baseline = get_scaled(record + AT_BASELINE, 1000000);

    return (stereo_camera_t){
        .focal_px16  = focal > 0 ? (uint32_t)focal : 0,
        .baseline_um = baseline > 0 ? (uint32_t)baseline : 0,
        .doffs_px16  = get_scaled(record + AT_DOFFS, 16),
    };
}

/* What is in a record before its nodes; STATUS_HEADER or STATUS_SIZE if that is not as it must be. */
static status_t parse_header(calibration_t *calibration, const uint8_t *record, uint32_t size)
{
    if (size < CALIBRATION_HEADER_BYTES || get_u32(record + AT_MAGIC) != CALIBRATION_MAGIC
        || get_u16(record + AT_VERSION) != CALIBRATION_VERSION || get_u16(record + AT_HEADER) != CALIBRATION_HEADER_BYTES
        || get_u16(record + AT_STEP) != CALIBRATION_STEP) {
        return STATUS_HEADER;
    }
    if (get_u16(record + AT_WIDTH) < 2 || get_u16(record + AT_HEIGHT) < 2) {
        return STATUS_SIZE;
    }
    *calibration = (calibration_t){
        .width    = get_u16(record + AT_WIDTH),
        .height   = get_u16(record + AT_HEIGHT),
        .span     = get_u16(record + AT_SPAN),
        .grid_crc = get_u32(record + AT_GRID_CRC),
        .camera   = get_camera(record),
        .record   = record,
        .size     = size,
    };
    memcpy(calibration->left, record + AT_LEFT, CALIBRATION_NAME_BYTES);
    memcpy(calibration->right, record + AT_RIGHT, CALIBRATION_NAME_BYTES);
    return STATUS_OK;
}

status_t calibration_parse(calibration_t *calibration, const uint8_t *record, uint32_t size)
{
    uint32_t bytes;
    status_t status;

    *calibration = (calibration_t){0};
    status = parse_header(calibration, record, size);
    if (status != STATUS_OK) {
        return status;
    }
    bytes = 2 * CALIBRATION_NODE_BYTES * calibration_nodes(calibration);
    if (size != CALIBRATION_HEADER_BYTES + bytes + CALIBRATION_CRC_BYTES || get_u32(record + AT_LENGTH) != size) {
        return STATUS_LENGTH;
    }
    if (crc32_update(0, record, size - CALIBRATION_CRC_BYTES) != get_u32(record + size - CALIBRATION_CRC_BYTES)) {
        return STATUS_CRC;
    }
    return crc32_update(0, record + CALIBRATION_HEADER_BYTES, bytes) == calibration->grid_crc ? STATUS_OK : STATUS_CRC;
}

bool calibration_folds(const calibration_t *calibration)
{
    uint32_t columns = calibration_columns(calibration);
    uint32_t nodes   = calibration_nodes(calibration);

    for (unsigned camera = 0; camera < 2; camera++) {
        for (uint32_t node = 0; node < nodes; node++) {
            /* The next node to the right must be to the right of this one, the node below must be below it. */
            if (node % columns + 1 < columns && calibration_node(calibration, camera, node + 1, 0)
                - calibration_node(calibration, camera, node, 0) <= FOLD) {
                return true;
            }
            if (node + columns < nodes && calibration_node(calibration, camera, node + columns, 1)
                - calibration_node(calibration, camera, node, 1) <= FOLD) {
                return true;
            }
        }
    }
    return false;
}
