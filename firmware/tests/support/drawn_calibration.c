/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "drawn_calibration.h"

#include <string.h>

#include "lib/bytes.h"
#include "litestereo/crc32.h"

#define HEADER 848u

static uint32_t nodes_of(const uint8_t *record)
{
    return ((get_u16(record + 12) - 1u) / 16 + 2) * ((get_u16(record + 14) - 1u) / 16 + 2);
}

void seal_calibration(uint8_t *record, uint32_t size)
{
    put_u32(record + 24, crc32_update(0, record + HEADER, size - HEADER - 4));
    put_u32(record + size - 4, crc32_update(0, record, size - 4));
}

static void put_float(uint8_t *at, float value)
{
    uint32_t bits;

    memcpy(&bits, &value, sizeof(bits));
    put_u32(at, bits);
}

uint32_t draw_calibration(uint8_t *record, uint16_t width, uint16_t height, int left_rows, int right_rows)
{
    uint32_t size, nodes;

    memset(record, 0, HEADER);
    memcpy(record, "LSCA", 4);
    put_u16(record + 4, 1);
    put_u16(record + 6, HEADER);
    put_u16(record + 12, width);
    put_u16(record + 14, height);
    put_u16(record + 16, 16);
    put_u16(record + 18, 2);
    put_float(record + 28, 400.5f);
    put_float(record + 44, -1.5f);
    put_float(record + 48, 0.06f);
    memcpy(record + 64, "left of rig 7", 13);
    memcpy(record + 456, "right of rig 7", 14);
    nodes = nodes_of(record);
    size  = HEADER + 8 * nodes + 4;
    put_u32(record + 8, size);
    for (uint32_t node = 0; node < nodes; node++) {
        put_u32(record + HEADER + 4 * node, (uint32_t)(uint16_t)(left_rows * 128) << 16);
        put_u32(record + HEADER + 4 * (nodes + node), (uint32_t)(uint16_t)(right_rows * 128) << 16);
    }
    seal_calibration(record, size);
    return size;
}

void set_calibration_node(uint8_t *record, uint32_t size, unsigned camera, uint32_t node, int16_t column, int16_t row)
{
    put_u32(record + HEADER + 4 * (camera * nodes_of(record) + node), (uint16_t)column | (uint32_t)(uint16_t)row << 16);
    seal_calibration(record, size);
}
