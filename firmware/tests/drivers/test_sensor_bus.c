/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The bus of the sensors against two slaves at its pins. */

#include "litestereo/sensor_bus.h"

#include <setjmp.h>
#include <string.h>

#include "fake_sensors.h"
#include "require.h"

#define HZ 60000000u
#define MS (HZ / 1000)

/* MT9V034: a byte of address, two of value. */
#define ADDRESS 0x48
#define REG     0x0b

static sensor_bus_t bus;

static void set_up_model(const sensor_model_t *model, uint32_t hz)
{
    sensor_pins_t pins;

    fake_sensors_set_up(model, hz);
    pins = fake_sensors_pins();
    REQUIRE(sensor_bus_init(&bus, &pins) == STATUS_OK && fake_sensors_idle());
}

static void set_up(void)
{
    set_up_model(&sensor_mt9v034, HZ);
}

static status_t write_value(uint8_t sensors, uint16_t value)
{
    uint8_t bytes[] = {REG, (uint8_t)(value >> 8), (uint8_t)value};

    return sensor_bus_write(&bus, sensors, ADDRESS, bytes, sizeof(bytes));
}

static status_t read_value(uint8_t sensor, uint16_t *value)
{
    uint8_t  reg = REG, bytes[2] = {0};
    status_t status = sensor_bus_read(&bus, sensor, ADDRESS, &reg, 1, bytes, 2, false);

    *value = (uint16_t)(bytes[0] << 8 | bytes[1]);
    return status;
}

/* That transfers succeed. */
static void require_usable(void)
{
    uint16_t value;

    REQUIRE(write_value(SENSOR_BOTH, 0x1234) == STATUS_OK);
    for (unsigned i = 0; i < FAKE_SENSORS; i++) {
        *fake_register(i, REG) = (uint16_t)(0xa5c3 + i);
        REQUIRE(read_value((uint8_t)(SENSOR_LEFT << i), &value) == STATUS_OK && value == 0xa5c3 + i);
    }
    REQUIRE(fake_sensors_idle());
}

/* That the bus is as if nothing had happened. */
static void require_works(void)
{
    REQUIRE(fake_sensors_idle());
    require_usable();
}

/* That this was the newest fault. */
static void require_fault(sensor_fault_kind_t kind, unsigned which, unsigned byte)
{
    REQUIRE(bus.fault.kind == kind && bus.fault.sensors == which && bus.fault.byte == byte);
}

static void test_write(void)
{
    set_up();
    REQUIRE(write_value(SENSOR_BOTH, 0x81c2) == STATUS_OK && fake_sensors_idle());
    REQUIRE(fake_sensors.starts == 1 && fake_sensors.stops == 1);
    for (unsigned i = 0; i < FAKE_SENSORS; i++) {
        const fake_sensor_t *sensor = &fake_sensors.sensors[i];

        REQUIRE(*fake_register(i, REG) == 0x81c2 && sensor->count == 1 && sensor->bytes == 4);
        REQUIRE(sensor->log[0].clock == fake_sensors.sensors[0].log[0].clock);
    }
    REQUIRE(write_value(SENSOR_RIGHT, 0x0001) == STATUS_OK);
    REQUIRE(*fake_register(0, REG) == 0x81c2 && *fake_register(1, REG) == 1);
    REQUIRE(write_value(SENSOR_LEFT, 0xffff) == STATUS_OK);
    REQUIRE(*fake_register(0, REG) == 0xffff && *fake_register(1, REG) == 1);
    REQUIRE(fake_sensors.sensors[0].bytes == 8 && fake_sensors.sensors[1].bytes == 8);
    REQUIRE(write_value(0, 0) == STATUS_BAD_ARGUMENT && fake_sensors.starts == 3);
}

static void test_read(void)
{
    uint16_t value;
    uint8_t  reg = 0x0a, byte;

    set_up();
    require_works();
    fake_sensors.starts = fake_sensors.stops = 0;
    REQUIRE(read_value(SENSOR_LEFT, &value) == STATUS_OK && fake_sensors.starts == 2 && fake_sensors.stops == 1);
    REQUIRE(read_value(SENSOR_BOTH, &value) == STATUS_BAD_ARGUMENT && read_value(0, &value) == STATUS_BAD_ARGUMENT);
    REQUIRE(fake_sensors.starts == 2);
    /* SCCB has a stop in between, and cannot be read without it. */
    set_up_model(&sensor_ov7670, HZ);
    REQUIRE(sensor_bus_read(&bus, SENSOR_RIGHT, 0x21, &reg, 1, &byte, 1, true) == STATUS_OK && byte == 0x76);
    REQUIRE(fake_sensors.starts == 2 && fake_sensors.stops == 2 && fake_sensors_idle());
    REQUIRE(sensor_bus_read(&bus, SENSOR_RIGHT, 0x21, &reg, 1, &byte, 1, false) == STATUS_UNSUPPORTED);
    REQUIRE(bus.fault.kind == SENSOR_FAULT_NACK && bus.fault.byte == 2 && fake_sensors_idle());
}

