/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "fake_sensors.h"

#include <string.h>

#include "require.h"

/* What a register has after a reset that neither is the identity nor the witness. */
#define AFTER_RESET 0x5a5a

/* Reads of the time that make a long pause. */
#define LONG_WAIT 64u

/* States of a slave: bytes that it gets are address, register, value; then bytes that it sends. */
typedef enum { IDLE, ADDRESS, REGISTER, VALUE, SEND, IGNORE } state_t;

typedef struct {
    state_t  state;
    unsigned bits;      /* Of the byte under way, 9 with the acknowledgement. */
    uint8_t  shift;     /* The byte under way. */
    unsigned bytes;     /* Bytes of the register or the value so far. */
    uint16_t reg;
    uint16_t value;
    bool     low;       /* It drives data low. */
    bool     sda;       /* Level of its data line. */
    bool     fresh;     /* The register was written in this transfer: no stop since. */
    uint64_t held_until;
} slave_t;

fake_sensors_t fake_sensors;

static const sensor_model_t *model;
static uint32_t              clock_hz;
static slave_t               slaves[FAKE_SENSORS];
static uint32_t              driven; /* Pins that the master drives low. */
static bool                  scl;
static unsigned              reads;  /* Of the time, since pins were used. */

/* Registers. */

uint16_t *fake_register(unsigned sensor, uint16_t reg)
{
    return &fake_sensors.sensors[sensor].registers[reg % FAKE_REGISTERS];
}

static void restore(unsigned index)
{
    fake_sensor_t *sensor = &fake_sensors.sensors[index];

    for (uint32_t i = 0; i < FAKE_REGISTERS; i++) {
        sensor->registers[i] = model->value_bytes == 2 ? AFTER_RESET : AFTER_RESET & 0xff;
    }
    *fake_register(index, model->witness.reg) = (uint16_t)~model->witness.value;
    for (size_t i = 0; i < model->identity.count; i++) {
        *fake_register(index, model->identity.writes[i].reg) = model->identity.writes[i].value;
    }
}

static bool is_identity(uint16_t reg)
{
    for (size_t i = 0; i < model->identity.count; i++) {
        if (model->identity.writes[i].reg == reg) {
            return true;
        }
    }
    return false;
}

/* The first write of every set-up is a reset. */
static bool is_reset(uint16_t reg, uint16_t value)
{
    return reg == model->set_up.writes[0].reg && value == model->set_up.writes[0].value;
}

static void store(unsigned index)
{
    fake_sensor_t *sensor = &fake_sensors.sensors[index];
    slave_t       *slave  = &slaves[index];

    sensor->log[sensor->count++ % FAKE_WRITES] = (fake_write_t){slave->reg, slave->value, fake_sensors.clock};
    if (is_reset(slave->reg, slave->value)) {
        sensor->resets++;
        restore(index);
    } else if (slave->reg != sensor->deaf && !is_identity(slave->reg)) {
        *fake_register(index, slave->reg) = slave->value;
    }
}

/* Lines. */

static bool data_low(unsigned index)
{
    const fake_sensor_t *sensor = &fake_sensors.sensors[index];

    return sensor->present && (slaves[index].low || sensor->hold || sensor->hold_edges > 0);
}

static bool data_level(unsigned index)
{
    return (driven & (index == 0 ? SENSOR_PIN_SDA_LEFT : SENSOR_PIN_SDA_RIGHT)) == 0 && !data_low(index);
}

static bool clock_level(void)
{
    if ((driven & SENSOR_PIN_SCL) != 0) {
        return false;
    }
    for (unsigned i = 0; i < FAKE_SENSORS; i++) {
        const fake_sensor_t *sensor = &fake_sensors.sensors[i];

        if (sensor->present && (sensor->stretch_ever || fake_sensors.clock < slaves[i].held_until)) {
            return false;
        }
    }
    return true;
}

/* The slave. */

static void begin_byte(slave_t *slave)
{
    slave->bits  = 0;
    slave->shift = 0;
}

static void start(unsigned index)
{
    slave_t *slave = &slaves[index];

    slave->state = ADDRESS;
    slave->low   = false;
    begin_byte(slave);
}

