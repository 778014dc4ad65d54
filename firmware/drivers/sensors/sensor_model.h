/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* What distinguishes one kind of sensor from another: tables of registers, limits, and a few functions that turn
 * settings into values of registers. They touch no sensor; sensors.c does, and is the same for all. */

#ifndef LITESTEREO_DRIVERS_SENSORS_SENSOR_MODEL_H
#define LITESTEREO_DRIVERS_SENSORS_SENSOR_MODEL_H

#include <stddef.h>
#include <string.h>

#include "litestereo/sensor.h"

/** A write to a register. */
typedef struct {
    uint16_t reg;
    uint16_t value;
    uint16_t readable;  /**< Bits that read as they were written; 0 for a register that is not read back. */
    uint16_t pause_ms;  /**< Pause after it. */
} sensor_write_t;

/** A list of writes. */
typedef struct {
    const sensor_write_t *writes;
    size_t                count;
} sensor_list_t;

#define SENSOR_LIST(table) {.writes = (table), .count = sizeof(table) / sizeof((table)[0])}

/** Most writes that one of the functions below makes. */
#define SENSOR_MOST_WRITES 24

struct sensor_model {
    const char     *name;
    uint8_t         address;        /**< On the bus, 7 bits. */
    uint8_t         register_bytes; /**< Bytes of the address of a register. */
    uint8_t         value_bytes;    /**< Bytes of its value, high byte first. */
    bool            sccb;           /**< A read is two transfers, with a stop between. */
    sensor_format_t format;
    uint16_t        wake_ms;        /**< Pause after a reset by the pin. */
    uint32_t        least_hz;       /**< Slowest master clock. */
    uint32_t        most_hz;        /**< Fastest one. */
    uint8_t         clocks;         /**< Clocks of the sensor per clock of the master. */
    sensor_list_t   identity;       /**< Registers that tell its kind, with their values. */
    sensor_list_t   set_up;         /**< Written first. */
    sensor_list_t   start;          /**< Written last: frames begin. */
    sensor_write_t  witness;        /**< One of the above, whose register has another value after a reset. */
    uint16_t        columns;        /**< Of the array of pixels. */
    uint16_t        rows;           /**< Of the array of pixels. */
    bool            whole;          /**< The window is always the whole array. */
    uint8_t         binnings;       /**< Sum of those that it has: 1, 2, 4. */
    uint8_t         multiple;       /**< Window and its place are multiples of so many pixels. */
    uint16_t        blank_rows;     /**< Usual blanking between frames: enough for new values of exposure and gain. */
    uint16_t        exposure_rows;  /**< Rows of a frame that exposure leaves free. */
    uint16_t        most_gain;      /**< Sixteenths. */

    /** Ranges of the timing, for a window that the sensor has. */
    sensor_timing_t (*timing)(const sensor_settings_t *settings);

    /* Each appends the writes of a part of the settings to a list, and returns their number. */

    /** Window, binning and timing. */
    size_t (*frame)(const sensor_settings_t *settings, sensor_write_t *writes);
    /** Exposure and gain. */
    size_t (*expose)(const sensor_settings_t *settings, sensor_write_t *writes);
    /** Test pattern. */
    size_t (*pattern)(const sensor_settings_t *settings, sensor_write_t *writes);
};

/** Copies writes to a list; returns their number. */
static inline size_t sensor_append(sensor_write_t *writes, const sensor_write_t *list, size_t count)
{
    memcpy(writes, list, count * sizeof(*list));
    return count;
}

/** The gain in two factors: a power of two, whose exponent it returns, and the rest, from 16 to 31 sixteenths. */
static inline unsigned sensor_gain_exponent(uint16_t gain, uint16_t *rest)
{
    unsigned exponent = 0;

    for (; gain >= 32; gain >>= 1) {
        exponent++;
    }
    *rest = gain;
    return exponent;
}

#endif
