/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* A bit is four quarters: data changes after the first one, the clock is high in the last two. So at 100 kHz a
 * sensor has 2.5 us of set-up and hold, and 5 us of each level of the clock. */

#include "litestereo/sensor_bus.h"

#include <string.h>

#define BUS_HZ   100000u
#define LEAST_HZ 1000000u

/* A sensor may hold the clock for so long; none of those that we know does. */
#define STRETCH_US 1000u

#define RECOVERY_CLOCKS 9

static uint32_t data_pins(uint8_t sensors)
{
    return ((sensors & SENSOR_LEFT) != 0 ? (uint32_t)SENSOR_PIN_SDA_LEFT : 0)
        | ((sensors & SENSOR_RIGHT) != 0 ? (uint32_t)SENSOR_PIN_SDA_RIGHT : 0);
}

/* Sensors whose data pins are among these. */
static uint8_t sensors_of(uint32_t pins)
{
    return (uint8_t)(((pins & SENSOR_PIN_SDA_LEFT) != 0 ? SENSOR_LEFT : 0)
        | ((pins & SENSOR_PIN_SDA_RIGHT) != 0 ? SENSOR_RIGHT : 0));
}

static uint64_t now(const sensor_bus_t *bus)
{
    return bus->pins.clock(bus->pins.context);
}

static uint32_t sample(const sensor_bus_t *bus)
{
    return bus->pins.sample(bus->pins.context);
}

static void wait_clocks(const sensor_bus_t *bus, uint64_t clocks)
{
    uint64_t began = now(bus);

    while (now(bus) - began < clocks) {
    }
}

static void wait_quarters(const sensor_bus_t *bus, unsigned quarters)
{
    wait_clocks(bus, (uint64_t)bus->quarter * quarters);
}

static void pull(sensor_bus_t *bus, uint32_t pins)
{
    bus->low |= pins;
    bus->pins.drive(bus->pins.context, bus->low);
}

static void release(sensor_bus_t *bus, uint32_t pins)
{
    bus->low &= ~pins;
    bus->pins.drive(bus->pins.context, bus->low);
}

static status_t fail(sensor_bus_t *bus, sensor_fault_kind_t kind, uint8_t sensors)
{
    bus->fault = (sensor_fault_t){.kind = kind, .sensors = sensors, .byte = bus->byte};
    return kind == SENSOR_FAULT_NACK ? STATUS_UNSUPPORTED : STATUS_TIMEOUT;
}

/* Lets the clock rise, and waits until no sensor holds it. */
static status_t raise_clock(sensor_bus_t *bus)
{
    uint64_t began = now(bus);
    uint64_t limit = (uint64_t)bus->pins.clock_hz * STRETCH_US / 1000000u;

    release(bus, SENSOR_PIN_SCL);
    while ((sample(bus) & SENSOR_PIN_SCL) == 0) {
        if (now(bus) - began > limit) {
            return fail(bus, SENSOR_FAULT_SCL, SENSOR_BOTH);
        }
    }
    return STATUS_OK;
}

/* Sends a bit on these data pins, or receives one with `bit` true; writes to `level` the pins that were high. The
 * clock is low before and after. */
static status_t exchange(sensor_bus_t *bus, uint32_t data, bool bit, uint32_t *level)
{
    status_t status;

    wait_quarters(bus, 1);
    if (bit) {
        release(bus, data);
    } else {
        pull(bus, data);
    }
    wait_quarters(bus, 1);
    status = raise_clock(bus);
    wait_quarters(bus, 2);
    *level = sample(bus);
    pull(bus, SENSOR_PIN_SCL);
    return status;
}

/* Data falls while the clock is high: at an idle bus, or within a transfer. The clock is low afterwards. */
static status_t begin(sensor_bus_t *bus, uint32_t data)
{
    status_t status;

    release(bus, data);
    wait_quarters(bus, 2);
    status = raise_clock(bus);
    if (status != STATUS_OK) {
        return status;
    }
    wait_quarters(bus, 2);
    if ((sample(bus) & data) != data) {
        return fail(bus, SENSOR_FAULT_SDA, sensors_of(data & ~sample(bus)));
    }
    pull(bus, data);
    wait_quarters(bus, 2);
    pull(bus, SENSOR_PIN_SCL);
    return STATUS_OK;
}

/* Data rises while the clock is high. Also done after a fault, whose cause it leaves as it is. */
static status_t end(sensor_bus_t *bus, uint32_t data)
{
    status_t status;

    wait_quarters(bus, 1);
    pull(bus, data);
    wait_quarters(bus, 1);
    status = raise_clock(bus);
    wait_quarters(bus, 2);
    release(bus, data);
    wait_quarters(bus, 2);
    return status;
}

static status_t send_byte(sensor_bus_t *bus, uint32_t data, uint8_t byte)
{
    uint32_t level;
    status_t status;

    for (int bit = 7; bit >= 0; bit--) {
        bool one = (byte >> bit & 1) != 0;

        status = exchange(bus, data, one, &level);
        if (status != STATUS_OK) {
            return status;
        }
        if (one && (level & data) != data) {
            return fail(bus, SENSOR_FAULT_SDA, sensors_of(data & ~level));
        }
    }
    status = exchange(bus, data, true, &level);
    if (status == STATUS_OK && (level & data) != 0) {
        status = fail(bus, SENSOR_FAULT_NACK, sensors_of(level & data));
    }
    bus->byte++;
    return status;
}

