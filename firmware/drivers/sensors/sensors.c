/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "sensor_model.h"

#define RESET_US 1000u

/* Bytes of the longest transfer: address of a register and its value. */
#define MOST_BYTES 4

static size_t put(uint8_t *bytes, uint16_t value, unsigned count)
{
    if (count == 2) {
        *bytes++ = (uint8_t)(value >> 8);
    }
    *bytes = (uint8_t)value;
    return count;
}

static status_t write_register(sensors_t *sensors, uint8_t which, const sensor_write_t *write)
{
    const sensor_model_t *model = sensors->model;
    uint8_t               bytes[MOST_BYTES];
    size_t                count = put(bytes, write->reg, model->register_bytes);
    status_t              status;

    count += put(bytes + count, write->value, model->value_bytes);
    status = sensor_bus_write(sensors->bus, which, model->address, bytes, count);
    if (write->pause_ms != 0) {
        sensor_bus_pause(sensors->bus, write->pause_ms * 1000u);
    }
    return status;
}

static status_t write_list(sensors_t *sensors, uint8_t which, const sensor_write_t *writes, size_t count)
{
    status_t status = STATUS_OK;

    for (size_t i = 0; i < count && status == STATUS_OK; i++) {
        status = write_register(sensors, which, &writes[i]);
    }
    return status;
}

/* Compares a register of one sensor with a value. */
static status_t compare(sensors_t *sensors, uint8_t which, const sensor_write_t *write, sensor_fault_kind_t kind)
{
    const sensor_model_t *model = sensors->model;
    sensor_bus_t         *bus   = sensors->bus;
    uint8_t               reg[2];
    uint8_t               bytes[2];
    uint16_t              value;
    status_t              status;

    put(reg, write->reg, model->register_bytes);
    status = sensor_bus_read(bus, which, model->address, reg, model->register_bytes, bytes, model->value_bytes,
        model->sccb);
    if (status != STATUS_OK) {
        return status;
    }
    value = model->value_bytes == 2 ? (uint16_t)(bytes[0] << 8 | bytes[1]) : bytes[0];
    if (((value ^ write->value) & write->readable) == 0) {
        return STATUS_OK;
    }
    bus->fault = (sensor_fault_t){
        .kind = kind, .sensors = which, .reg = write->reg, .expected = write->value, .value = value,
    };
    return STATUS_UNSUPPORTED;
}

static status_t compare_list(sensors_t *sensors, uint8_t which, const sensor_write_t *writes, size_t count,
    sensor_fault_kind_t kind)
{
    status_t status = STATUS_OK;

    for (size_t i = 0; i < count && status == STATUS_OK; i++) {
        if (writes[i].readable != 0) {
            status = compare(sensors, which, &writes[i], kind);
        }
    }
    return status;
}

/* Reads a list back from each of these sensors. */
static status_t verify(sensors_t *sensors, uint8_t which, const sensor_write_t *writes, size_t count)
{
    status_t status = STATUS_OK;

    for (uint8_t sensor = SENSOR_LEFT; sensor <= SENSOR_RIGHT && status == STATUS_OK; sensor <<= 1) {
        if ((which & sensor) != 0) {
            status = compare_list(sensors, sensor, writes, count, SENSOR_FAULT_READ_BACK);
        }
    }
    return status;
}

/* Has sensors_poll look after the sensors, if something went wrong. */
static status_t watched(sensors_t *sensors, status_t status)
{
    if (status != STATUS_OK && sensors->running) {
        sensors->running = false;
        sensors->losses++;
    }
    return status;
}

static status_t write_and_verify(sensors_t *sensors, uint8_t which, const sensor_write_t *writes, size_t count)
{
    status_t status = write_list(sensors, which, writes, count);

    return status == STATUS_OK ? verify(sensors, which, writes, count) : status;
}

/* All that depends on settings. */
static size_t list_settings(const sensor_model_t *model, const sensor_settings_t *settings, sensor_write_t *writes)
{
    size_t count = model->frame(settings, writes);

    count += model->expose(settings, writes + count);
    return count + model->pattern(settings, writes + count);
}

/* Set-up. */

/* Sensors that answer with their identity. */
static uint8_t identify(sensors_t *sensors, status_t *status)
{
    const sensor_list_t *identity = &sensors->model->identity;
    uint8_t              present  = 0;

    *status = STATUS_OK;
    for (uint8_t sensor = SENSOR_LEFT; sensor <= SENSOR_RIGHT; sensor <<= 1) {
        status_t answer = compare_list(sensors, sensor, identity->writes, identity->count, SENSOR_FAULT_IDENTITY);

        if (answer == STATUS_OK) {
            present |= sensor;
        } else {
            *status = answer;
        }
    }
    return present;
}

