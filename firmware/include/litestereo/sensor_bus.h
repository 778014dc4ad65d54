/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The two-wire bus (I2C, SCCB) of two image sensors, driven by software at 100 kHz: one clock, and a data line for
 * each sensor. So both get a write at the same time, even if they have the same address, and each is read alone.
 *
 * What it touches is a few pins and a clock, which the caller gives as functions (sensor_pins_t). Every wait is
 * bounded. */

#ifndef LITESTEREO_SENSOR_BUS_H
#define LITESTEREO_SENSOR_BUS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "litestereo/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Sensors that a transfer is for: one of them, or both. */
enum { SENSOR_LEFT = 1, SENSOR_RIGHT = 2, SENSOR_BOTH = 3 };

/** Pins of a pair of sensors. All are driven low or released; those of the bus have a pull-up. */
enum {
    SENSOR_PIN_SCL       = 1, /**< Clock of the bus, of both sensors. */
    SENSOR_PIN_SDA_LEFT  = 2, /**< Data of the left sensor. */
    SENSOR_PIN_SDA_RIGHT = 4, /**< Data of the right one. */
    SENSOR_PIN_RESET     = 8, /**< Reset of both, active low; a board need not have it. */
};

/** The pins and the clock of a SoC. */
typedef struct {
    void     (*drive)(void *context, uint32_t pins); /**< Drives these pins low and releases all others. */
    uint32_t (*sample)(void *context);               /**< Pins of the bus that are high. If SCL cannot be read, it is
                                                          high unless it is driven low. */
    uint64_t (*clock)(void *context);                /**< Clocks since some time; see clock_now. */
    uint32_t clock_hz;                               /**< Clocks per second. */
    void     *context;                               /**< For these functions. */
} sensor_pins_t;

/** What went wrong on the bus, or with what a sensor has answered. */
typedef enum {
    SENSOR_FAULT_NONE = 0,
    SENSOR_FAULT_SCL,       /**< The clock is held low: `STATUS_TIMEOUT`. */
    SENSOR_FAULT_SDA,       /**< Data is held low, also after a recovery: `STATUS_TIMEOUT`. */
    SENSOR_FAULT_NACK,      /**< A byte was not acknowledged: `STATUS_UNSUPPORTED`. */
    SENSOR_FAULT_IDENTITY,  /**< It is another sensor: `STATUS_UNSUPPORTED`. */
    SENSOR_FAULT_READ_BACK, /**< A register does not have what was written: `STATUS_UNSUPPORTED`. */
} sensor_fault_kind_t;

/** The newest fault, for messages. */
typedef struct {
    sensor_fault_kind_t kind;
    uint8_t             sensors;  /**< Sensors that have it; of a held clock both. */
    uint8_t             byte;     /**< Of the bus: byte of the transfer, 0 for the address. */
    uint16_t            reg;      /**< Of an answer: the register, */
    uint16_t            expected; /**< its expected value, */
    uint16_t            value;    /**< and what was read. */
} sensor_fault_t;

/** A bus; read-only for the caller. */
typedef struct {
    sensor_pins_t  pins;
    uint32_t       low;        /**< Pins that are driven low. */
    uint32_t       quarter;    /**< Clocks of a quarter of a bit. */
    uint8_t        byte;       /**< Byte of the transfer under way. */
    uint32_t       recoveries; /**< Times that a held data line was made free. */
    sensor_fault_t fault;
} sensor_bus_t;

/** Releases the bus, and recovers it if a sensor holds its data, as after a restart of the firmware in the midst of a
 * read.
 *
 * STATUS_BAD_ARGUMENT if a function is missing, or the clock is slower than 1 MHz; STATUS_TIMEOUT if the bus is held
 * low.
 */
status_t sensor_bus_init(sensor_bus_t *bus, const sensor_pins_t *pins);

/** Writes bytes to one sensor or to both at once. The bus ends up idle.
 *
 * STATUS_UNSUPPORTED if one of them does not acknowledge a byte: the transfer ends there, for both. STATUS_TIMEOUT
 * if the clock is held low for longer than a millisecond, or data is. STATUS_BAD_ARGUMENT for no sensor.
 */
status_t sensor_bus_write(sensor_bus_t *bus, uint8_t sensors, uint8_t address, const uint8_t *bytes, size_t count);

/** Reads `count` bytes from a register of one sensor; `reg` has the bytes of its address.
 *
 * With `stop` the address is a separate transfer, as SCCB has it; otherwise a repeated start is between. Returns what
 * sensor_bus_write does.
 */
status_t sensor_bus_read(sensor_bus_t *bus, uint8_t sensor, uint8_t address, const uint8_t *reg, size_t reg_count,
    uint8_t *bytes, size_t count, bool stop);

/** Makes up to nine clocks until both data lines are high, then a stop: a sensor in the midst of a read ends it.
 * STATUS_TIMEOUT if a line stays low. Done by the functions above where it is needed. */
status_t sensor_bus_recover(sensor_bus_t *bus);

/** Asserts or releases the reset of both sensors. */
void sensor_bus_reset(sensor_bus_t *bus, bool asserted);

/** Waits. */
void sensor_bus_pause(const sensor_bus_t *bus, uint32_t microseconds);

/** Name of a fault for messages, such as "nack"; "unknown" for a number that is none. */
const char *sensor_fault_name(sensor_fault_kind_t kind);

#ifdef __cplusplus
}
#endif

#endif