/* 100 kHz at most, and not much less, at each clock of the system. */
static void test_speed(void)
{
    static const uint32_t clocks[]   = {1000000, 1500001, 16000000, 60000000, 125000000, 200000000};
    static const uint32_t quarters[] = {3, 4, 40, 150, 313, 500};
    uint64_t              began;

    for (size_t i = 0; i < sizeof(clocks) / sizeof(clocks[0]); i++) {
        double us = clocks[i] / 1e6;

        set_up_model(&sensor_mt9v034, clocks[i]);
        began               = fake_sensors.clock;
        fake_sensors.clocks = 0;
        REQUIRE(bus.quarter == quarters[i]);
        REQUIRE(write_value(SENSOR_BOTH, 0x5555) == STATUS_OK);
        REQUIRE((double)fake_sensors.least_low >= 5 * us - 1 && (double)fake_sensors.least_high >= 5 * us - 1);
        REQUIRE(fake_sensors.clocks == 37);
        REQUIRE((double)(fake_sensors.clock - began) / us < 37 * (clocks[i] < 2000000 ? 20 : 11.5));
    }
}

/* No acknowledgement of any byte, from either or both. */
static void test_nack(void)
{
    uint16_t value;

    for (unsigned sensors = SENSOR_LEFT; sensors <= SENSOR_BOTH; sensors++) {
        for (unsigned byte = 0; byte < 4; byte++) {
            set_up();
            for (unsigned i = 0; i < FAKE_SENSORS; i++) {
                fake_sensors.sensors[i].nack_at = (sensors >> i & 1) != 0 ? byte + 1 : 0;
            }
            REQUIRE(write_value(SENSOR_BOTH, 0x1111) == STATUS_UNSUPPORTED && fake_sensors_idle());
            require_fault(SENSOR_FAULT_NACK, sensors, byte);
            REQUIRE(fake_sensors.starts == 1 && fake_sensors.stops == 1);
            require_works();
        }
    }
    for (unsigned i = 0; i < FAKE_SENSORS; i++) {
        for (unsigned byte = 0; byte < 3; byte++) {
            set_up();
            fake_sensors.sensors[i].nack_at = byte + 1;
            REQUIRE(read_value((uint8_t)(SENSOR_LEFT << i), &value) == STATUS_UNSUPPORTED && fake_sensors_idle());
            require_fault(SENSOR_FAULT_NACK, SENSOR_LEFT << i, byte);
            require_works();
        }
    }
    /* A sensor at another address does not answer. */
    set_up();
    REQUIRE(sensor_bus_write(&bus, SENSOR_BOTH, ADDRESS + 1, (const uint8_t *)"\0\0", 2) == STATUS_UNSUPPORTED);
    REQUIRE(bus.fault.byte == 0 && bus.fault.sensors == SENSOR_BOTH && fake_sensors.sensors[0].bytes == 0);
}

/* Unplugged before or within a transfer: the error comes, the other sensor stays usable. */
static void test_unplugged(void)
{
    uint16_t value;

    set_up();
    fake_sensor_plug(1, false);
    REQUIRE(write_value(SENSOR_BOTH, 1) == STATUS_UNSUPPORTED);
    require_fault(SENSOR_FAULT_NACK, SENSOR_RIGHT, 0);
    REQUIRE(read_value(SENSOR_RIGHT, &value) == STATUS_UNSUPPORTED);
    REQUIRE(read_value(SENSOR_LEFT, &value) == STATUS_OK);
    for (unsigned edge = 1; edge <= 36; edge++) {
        set_up();
        fake_sensors.sensors[0].unplug_at = edge;
        REQUIRE(write_value(SENSOR_BOTH, 0) == STATUS_UNSUPPORTED);
        require_fault(SENSOR_FAULT_NACK, SENSOR_LEFT, (edge - 1) / 9);
        fake_sensor_plug(0, true);
        require_works();
    }
    /* Of a read that loses its sensor, the rest is ones. */
    for (unsigned edge = 29; edge <= 45; edge++) {
        set_up();
        *fake_register(0, REG)            = 0;
        fake_sensors.sensors[0].unplug_at = edge;
        REQUIRE(read_value(SENSOR_LEFT, &value) == STATUS_OK && value != 0);
        fake_sensor_plug(0, true);
        require_works();
    }
}