static status_t set_up(sensors_t *sensors)
{
    const sensor_model_t *model = sensors->model;
    sensor_write_t        writes[SENSOR_MOST_WRITES];
    size_t                count   = list_settings(model, &sensors->settings, writes);
    const sensor_list_t   lists[] = {model->set_up, {writes, count}, model->start};
    const size_t          most    = sizeof(lists) / sizeof(lists[0]);
    status_t              status;

    sensors->running = false;
    sensor_bus_reset(sensors->bus, true);
    sensor_bus_pause(sensors->bus, RESET_US);
    sensor_bus_reset(sensors->bus, false);
    sensor_bus_pause(sensors->bus, model->wake_ms * 1000u);
    sensors->present = identify(sensors, &status);
    for (size_t i = 0; i < most && status == STATUS_OK; i++) {
        status = write_list(sensors, SENSOR_BOTH, lists[i].writes, lists[i].count);
    }
    /* Reading comes last: both sensors get their writes at the same time, and begin with the last one. */
    for (size_t i = 0; i < most && status == STATUS_OK; i++) {
        status = verify(sensors, SENSOR_BOTH, lists[i].writes, lists[i].count);
    }
    sensors->running  = status == STATUS_OK;
    sensors->set_ups += status == STATUS_OK;
    return status;
}

void sensors_init(sensors_t *sensors, sensor_bus_t *bus, const sensor_model_t *model)
{
    *sensors = (sensors_t){.bus = bus, .model = model};
}

status_t sensors_begin(sensors_t *sensors, const sensor_settings_t *settings, uint64_t clock)
{
    status_t status = sensor_check(sensors->model, settings);

    if (status != STATUS_OK) {
        return status;
    }
    sensors->settings = *settings;
    sensors->begun    = true;
    sensors->polled   = clock;
    status            = set_up(sensors);
    sensors->told     = status == STATUS_OK;
    return status;
}

/* Changes of sensors that run. */

status_t sensors_apply(sensors_t *sensors, const sensor_settings_t *settings)
{
    sensor_write_t writes[SENSOR_MOST_WRITES];
    size_t         count;
    status_t       status = sensors->running ? sensor_check(sensors->model, settings) : STATUS_STATE;

    if (status != STATUS_OK) {
        return status;
    }
    sensors->settings = *settings;
    count             = list_settings(sensors->model, settings, writes);
    return watched(sensors, write_and_verify(sensors, SENSOR_BOTH, writes, count));
}

status_t sensors_expose(sensors_t *sensors, uint16_t exposure, uint16_t gain)
{
    exposure_limits_t limits = sensor_exposure_limits(sensors->model, &sensors->settings);
    sensor_write_t    writes[SENSOR_MOST_WRITES];
    size_t            count;
    status_t          status = sensors->running ? exposure_check(&limits, exposure, gain) : STATUS_STATE;

    if (status != STATUS_OK) {
        return status;
    }
    sensors->settings.exposure = exposure;
    sensors->settings.gain     = gain;
    count                      = sensors->model->expose(&sensors->settings, writes);
    return watched(sensors, write_list(sensors, SENSOR_BOTH, writes, count));
}

status_t sensors_show_pattern(sensors_t *sensors, bool on)
{
    sensor_write_t writes[SENSOR_MOST_WRITES];

    if (!sensors->running) {
        return STATUS_STATE;
    }
    sensors->settings.pattern = on;
    return watched(sensors, write_and_verify(sensors, SENSOR_BOTH, writes,
        sensors->model->pattern(&sensors->settings, writes)));
}

status_t sensors_shift(sensors_t *sensors, uint8_t sensor, uint16_t frame_rows)
{
    sensor_settings_t settings = sensors->settings;
    sensor_write_t    writes[SENSOR_MOST_WRITES];
    status_t          status;

    if (sensor != SENSOR_LEFT && sensor != SENSOR_RIGHT) {
        return STATUS_BAD_ARGUMENT;
    }
    settings.frame_rows = frame_rows;
    status              = sensors->running ? sensor_check(sensors->model, &settings) : STATUS_STATE;
    if (status != STATUS_OK) {
        return status;
    }
    return watched(sensors, write_and_verify(sensors, sensor, writes, sensors->model->frame(&settings, writes)));
}

/* Polls. */

/* Whether both sensors are there, with what was written to them. */
static bool are_well(sensors_t *sensors)
{
    sensor_write_t writes[SENSOR_MOST_WRITES];
    size_t         count = sensors->model->expose(&sensors->settings, writes);
    status_t       status;

    writes[count++]  = sensors->model->witness;
    sensors->present = identify(sensors, &status);
    return status == STATUS_OK && verify(sensors, SENSOR_BOTH, writes, count) == STATUS_OK;
}

sensors_event_t sensors_poll(sensors_t *sensors, uint64_t clock)
{
    if (sensors->told && !sensors->running) {
        sensors->told = false;
        return SENSORS_GONE;
    }
    if (!sensors->begun || clock - sensors->polled < sensors->bus->pins.clock_hz) {
        return SENSORS_SAME;
    }
    sensors->polled = clock;
    if (sensors->running) {
        /* A disturbance of the bus alone is no reason to lose frames. */
        if (are_well(sensors) || are_well(sensors)) {
            return SENSORS_SAME;
        }
        (void)watched(sensors, STATUS_UNSUPPORTED);
        sensors->told = false;
        return SENSORS_GONE;
    }
    if (set_up(sensors) != STATUS_OK) {
        return SENSORS_SAME;
    }
    sensors->told = true;
    return SENSORS_BACK;
}