static status_t receive_byte(sensor_bus_t *bus, uint32_t data, uint8_t *byte, bool last)
{
    uint32_t level;
    status_t status = STATUS_OK;

    *byte = 0;
    for (int bit = 7; bit >= 0 && status == STATUS_OK; bit--) {
        status = exchange(bus, data, true, &level);
        *byte  = (uint8_t)(*byte << 1 | ((level & data) != 0));
    }
    if (status == STATUS_OK) {
        status = exchange(bus, data, last, &level);
    }
    bus->byte++;
    return status;
}

/* A start and the address: of a write, or of a read. */
static status_t address_sensors(sensor_bus_t *bus, uint32_t data, uint8_t address, bool reads)
{
    status_t status = begin(bus, data);

    return status == STATUS_OK ? send_byte(bus, data, (uint8_t)(address << 1 | reads)) : status;
}

/* Ends a transfer; returns the first fault. */
static status_t finish(sensor_bus_t *bus, uint32_t data, status_t status)
{
    sensor_fault_t fault = bus->fault;
    status_t       ended = end(bus, data);

    if (status != STATUS_OK) {
        bus->fault = fault;
    }
    return status != STATUS_OK ? status : ended;
}

/* Frees these data pins, of which one is low. A sensor in the midst of a read ends it when it is not acknowledged.
 * One in the midst of a write may hold data low, as its acknowledgement, in the very clock of the stop: then there
 * is another. */
static status_t recover(sensor_bus_t *bus, uint32_t data)
{
    uint32_t level  = 0;
    status_t status = STATUS_OK;

    for (int clock = 0; clock < RECOVERY_CLOCKS && status == STATUS_OK && (level & data) != data; clock++) {
        pull(bus, SENSOR_PIN_SCL);
        status = exchange(bus, data, true, &level);
        if ((level & data) == data) {
            status = finish(bus, data, status);
            level  = sample(bus);
        }
    }
    release(bus, SENSOR_PIN_SCL);
    if (status == STATUS_OK && (level & data) != data) {
        status = fail(bus, SENSOR_FAULT_SDA, sensors_of(data & ~level));
    }
    bus->recoveries += status == STATUS_OK;
    return status;
}

/* Makes the bus ready for a transfer on these data pins. */
static status_t prepare(sensor_bus_t *bus, uint32_t data)
{
    bus->byte = 0;
    return (sample(bus) & data) != data ? recover(bus, data) : STATUS_OK;
}

status_t sensor_bus_init(sensor_bus_t *bus, const sensor_pins_t *pins)
{
    memset(bus, 0, sizeof(*bus));
    if (pins->drive == NULL || pins->sample == NULL || pins->clock == NULL || pins->clock_hz < LEAST_HZ) {
        return STATUS_BAD_ARGUMENT;
    }
    bus->pins    = *pins;
    bus->quarter = (pins->clock_hz + 4 * BUS_HZ - 1) / (4 * BUS_HZ);
    release(bus, SENSOR_PIN_SCL | data_pins(SENSOR_BOTH));
    wait_quarters(bus, 4);
    return prepare(bus, data_pins(SENSOR_BOTH));
}

status_t sensor_bus_recover(sensor_bus_t *bus)
{
    bus->byte = 0;
    return recover(bus, data_pins(SENSOR_BOTH));
}

status_t sensor_bus_write(sensor_bus_t *bus, uint8_t sensors, uint8_t address, const uint8_t *bytes, size_t count)
{
    uint32_t data   = data_pins(sensors);
    status_t status = data == 0 ? STATUS_BAD_ARGUMENT : prepare(bus, data);

    if (status != STATUS_OK) {
        return status;
    }
    status = address_sensors(bus, data, address, false);
    for (size_t i = 0; i < count && status == STATUS_OK; i++) {
        status = send_byte(bus, data, bytes[i]);
    }
    return finish(bus, data, status);
}

status_t sensor_bus_read(sensor_bus_t *bus, uint8_t sensor, uint8_t address, const uint8_t *reg, size_t reg_count,
    uint8_t *bytes, size_t count, bool stop)
{
    uint32_t data   = data_pins(sensor);
    status_t status = sensor != SENSOR_LEFT && sensor != SENSOR_RIGHT ? STATUS_BAD_ARGUMENT : prepare(bus, data);

    if (status != STATUS_OK) {
        return status;
    }
    status = address_sensors(bus, data, address, false);
    for (size_t i = 0; i < reg_count && status == STATUS_OK; i++) {
        status = send_byte(bus, data, reg[i]);
    }
    if (stop && status == STATUS_OK) {
        status = end(bus, data);
    }
    if (status == STATUS_OK) {
        status = address_sensors(bus, data, address, true);
    }
    for (size_t i = 0; i < count && status == STATUS_OK; i++) {
        status = receive_byte(bus, data, &bytes[i], i + 1 == count);
    }
    return finish(bus, data, status);
}

void sensor_bus_reset(sensor_bus_t *bus, bool asserted)
{
    if (asserted) {
        pull(bus, SENSOR_PIN_RESET);
    } else {
        release(bus, SENSOR_PIN_RESET);
    }
}

void sensor_bus_pause(const sensor_bus_t *bus, uint32_t microseconds)
{
    wait_clocks(bus, (uint64_t)bus->pins.clock_hz * microseconds / 1000000u);
}

const char *sensor_fault_name(sensor_fault_kind_t kind)
{
    /* No default: the compiler misses a new fault. */
    switch (kind) {
    case SENSOR_FAULT_NONE:
        return "none";
    case SENSOR_FAULT_SCL:
        return "scl";
    case SENSOR_FAULT_SDA:
        return "sda";
    case SENSOR_FAULT_NACK:
        return "nack";
    case SENSOR_FAULT_IDENTITY:
        return "identity";
    case SENSOR_FAULT_READ_BACK:
        return "read_back";
    }
    return "unknown";
}