static void test_held_data(void)
{
    uint16_t value;
    uint64_t began;

    /* It is recovered, and then the transfer is made. */
    for (unsigned edges = 1; edges <= 9; edges++) {
        set_up();
        fake_sensors.sensors[1].hold_edges = edges;
        REQUIRE(write_value(SENSOR_BOTH, 0x77) == STATUS_OK && bus.recoveries == 1);
        require_fault(SENSOR_FAULT_NONE, 0, 0);
        require_works();
    }
    /* Held for longer: an error within a bounded time, and the other sensor can be used. */
    set_up();
    fake_sensors.sensors[1].hold = true;
    began = fake_sensors.clock;
    REQUIRE(write_value(SENSOR_BOTH, 0x77) == STATUS_TIMEOUT && fake_sensors.clock - began < MS);
    require_fault(SENSOR_FAULT_SDA, SENSOR_RIGHT, 0);
    REQUIRE(sensor_bus_recover(&bus) == STATUS_TIMEOUT && bus.recoveries == 0);
    REQUIRE(write_value(SENSOR_LEFT, 0x78) == STATUS_OK);
    REQUIRE(read_value(SENSOR_LEFT, &value) == STATUS_OK && value == 0x78);
    fake_sensors.sensors[1].hold = false;
    REQUIRE(sensor_bus_recover(&bus) == STATUS_OK && bus.recoveries == 1);
    require_works();
    fake_sensors.sensors[0].hold = fake_sensors.sensors[1].hold = true;
    REQUIRE(sensor_bus_recover(&bus) == STATUS_TIMEOUT && bus.fault.sensors == SENSOR_BOTH);
}

/* Pins of a bus whose data is held from a number of calls on. */
static unsigned calls_to_hold;

static void drive_and_hold(void *context, uint32_t pins)
{
    sensor_pins_t inner = fake_sensors_pins();

    if (calls_to_hold > 0 && --calls_to_hold == 0) {
        fake_sensors.sensors[0].hold = true;
    }
    inner.drive(context, pins);
}

/* Data that is held in the midst of a write of ones is a fault within a byte. */
static void test_data_held_within(void)
{
    unsigned found = 0;

    for (unsigned calls = 2; calls < 140; calls++) {
        set_up();
        bus.pins.drive = drive_and_hold;
        calls_to_hold  = calls;
        (void)write_value(SENSOR_BOTH, 0xffff);
        if (fake_sensors.sensors[0].hold) {
            REQUIRE(bus.fault.kind == SENSOR_FAULT_SDA || bus.fault.kind == SENSOR_FAULT_NONE);
            found += bus.fault.kind == SENSOR_FAULT_SDA && bus.fault.sensors == SENSOR_LEFT && bus.fault.byte >= 2;
        }
        fake_sensors.sensors[0].hold = false;
        calls_to_hold                = 0;
        REQUIRE(sensor_bus_recover(&bus) == STATUS_OK);
        require_works();
    }
    REQUIRE(found > 30);
}

static void test_held_clock(void)
{
    uint16_t value;
    uint64_t began;

    /* A millisecond is allowed. */
    set_up();
    fake_sensors.sensors[0].stretch = MS * 9 / 10;
    require_works();
    set_up();
    fake_sensors.sensors[1].stretch = MS * 5 / 2;
    REQUIRE(write_value(SENSOR_LEFT, 1) == STATUS_OK);
    began = fake_sensors.clock;
    REQUIRE(write_value(SENSOR_BOTH, 2) == STATUS_TIMEOUT && fake_sensors.clock - began < 4 * MS);
    require_fault(SENSOR_FAULT_SCL, SENSOR_BOTH, 0);
    fake_sensors.sensors[1].stretch = 0;
    REQUIRE(sensor_bus_recover(&bus) == STATUS_OK);
    require_works();
    fake_sensors.sensors[1].stretch_ever = true;
    began = fake_sensors.clock;
    REQUIRE(write_value(SENSOR_BOTH, 2) == STATUS_TIMEOUT && fake_sensors.clock - began < 4 * MS);
    REQUIRE(read_value(SENSOR_LEFT, &value) == STATUS_TIMEOUT && fake_sensors.clock - began < 8 * MS);
    REQUIRE(sensor_bus_recover(&bus) == STATUS_TIMEOUT && fake_sensors.clock - began < 12 * MS);
    REQUIRE(bus.fault.kind == SENSOR_FAULT_SCL);
    fake_sensors.sensors[1].stretch_ever = false;
    REQUIRE(sensor_bus_recover(&bus) == STATUS_OK);
    require_works();
    /* Pins without a way to read the clock: it is as driven. */
    fake_sensors.slow = true;
    require_works();
}

