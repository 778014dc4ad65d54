/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Two image sensors at the pins of a bus: a slave with a file of registers on each data line. Both see the one
 * clock. They know nothing of what the registers mean, apart from the identity and what a reset does; and they can
 * fail. */

#ifndef FAKE_SENSORS_H
#define FAKE_SENSORS_H

#include <stdbool.h>
#include <stdint.h>

#include "drivers/sensors/sensor_model.h"

/** The left sensor, and the right one. */
#define FAKE_SENSORS 2

/** Registers that the tests tell apart: those of a sensor differ in the lowest 12 bits of their addresses. */
#define FAKE_REGISTERS 4096u

/** Writes in the log. */
#define FAKE_WRITES 256u

/** A write that a sensor has accepted. */
typedef struct {
    uint16_t reg;
    uint16_t value;
    uint64_t clock;
} fake_write_t;

/** One of the sensors. Tests may change the members up to the log. */
typedef struct {
    bool     present;      /**< It is plugged in; otherwise its data line is high, by its pull-up. */
    uint32_t nack_at;      /**< This byte that it gets is not acknowledged, 1 for the next one; 0 for none. */
    uint32_t unplug_at;    /**< With this falling edge of the clock it is unplugged, 1 for the next one; 0 for none. */
    uint32_t hold_edges;   /**< It holds data low for so many clocks. */
    bool     hold;         /**< It holds data low for ever. */
    uint64_t stretch;      /**< It holds the clock low for so long after each byte, in clocks of the system. */
    bool     stretch_ever; /**< It holds the clock low for ever. */
    bool     other;        /**< It is of another kind: its identity differs in a bit. */
    int32_t  deaf;         /**< A register that ignores writes; -1 for none. */
    uint16_t registers[FAKE_REGISTERS];
    uint32_t resets;       /**< By its pin or a register. */
    uint32_t sent;         /**< Bytes that it sent. */
    uint32_t bytes;        /**< Bytes that it got: addresses of other sensors do not count. */
    uint32_t count;        /**< Writes so far. */
    fake_write_t log[FAKE_WRITES]; /**< The newest ones: write i is at i % FAKE_WRITES. */
} fake_sensor_t;

/** The bus. */
typedef struct {
    uint64_t      clock;       /**< Clocks of the system since set-up. */
    uint32_t      step;        /**< Clocks between two calls; tests may change it. */
    uint64_t      low_since;   /**< When the bus's clock fell. */
    uint64_t      high_since;  /**< When it rose. */
    uint64_t      least_low;   /**< Shortest time that it was low, */
    uint64_t      least_high;  /**< and high. */
    uint64_t      clocks;      /**< Its falling edges. */
    uint32_t      starts;      /**< Starts, repeated ones as well, */
    uint32_t      stops;       /**< and stops. */
    uint64_t      reset_at;    /**< When the reset was last asserted. */
    uint64_t      reset_for;   /**< How long, the last time. */
    uint64_t      woke_after;  /**< Time from its end to the first start. */
    bool          slow;        /**< SCL cannot be read: it follows what is driven. */
    fake_sensor_t sensors[FAKE_SENSORS];
} fake_sensors_t;

/** The only pair. */
extern fake_sensors_t fake_sensors;

/** A new pair of this model, plugged in and without power-on faults; its registers have what a reset leaves. */
void fake_sensors_set_up(const sensor_model_t *model, uint32_t clock_hz);

/** What the driver gets. */
sensor_pins_t fake_sensors_pins(void);

/** Plugs a sensor in, or unplugs it: 0 for the left one. After that its registers have what a reset leaves. */
void fake_sensor_plug(unsigned sensor, bool present);

/** A register of a sensor. */
uint16_t *fake_register(unsigned sensor, uint16_t reg);

/** Whether the bus is idle: all lines high, and both sensors wait for a start. */
bool fake_sensors_idle(void);

#endif