static void stop(unsigned index)
{
    slave_t *slave = &slaves[index];

    slave->state = IDLE;
    slave->low   = false;
    slave->fresh = false;
}

/* Whether it acknowledges the byte that it got, and what comes next. */
static bool accept(unsigned index)
{
    fake_sensor_t *sensor = &fake_sensors.sensors[index];
    slave_t       *slave  = &slaves[index];

    if (slave->state == ADDRESS && slave->shift >> 1 != model->address) {
        slave->state = IGNORE;
        return false;
    }
    sensor->bytes++;
    if (sensor->nack_at > 0 && --sensor->nack_at == 0) {
        slave->state = IGNORE;
        return false;
    }
    if (slave->state == ADDRESS) {
        slave->state = (slave->shift & 1) != 0 ? SEND : REGISTER;
        slave->bytes = 0;
        /* A slave with SCCB cannot be read after a repeated start. */
        if (slave->state == SEND && slave->fresh && model->sccb) {
            slave->state = IGNORE;
            return false;
        }
    } else if (slave->state == REGISTER) {
        slave->reg   = (uint16_t)(slave->bytes == 0 ? slave->shift : slave->reg << 8 | slave->shift);
        slave->fresh = true;
        if (++slave->bytes == model->register_bytes) {
            slave->state = VALUE;
            slave->bytes = 0;
        }
    } else {
        slave->value = (uint16_t)(slave->bytes == 0 ? slave->shift : slave->value << 8 | slave->shift);
        if (++slave->bytes == model->value_bytes) {
            store(index);
            slave->bytes = 0;
        }
    }
    return true;
}

static uint8_t byte_to_send(unsigned index)
{
    const slave_t *slave = &slaves[index];
    uint16_t       value = *fake_register(index, slave->reg);

    value ^= fake_sensors.sensors[index].other && is_identity(slave->reg);

    return (uint8_t)(model->value_bytes == 2 && slave->bytes == 0 ? value >> 8 : value);
}

static void rising(unsigned index)
{
    slave_t *slave = &slaves[index];

    if (slave->state == IDLE || slave->state == IGNORE) {
        return;
    }
    if (slave->bits < 8) {
        slave->shift = (uint8_t)(slave->shift << 1 | slave->sda);
    } else if (slave->state == SEND && !slave->low) {
        /* The master's acknowledgement; without it it sends no more. */
        slave->bytes++;
        fake_sensors.sensors[index].sent++;
        if (slave->sda) {
            slave->state = IGNORE;
        }
    }
    slave->bits++;
}

static void falling(unsigned index)
{
    fake_sensor_t *sensor = &fake_sensors.sensors[index];
    slave_t       *slave  = &slaves[index];
    bool           sends  = slave->state == SEND;

    if (sensor->hold_edges > 0) {
        sensor->hold_edges--;
    }
    if (sensor->unplug_at > 0 && --sensor->unplug_at == 0) {
        fake_sensor_plug(index, false);
    }
    if (!sensor->present || slave->state == IDLE || slave->state == IGNORE) {
        slave->low = false;
        return;
    }
    if (slave->bits == 8 && !sends) {
        slave->low        = accept(index);
        slave->held_until = fake_sensors.clock + sensor->stretch;
        return;
    }
    if (slave->bits == 9) {
        begin_byte(slave);
        sends = slave->state == SEND;
    }
    slave->low = sends && slave->bits < 8 && (byte_to_send(index) >> (7 - slave->bits) & 1) == 0;
}