static jmp_buf  cut;
static unsigned calls_to_cut;

static void drive_until_cut(void *context, uint32_t pins)
{
    sensor_pins_t inner = fake_sensors_pins();

    inner.drive(context, pins);
    if (--calls_to_cut == 0) {
        longjmp(cut, 1);
    }
}

/* A restart of the firmware at any place of a transfer: a new driver makes the bus usable. */
static void test_restart(void)
{
    volatile unsigned calls = 1, recoveries = 0;
    volatile bool     ended = false;

    while (!ended) {
        sensor_pins_t pins;
        uint16_t      value;

        set_up();
        *fake_register(0, REG) = 0;
        bus.pins.drive         = drive_until_cut;
        calls_to_cut           = calls++;
        if (setjmp(cut) == 0) {
            ended = read_value(SENSOR_LEFT, &value) == STATUS_OK;
        }
        pins = fake_sensors_pins();
        REQUIRE(sensor_bus_init(&bus, &pins) == STATUS_OK);
        recoveries += bus.recoveries;
        /* A sensor may still be in the midst of a byte: the next start ends that. */
        require_usable();
    }
    REQUIRE(calls > 100 && recoveries > 20);
}

static void test_init(void)
{
    sensor_pins_t pins, bad;

    set_up();
    pins         = fake_sensors_pins();
    bad          = pins;
    bad.drive    = NULL;
    REQUIRE(sensor_bus_init(&bus, &bad) == STATUS_BAD_ARGUMENT);
    bad          = pins;
    bad.sample   = NULL;
    REQUIRE(sensor_bus_init(&bus, &bad) == STATUS_BAD_ARGUMENT);
    bad          = pins;
    bad.clock    = NULL;
    REQUIRE(sensor_bus_init(&bus, &bad) == STATUS_BAD_ARGUMENT);
    bad          = pins;
    bad.clock_hz = 999999;
    REQUIRE(sensor_bus_init(&bus, &bad) == STATUS_BAD_ARGUMENT);
    fake_sensors.sensors[0].hold = true;
    REQUIRE(sensor_bus_init(&bus, &pins) == STATUS_TIMEOUT && bus.fault.kind == SENSOR_FAULT_SDA);
}

static void test_reset_and_pause(void)
{
    uint64_t began;

    set_up();
    sensor_bus_reset(&bus, true);
    REQUIRE(fake_sensors.sensors[0].resets == 1 && fake_sensors.sensors[1].resets == 1 && fake_sensors_idle());
    sensor_bus_reset(&bus, false);
    REQUIRE(fake_sensors.sensors[0].resets == 1);
    require_works();
    sensor_bus_reset(&bus, true);
    require_works();
    REQUIRE(fake_sensors.sensors[0].resets == 2);
    began = fake_sensors.clock;
    sensor_bus_pause(&bus, 2500);
    REQUIRE(fake_sensors.clock - began >= MS * 5 / 2 && fake_sensors.clock - began < MS * 5 / 2 + 1000);
}

static void test_names(void)
{
    REQUIRE(strcmp(sensor_fault_name(SENSOR_FAULT_NONE), "none") == 0);
    REQUIRE(strcmp(sensor_fault_name(SENSOR_FAULT_SCL), "scl") == 0);
    REQUIRE(strcmp(sensor_fault_name(SENSOR_FAULT_SDA), "sda") == 0);
    REQUIRE(strcmp(sensor_fault_name(SENSOR_FAULT_NACK), "nack") == 0);
    REQUIRE(strcmp(sensor_fault_name(SENSOR_FAULT_IDENTITY), "identity") == 0);
    REQUIRE(strcmp(sensor_fault_name(SENSOR_FAULT_READ_BACK), "read_back") == 0);
    REQUIRE(strcmp(sensor_fault_name((sensor_fault_kind_t)(SENSOR_FAULT_READ_BACK + 1)), "unknown") == 0);
}

int main(void)
{
    test_write();
    test_read();
    test_speed();
    test_nack();
    test_unplugged();
    test_held_data();
    test_data_held_within();
    test_held_clock();
    test_restart();
    test_init();
    test_reset_and_pause();
    test_names();
    return 0;
}