/* Edges of all lines, after a change of a pin or of the time. */
static void settle(void)
{
    bool was = scl, starts = false, stops = false;

    scl = clock_level();
    if (scl && !was) {
        fake_sensors.high_since = fake_sensors.clock;
        if (fake_sensors.clock - fake_sensors.low_since < fake_sensors.least_low) {
            fake_sensors.least_low = fake_sensors.clock - fake_sensors.low_since;
        }
    } else if (!scl && was) {
        fake_sensors.low_since = fake_sensors.clock;
        fake_sensors.clocks++;
        if (fake_sensors.clock - fake_sensors.high_since < fake_sensors.least_high) {
            fake_sensors.least_high = fake_sensors.clock - fake_sensors.high_since;
        }
    }
    for (unsigned i = 0; i < FAKE_SENSORS; i++) {
        slave_t *slave = &slaves[i];
        bool     sda   = data_level(i), changed = sda != slave->sda;

        slave->sda = sda;
        if (scl && was && changed) {
            starts |= !sda;
            stops  |= sda;
            if (fake_sensors.sensors[i].present) {
                (sda ? stop : start)(i);
            }
        } else if (scl && !was) {
            rising(i);
        } else if (!scl && was) {
            falling(i);
        }
        slave->sda = data_level(i);
    }
    if (starts && fake_sensors.woke_after == 0) {
        fake_sensors.woke_after = fake_sensors.clock - fake_sensors.reset_at - fake_sensors.reset_for;
    }
    /* Of both sensors at once it is one. */
    fake_sensors.starts += starts;
    fake_sensors.stops  += stops;
}

static void drive(void *context, uint32_t pins)
{
    REQUIRE(context == &fake_sensors);
    if ((pins & SENSOR_PIN_RESET) == 0 && (driven & SENSOR_PIN_RESET) != 0) {
        fake_sensors.reset_for  = fake_sensors.clock - fake_sensors.reset_at;
        fake_sensors.woke_after = 0;
    }
    if ((pins & SENSOR_PIN_RESET) != 0 && (driven & SENSOR_PIN_RESET) == 0) {
        fake_sensors.reset_at = fake_sensors.clock;
        for (unsigned i = 0; i < FAKE_SENSORS; i++) {
            fake_sensors.sensors[i].resets += fake_sensors.sensors[i].present;
            restore(i);
            stop(i);
        }
    }
    driven = pins;
    reads  = 0;
    settle();
}

static uint32_t sample(void *context)
{
    REQUIRE(context == &fake_sensors);
    reads = 0;
    settle();
    return ((fake_sensors.slow ? (driven & SENSOR_PIN_SCL) == 0 : scl) ? (uint32_t)SENSOR_PIN_SCL : 0)
        | (slaves[0].sda ? (uint32_t)SENSOR_PIN_SDA_LEFT : 0) | (slaves[1].sda ? (uint32_t)SENSOR_PIN_SDA_RIGHT : 0);
}

static uint64_t get_clock(void *context)
{
    REQUIRE(context == &fake_sensors);
    /* Long pauses need not be waited for. */
    fake_sensors.clock += ++reads > LONG_WAIT ? fake_sensors.step * LONG_WAIT : fake_sensors.step;
    settle();
    return fake_sensors.clock;
}

sensor_pins_t fake_sensors_pins(void)
{
    return (sensor_pins_t){
        .drive = drive, .sample = sample, .clock = get_clock, .clock_hz = clock_hz, .context = &fake_sensors,
    };
}

void fake_sensors_set_up(const sensor_model_t *of, uint32_t hz)
{
    model    = of;
    clock_hz = hz;
    driven   = 0;
    scl      = true;
    memset(&fake_sensors, 0, sizeof(fake_sensors));
    memset(slaves, 0, sizeof(slaves));
    fake_sensors.step       = hz / 10000000u + 1;
    fake_sensors.least_low  = UINT64_MAX;
    fake_sensors.least_high = UINT64_MAX;
    for (unsigned i = 0; i < FAKE_SENSORS; i++) {
        fake_sensor_plug(i, true);
        fake_sensors.sensors[i].deaf = -1;
        slaves[i].sda                = true;
    }
}

void fake_sensor_plug(unsigned sensor, bool present)
{
    fake_sensors.sensors[sensor].present = present;
    restore(sensor);
    stop(sensor);
    slaves[sensor].held_until = 0;
}

bool fake_sensors_idle(void)
{
    settle();
    return (driven & ~(uint32_t)SENSOR_PIN_RESET) == 0 && scl && slaves[0].sda && slaves[1].sda
        && slaves[0].state == IDLE && slaves[1].state == IDLE;
}
