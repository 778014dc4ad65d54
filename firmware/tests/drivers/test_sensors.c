/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Set-up, settings and polls of a pair of sensors, of each kind, against slaves at the pins of the bus. */

#include "litestereo/sensor.h"

#include <string.h>

#include "fake_sensors.h"
#include "require.h"

#define HZ     60000000u
#define SECOND ((uint64_t)HZ)

#define COUNT(array) (sizeof(array) / sizeof((array)[0]))

static const sensor_model_t *const models[] = {&sensor_mt9v034, &sensor_ov7670, &sensor_ar0134};

static sensor_bus_t bus;
static sensors_t    sensors;

static sensor_settings_t defaults(const sensor_model_t *model, uint16_t width, uint16_t height)
{
    sensor_settings_t settings;

    REQUIRE(sensor_defaults(model, width, height, &settings) == STATUS_OK);
    REQUIRE(sensor_check(model, &settings) == STATUS_OK && settings.width == width && settings.height == height);
    return settings;
}

/* A pair, not set up yet. */
static void set_up(const sensor_model_t *model)
{
    sensor_pins_t pins;

    fake_sensors_set_up(model, HZ);
    pins = fake_sensors_pins();
    REQUIRE(sensor_bus_init(&bus, &pins) == STATUS_OK);
    sensors_init(&sensors, &bus, model);
}

/* A pair that runs. */
static sensor_settings_t run(const sensor_model_t *model)
{
    sensor_settings_t settings = defaults(model, 640, 480);

    set_up(model);
    REQUIRE(sensors_begin(&sensors, &settings, 0) == STATUS_OK && sensors.running && sensors.present == SENSOR_BOTH);
    return settings;
}

/* That both sensors have these values, and got all their writes at the same time. */
typedef struct {
    uint16_t reg, value;
} expected_t;

static void require_registers(const expected_t *expected, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        for (unsigned sensor = 0; sensor < FAKE_SENSORS; sensor++) {
            if (*fake_register(sensor, expected[i].reg) != expected[i].value) {
                fprintf(stderr, "register 0x%x has 0x%x, not 0x%x\n", expected[i].reg,
                    *fake_register(sensor, expected[i].reg), expected[i].value);
            }
            REQUIRE(*fake_register(sensor, expected[i].reg) == expected[i].value);
        }
    }
}

static void require_lockstep(void)
{
    const fake_sensor_t *left = &fake_sensors.sensors[0], *right = &fake_sensors.sensors[1];

    REQUIRE(left->count == right->count && left->count > 0 && left->count <= FAKE_WRITES);
    REQUIRE(memcmp(left->log, right->log, left->count * sizeof(left->log[0])) == 0);
}

#define REQUIRE_REGISTERS(...)                                 \
    do {                                                       \
        static const expected_t expected[] = {__VA_ARGS__};    \
        require_registers(expected, COUNT(expected));          \
    } while (0)

/* Registers of each kind and size, written out from the sources that its table names. */

static void begin_size(const sensor_model_t *model, uint16_t width, uint16_t height)
{
    sensor_settings_t settings = defaults(model, width, height);

    set_up(model);
    REQUIRE(sensors_begin(&sensors, &settings, 0) == STATUS_OK);
    require_lockstep();
}

static void test_mt9v034(void)
{
    sensor_settings_t settings;
    sensor_timing_t   timing;
    sensor_format_t   format = sensor_format(&sensor_mt9v034);

    REQUIRE(!format.two_bytes && !format.grey_second && !format.href_low && !format.vsync_low);
    begin_size(&sensor_mt9v034, 640, 480);
    REQUIRE_REGISTERS({0x0d, 0x0300}, {0x01, 57}, {0x02, 4}, {0x03, 480}, {0x04, 640}, {0x05, 61}, {0x06, 45},
        {0x07, 0x0188}, {0x0b, 262}, {0x35, 16}, {0xd5, 0}, {0xaf, 0}, {0x0f, 0}, {0x1c, 0x0202}, {0x70, 0x0101},
        {0x72, 0}, {0x7f, 0}, {0x13, 0x2d2e}, {0x20, 0x03c7}, {0x24, 0x001b}, {0x2b, 0x0003}, {0x2f, 0x0003});
    begin_size(&sensor_mt9v034, 320, 240);
    REQUIRE_REGISTERS({0x0d, 0x0305}, {0x01, 57}, {0x02, 4}, {0x03, 480}, {0x04, 640}, {0x05, 71}, {0x06, 45});
    begin_size(&sensor_mt9v034, 160, 120);
    REQUIRE_REGISTERS({0x0d, 0x030a}, {0x01, 57}, {0x02, 4}, {0x03, 480}, {0x04, 640}, {0x05, 91}, {0x06, 45});
    begin_size(&sensor_mt9v034, 752, 480);
    REQUIRE_REGISTERS({0x0d, 0x0300}, {0x01, 1}, {0x02, 4}, {0x03, 480}, {0x04, 752}, {0x05, 61});
    /* Any window; a row has 690 clocks at least. */
    settings = defaults(&sensor_mt9v034, 752, 480);
    settings.width   = 100;
    settings.height  = 50;
    settings.binning = 1;
    settings.column  = 652;
    settings.row     = 430;
    REQUIRE(sensor_timing(&sensor_mt9v034, &settings, &timing) == STATUS_OK);
    REQUIRE(timing.least_row_clocks == 690 && timing.most_row_clocks == 1123);
    REQUIRE(timing.least_frame_rows == 52 && timing.most_frame_rows == 32338);
    settings.row_clocks = 1000;
    settings.frame_rows = 200;
    settings.exposure   = 198;
    settings.gain       = 62;
    REQUIRE(sensors_apply(&sensors, &settings) == STATUS_OK);
    REQUIRE_REGISTERS({0x0d, 0x0300}, {0x01, 653}, {0x02, 434}, {0x03, 50}, {0x04, 100}, {0x05, 900}, {0x06, 150},
        {0x0b, 198}, {0x35, 62});
    require_lockstep();
}

static void test_ov7670(void)
{
    sensor_settings_t settings;
    sensor_timing_t   timing;
    sensor_format_t   format = sensor_format(&sensor_ov7670);

    REQUIRE(format.two_bytes && !format.grey_second && !format.href_low && format.vsync_low);
    begin_size(&sensor_ov7670, 640, 480);
    REQUIRE_REGISTERS({0x12, 0x00}, {0x11, 0x40}, {0x6b, 0x0a}, {0x13, 0xc0}, {0x15, 0x00}, {0x3a, 0x04}, {0x3d, 0xc0},
        {0x40, 0xc0}, {0x8c, 0x00}, {0x0c, 0x00}, {0x3e, 0x00}, {0x70, 0x3a}, {0x71, 0x35}, {0x72, 0x11}, {0x73, 0xf0},
        {0xa2, 0x02}, {0x17, 0x13}, {0x18, 0x01}, {0x32, 0xb6}, {0x19, 0x02}, {0x1a, 0x7a}, {0x03, 0x0a}, {0x92, 0x00},
        {0x93, 0x00}, {0x07, 0x00}, {0x10, 255 >> 2}, {0x04, 255 & 3}, {0x00, 0x00});
    begin_size(&sensor_ov7670, 320, 240);
    REQUIRE_REGISTERS({0x12, 0x00}, {0x0c, 0x04}, {0x3e, 0x19}, {0x70, 0x3a}, {0x71, 0x35}, {0x72, 0x11}, {0x73, 0xf1},
        {0xa2, 0x02}, {0x17, 0x15}, {0x18, 0x04}, {0x32, 0xa4}, {0x19, 0x02}, {0x1a, 0x7a}, {0x03, 0x0a});
    begin_size(&sensor_ov7670, 160, 120);
    REQUIRE_REGISTERS({0x12, 0x00}, {0x0c, 0x04}, {0x3e, 0x1a}, {0x70, 0x3a}, {0x71, 0x35}, {0x72, 0x22}, {0x73, 0xf2},
        {0xa2, 0x02}, {0x17, 0x16}, {0x18, 0x04}, {0x32, 0xa4}, {0x19, 0x02}, {0x1a, 0x7a}, {0x03, 0x0a});
    /* Longer frames have dummy rows, and longer exposures. */
    settings = defaults(&sensor_ov7670, 160, 120);
    REQUIRE(sensor_timing(&sensor_ov7670, &settings, &timing) == STATUS_OK);
    REQUIRE(timing.least_row_clocks == 1568 && timing.most_row_clocks == 1568);
    REQUIRE(timing.least_frame_rows == 510 && timing.most_frame_rows == 65535);
    settings.frame_rows = 510 + 0x1234;
    settings.exposure   = 0x1233;
    settings.gain       = 21 << 3;
    REQUIRE(sensors_apply(&sensors, &settings) == STATUS_OK);
    REQUIRE_REGISTERS({0x92, 0x34}, {0x93, 0x12}, {0x07, 0x04}, {0x10, 0x8c}, {0x04, 0x03}, {0x00, 0x75});
    /* Each bit of the upper half of the gain doubles. */
    for (unsigned exponent = 0; exponent <= 4; exponent++) {
        REQUIRE(sensors_expose(&sensors, 0x400, (uint16_t)(31 << exponent)) == STATUS_OK);
        REQUIRE(*fake_register(1, 0x00) == (((1u << exponent) - 1) << 4 | 15));
        REQUIRE(*fake_register(1, 0x07) == 1 && *fake_register(1, 0x10) == 0 && *fake_register(1, 0x04) == 0);
    }
}

static void test_ar0134(void)
{
    sensor_settings_t settings;
    sensor_timing_t   timing;
    sensor_format_t   format = sensor_format(&sensor_ar0134);

    REQUIRE(!format.two_bytes && !format.grey_second && !format.href_low && !format.vsync_low);
    begin_size(&sensor_ar0134, 640, 480);
    REQUIRE_REGISTERS({0x301a, 0x10dc}, {0x302c, 2}, {0x302a, 4}, {0x302e, 2}, {0x3030, 32}, {0x30d4, 0xe007},
        {0x3040, 0}, {0x30a6, 1}, {0x3100, 0}, {0x3064, 0x1802}, {0x3032, 2}, {0x3002, 0}, {0x3004, 0}, {0x3006, 959},
        {0x3008, 1279}, {0x300c, 1498}, {0x300a, 1060}, {0x3012, 530}, {0x3014, 0}, {0x30b0, 0x80}, {0x305e, 0x20},
        {0x3070, 0});
    begin_size(&sensor_ar0134, 320, 240);
    REQUIRE_REGISTERS({0x3032, 2}, {0x3002, 240}, {0x3004, 320}, {0x3006, 719}, {0x3008, 959}, {0x300a, 580});
    begin_size(&sensor_ar0134, 1280, 960);
    REQUIRE_REGISTERS({0x3032, 0}, {0x3002, 0}, {0x3004, 0}, {0x3006, 959}, {0x3008, 1279}, {0x300a, 1060});
    settings = defaults(&sensor_ar0134, 1280, 960);
    REQUIRE(sensor_timing(&sensor_ar0134, &settings, &timing) == STATUS_OK);
    REQUIRE(timing.least_row_clocks == 1498 && timing.most_row_clocks == 65535);
    REQUIRE(timing.least_frame_rows == 997 && timing.most_frame_rows == 65535);
    REQUIRE(sensors_expose(&sensors, 1060, 8 * 31) == STATUS_OK);
    REQUIRE_REGISTERS({0x3012, 1060}, {0x30b0, 0xb0}, {0x305e, 62});
    REQUIRE(sensors_expose(&sensors, 1, 2 * 24) == STATUS_OK);
    REQUIRE_REGISTERS({0x3012, 1}, {0x30b0, 0x90}, {0x305e, 48});
}

/* Frames per second of data sheets. */
static void test_rates(void)
{
    sensor_settings_t settings = defaults(&sensor_mt9v034, 640, 480), before;

    settings.row_clocks = 640 + 94;
    settings.frame_rows = 480 + 45;
    REQUIRE(sensor_rate(&sensor_mt9v034, &settings, 26600000) == 69028);
    settings.row_clocks = 640 + 204;
    REQUIRE(sensor_rate(&sensor_mt9v034, &settings, 26600000) == 60032);
    settings.row_clocks = 640 + 94;
    REQUIRE(sensor_set_rate(&sensor_mt9v034, &settings, 26600000, 30000) == STATUS_OK);
    REQUIRE(settings.frame_rows == 480 + 728);
    before = settings;
    /* 300 per second are too many, 0.01 too few, 200 would leave no time for the exposure. */
    REQUIRE(sensor_set_rate(&sensor_mt9v034, &settings, 26600000, 300000) == STATUS_BAD_ARGUMENT);
    REQUIRE(sensor_set_rate(&sensor_mt9v034, &settings, 26600000, 10) == STATUS_BAD_ARGUMENT);
    REQUIRE(sensor_set_rate(&sensor_mt9v034, &settings, 26600000, 0) == STATUS_BAD_ARGUMENT);
    REQUIRE(sensor_set_rate(&sensor_mt9v034, &settings, 27000001, 30000) == STATUS_BAD_ARGUMENT);
    REQUIRE(sensor_set_rate(&sensor_mt9v034, &settings, 19999999, 30000) == STATUS_BAD_ARGUMENT);
    settings.exposure = before.exposure = 1000;
    REQUIRE(sensor_set_rate(&sensor_mt9v034, &settings, 26600000, 60000) == STATUS_BAD_ARGUMENT);
    REQUIRE(memcmp(&settings, &before, sizeof(settings)) == 0);
    settings = defaults(&sensor_ov7670, 640, 480);
    REQUIRE(sensor_rate(&sensor_ov7670, &settings, 24000000) == 30012);
    REQUIRE(sensor_rate(&sensor_ov7670, &settings, 25000000) == 31263);
    REQUIRE(sensor_set_rate(&sensor_ov7670, &settings, 25000000, 30000) == STATUS_OK && settings.frame_rows == 531);
    REQUIRE(sensor_set_rate(&sensor_ov7670, &settings, 25000000, 32000) == STATUS_BAD_ARGUMENT);
    /* The AR0134 doubles its master clock. */
    settings = defaults(&sensor_ar0134, 320, 240);
    REQUIRE(sensor_clock_hz(&sensor_ar0134, 24000000) == 48000000);
    REQUIRE(sensor_rate(&sensor_ar0134, &settings, 24000000) == 55246);
    REQUIRE(sensor_set_rate(&sensor_ar0134, &settings, 24000000, 30000) == STATUS_OK && settings.frame_rows == 1068);
    /* A frame has 65535 rows at most. */
    settings.row_clocks = 61036;
    REQUIRE(sensor_set_rate(&sensor_ar0134, &settings, 24000000, 12) == STATUS_OK && settings.frame_rows == 65535);
    settings.row_clocks = 61035;
    REQUIRE(sensor_set_rate(&sensor_ar0134, &settings, 24000000, 12) == STATUS_BAD_ARGUMENT);
    settings.row_clocks = 0;
    REQUIRE(sensor_rate(&sensor_ar0134, &settings, 24000000) == 0);
    REQUIRE(sensor_set_rate(&sensor_ar0134, &settings, 24000000, 30000) == STATUS_BAD_ARGUMENT);
    REQUIRE(sensor_clock_hz(&sensor_ar0134, 37125000) == 74250000 && sensor_clock_hz(&sensor_ar0134, 37125001) == 0);
    REQUIRE(sensor_clock_hz(&sensor_ar0134, 23999999) == 0);
}

/* What a sensor cannot do is refused, at each limit, and nothing is written. */
static void test_limits(void)
{
    static const struct {
        const sensor_model_t *model;
        uint16_t              width, height;
    } none[] = {
        {&sensor_mt9v034, 753, 480}, {&sensor_mt9v034, 752, 481}, {&sensor_mt9v034, 0, 480}, {&sensor_mt9v034, 640, 0},
        {&sensor_ov7670, 640, 481}, {&sensor_ov7670, 320, 239}, {&sensor_ov7670, 161, 120}, {&sensor_ov7670, 80, 60},
        {&sensor_ar0134, 1282, 960}, {&sensor_ar0134, 1281, 960}, {&sensor_ar0134, 1279, 960},
        {&sensor_ar0134, 1280, 962}, {&sensor_mt9v034, 65535, 65535},
    };
    sensor_settings_t settings;
    sensor_timing_t   timing;

    for (size_t i = 0; i < COUNT(none); i++) {
        settings = (sensor_settings_t){.gain = 77};
        REQUIRE(sensor_defaults(none[i].model, none[i].width, none[i].height, &settings) == STATUS_SIZE);
        REQUIRE(settings.gain == 77);
    }
    for (size_t i = 0; i < COUNT(models); i++) {
        const sensor_model_t   *model = models[i];
        const sensor_settings_t good  = defaults(model, 640, 480);
        exposure_limits_t       limits = sensor_exposure_limits(model, &good);

        REQUIRE(sensor_timing(model, &good, &timing) == STATUS_OK);
        set_up(model);
#define REFUSED(member, bad, status)                                                                      \
    do {                                                                                                  \
        settings        = good;                                                                           \
        settings.member = (bad);                                                                          \
        REQUIRE(sensor_check(model, &settings) == (status));                                              \
        REQUIRE(sensors_begin(&sensors, &settings, 0) == (status) && !sensors.begun && !sensors.running); \
    } while (0)
#define ALLOWED(member, value)                                  \
    do {                                                        \
        settings        = good;                                 \
        settings.member = (value);                              \
        REQUIRE(sensor_check(model, &settings) == STATUS_OK);   \
    } while (0)
        REFUSED(width, 2000, STATUS_SIZE);
        REFUSED(width, 0, STATUS_SIZE);
        REFUSED(height, 1000, STATUS_SIZE);
        REFUSED(height, 0, STATUS_SIZE);
        REFUSED(binning, 3, STATUS_SIZE);
        REFUSED(binning, 0, STATUS_SIZE);
        REFUSED(binning, 8, STATUS_SIZE);
        REFUSED(binning, 4, STATUS_SIZE);
        REFUSED(column, (uint16_t)(model->columns - 640 * good.binning + 1), STATUS_SIZE);
        REFUSED(row, (uint16_t)(model->rows - 480 * good.binning + 1), STATUS_SIZE);
        REFUSED(row_clocks, (uint16_t)(timing.least_row_clocks - 1), STATUS_BAD_ARGUMENT);
        REFUSED(frame_rows, (uint16_t)(timing.least_frame_rows - 1), STATUS_BAD_ARGUMENT);
        REFUSED(exposure, 0, STATUS_BAD_ARGUMENT);
        REFUSED(exposure, (uint16_t)(limits.most_exposure + 1), STATUS_BAD_ARGUMENT);
        REFUSED(gain, 15, STATUS_BAD_ARGUMENT);
        REFUSED(gain, 0, STATUS_BAD_ARGUMENT);
        REFUSED(gain, 33, STATUS_BAD_ARGUMENT);
        REFUSED(gain, (uint16_t)(limits.most_gain + 16), STATUS_BAD_ARGUMENT);
        ALLOWED(row_clocks, timing.least_row_clocks);
        ALLOWED(row_clocks, timing.most_row_clocks);
        ALLOWED(frame_rows, timing.least_frame_rows);
        ALLOWED(frame_rows, timing.most_frame_rows);
        ALLOWED(exposure, 1);
        ALLOWED(exposure, limits.most_exposure);
        ALLOWED(gain, 16);
        ALLOWED(gain, limits.most_gain);
        if (timing.most_row_clocks < UINT16_MAX) {
            REFUSED(row_clocks, (uint16_t)(timing.most_row_clocks + 1), STATUS_BAD_ARGUMENT);
        }
        if (timing.most_frame_rows < UINT16_MAX) {
            REFUSED(frame_rows, (uint16_t)(timing.most_frame_rows + 1), STATUS_BAD_ARGUMENT);
        }
        REQUIRE(fake_sensors.starts == 0 && fake_sensors.sensors[0].resets == 0);
    }
    /* A window of the AR0134 begins and ends at even columns and rows. */
    settings = defaults(&sensor_ar0134, 600, 400);
    REQUIRE(settings.column == 40 && settings.row == 80 && settings.binning == 2);
    settings.column = 41;
    REQUIRE(sensor_check(&sensor_ar0134, &settings) == STATUS_SIZE);
    settings = defaults(&sensor_ar0134, 602, 402);
    REQUIRE(settings.column == 38 && settings.row == 78);
    /* The exposure of an MT9V034 leaves two rows free. */
    settings = defaults(&sensor_mt9v034, 640, 480);
    REQUIRE(sensor_exposure_limits(&sensor_mt9v034, &settings).most_exposure == 523);
    REQUIRE(sensor_exposure_limits(&sensor_mt9v034, &settings).most_gain == 64);
    REQUIRE(sensor_exposure_limits(&sensor_ov7670, &settings).most_exposure == 525);
}

/* Tables that the driver can use: each register is read back once, and no list is longer than the driver has room
 * for. */
static void test_tables(void)
{
    for (size_t m = 0; m < COUNT(models); m++) {
        const sensor_model_t *model    = models[m];
        sensor_settings_t     settings = defaults(model, 640, 480);
        sensor_write_t        writes[100];
        size_t                count = model->frame(&settings, writes), read = 0, witnesses = 0;
        const sensor_list_t  *lists[] = {&model->set_up, &model->start};

        count += model->expose(&settings, writes + count);
        count += model->pattern(&settings, writes + count);
        REQUIRE(count <= SENSOR_MOST_WRITES && model->expose(&settings, writes) < SENSOR_MOST_WRITES);
        count = model->frame(&settings, writes);
        count += model->expose(&settings, writes + count);
        for (size_t list = 0; list < COUNT(lists); list++) {
            for (size_t i = 0; i < lists[list]->count; i++) {
                const sensor_write_t *write = &lists[list]->writes[i];

                witnesses += write->reg == model->witness.reg && write->value == model->witness.value;
                writes[count++] = *write;
            }
        }
        REQUIRE(witnesses == 1 && model->witness.readable != 0 && model->identity.count > 0);
        REQUIRE(model->set_up.writes[0].readable == 0);
        for (size_t i = 0; i < count; i++) {
            read += writes[i].readable != 0;
            REQUIRE(model->value_bytes == 2 || (writes[i].value <= 0xff && writes[i].readable <= 0xff));
            REQUIRE(model->register_bytes == 2 || writes[i].reg <= 0xff);
            for (size_t other = 0; other < i; other++) {
                REQUIRE(writes[i].reg != writes[other].reg || writes[i].readable == 0 || writes[other].readable == 0);
            }
        }
        REQUIRE(read >= 15);
        REQUIRE(strlen(sensor_name(model)) == 6 + (model == &sensor_mt9v034));
    }
}

/* A set-up resets by the pin and by the register, and then reads what can be read, once. */
static void test_set_up(void)
{
    for (size_t m = 0; m < COUNT(models); m++) {
        const sensor_model_t *model    = models[m];
        sensor_settings_t     settings = defaults(model, 640, 480);
        sensor_write_t        writes[SENSOR_MOST_WRITES];
        uint32_t              reads = (uint32_t)model->identity.count;
        size_t                count = model->frame(&settings, writes);

        count += model->expose(&settings, writes + count);
        count += model->pattern(&settings, writes + count);
        for (size_t i = 0; i < count; i++) {
            reads += writes[i].readable != 0;
        }
        for (size_t i = 0; i < model->set_up.count; i++) {
            reads += model->set_up.writes[i].readable != 0;
        }
        for (size_t i = 0; i < model->start.count; i++) {
            reads += model->start.writes[i].readable != 0;
        }
        set_up(model);
        REQUIRE(sensors_begin(&sensors, &settings, 5 * SECOND) == STATUS_OK && fake_sensors.clock < SECOND / 2);
        for (unsigned i = 0; i < FAKE_SENSORS; i++) {
            REQUIRE(fake_sensors.sensors[i].resets == 2 && fake_sensors.sensors[i].sent == reads * model->value_bytes);
        }
        REQUIRE(fake_sensors.reset_for >= HZ / 1000);
        REQUIRE(fake_sensors.woke_after >= (uint64_t)model->wake_ms * (HZ / 1000));
        for (size_t i = 0; i < model->set_up.count; i++) {
            const fake_write_t *log = &fake_sensors.sensors[0].log[i];

            REQUIRE(log[0].reg == model->set_up.writes[i].reg && log[0].value == model->set_up.writes[i].value);
            REQUIRE(log[1].clock - log[0].clock >= (uint64_t)model->set_up.writes[i].pause_ms * (HZ / 1000));
        }
        /* The first poll is a second after it. */
        REQUIRE(sensors_poll(&sensors, 6 * SECOND - 1) == SENSORS_SAME);
        REQUIRE(fake_sensors.sensors[0].sent == reads * model->value_bytes);
        REQUIRE(sensors_poll(&sensors, 6 * SECOND) == SENSORS_SAME);
        REQUIRE(fake_sensors.sensors[0].sent > reads * model->value_bytes);
    }
}

/* Every fault of either sensor in a set-up: it is told, and the next poll sets both up. */
static void test_set_up_faults(void)
{
    for (size_t m = 0; m < COUNT(models); m++) {
        sensor_settings_t settings = defaults(models[m], 640, 480);
        uint16_t          reg      = models[m]->identity.writes[0].reg;

        for (unsigned which = 0; which < FAKE_SENSORS; which++) {
            uint8_t  side = (uint8_t)(SENSOR_LEFT << which);
            uint32_t bytes;

            /* Another sensor. */
            set_up(models[m]);
            fake_sensors.sensors[which].other = true;
            REQUIRE(sensors_begin(&sensors, &settings, 0) == STATUS_UNSUPPORTED && !sensors.running && sensors.begun);
            REQUIRE(bus.fault.kind == SENSOR_FAULT_IDENTITY && bus.fault.sensors == side && bus.fault.reg == reg);
            REQUIRE(bus.fault.expected == models[m]->identity.writes[0].value && bus.fault.value != bus.fault.expected);
            REQUIRE(sensors.present == (SENSOR_BOTH ^ side) && fake_sensors.sensors[0].count == 0);
            fake_sensors.sensors[which].other = false;
            REQUIRE(sensors_poll(&sensors, SECOND) == SENSORS_BACK && sensors.running && sensors.set_ups == 1);

            /* A register that keeps another value: of the set-up, of the settings, the last one. */
            for (size_t i = 0; i < 3; i++) {
                const sensor_list_t *last = models[m]->start.count > 0 ? &models[m]->start : &models[m]->set_up;
                sensor_write_t       writes[SENSOR_MOST_WRITES];

                (void)models[m]->frame(&settings, writes);
                set_up(models[m]);
                fake_sensors.sensors[which].deaf = i == 0 ? models[m]->set_up.writes[models[m]->set_up.count - 1].reg
                    : i == 1 ? writes[2].reg : last->writes[last->count - 1].reg;
                REQUIRE(sensors_begin(&sensors, &settings, 0) == STATUS_UNSUPPORTED && !sensors.running);
                REQUIRE(bus.fault.kind == SENSOR_FAULT_READ_BACK && bus.fault.sensors == side);
                REQUIRE(bus.fault.reg == fake_sensors.sensors[which].deaf && sensors.losses == 0);
            }

            /* No acknowledgement of any byte. */
            (void)run(models[m]);
            bytes = fake_sensors.sensors[which].bytes;
            for (uint32_t byte = 1; byte <= bytes; byte += byte < 12 ? 1 : 29) {
                set_up(models[m]);
                fake_sensors.sensors[which].nack_at = byte;
                REQUIRE(sensors_begin(&sensors, &settings, 0) == STATUS_UNSUPPORTED && !sensors.running);
                REQUIRE(bus.fault.kind == SENSOR_FAULT_NACK && bus.fault.sensors == side && fake_sensors_idle());
                REQUIRE(sensors_poll(&sensors, SECOND - 1) == SENSORS_SAME && !sensors.running);
                REQUIRE(sensors_poll(&sensors, SECOND) == SENSORS_BACK && sensors.running);
            }
        }
    }
}

static void test_held_bus(void)
{
    sensor_settings_t settings = run(&sensor_mt9v034);
    uint64_t          began    = fake_sensors.clock;

    fake_sensors.sensors[1].hold = true;
    REQUIRE(sensors_begin(&sensors, &settings, 0) == STATUS_TIMEOUT && bus.fault.kind == SENSOR_FAULT_SDA);
    REQUIRE(fake_sensors.clock - began < SECOND / 20 && sensors.present == SENSOR_LEFT);
    fake_sensors.sensors[1].hold         = false;
    fake_sensors.sensors[0].stretch_ever = true;
    began = fake_sensors.clock;
    REQUIRE(sensors_begin(&sensors, &settings, 0) == STATUS_TIMEOUT && bus.fault.kind == SENSOR_FAULT_SCL);
    REQUIRE(fake_sensors.clock - began < SECOND / 20 && sensors.present == 0);
    fake_sensors.sensors[0].stretch_ever = false;
    REQUIRE(sensors_begin(&sensors, &settings, 0) == STATUS_OK);
}

/* Exposure and gain: both sensors at once, within the blanking at the fastest clock. */
static void test_expose(void)
{
    for (size_t m = 0; m < COUNT(models); m++) {
        const sensor_model_t *model    = models[m];
        sensor_settings_t     settings = run(model);
        double                blanking = settings.row_clocks / (double)sensor_clock_hz(model, model->most_hz)
            * (settings.frame_rows - 480 * settings.binning);
        uint32_t              count = fake_sensors.sensors[0].count;
        uint64_t              began = fake_sensors.clock;

        REQUIRE(sensors_expose(&sensors, 100, 40) == STATUS_OK);
        REQUIRE((double)(fake_sensors.clock - began) / HZ < blanking);
        REQUIRE(fake_sensors.sensors[0].count > count);
        REQUIRE(sensors.settings.exposure == 100 && sensors.settings.gain == 40);
        require_lockstep();
        count = fake_sensors.sensors[0].count;
        REQUIRE(sensors_expose(&sensors, 0, 40) == STATUS_BAD_ARGUMENT);
        REQUIRE(sensors_expose(&sensors, 100, 41) == STATUS_BAD_ARGUMENT);
        REQUIRE(sensors_expose(&sensors, (uint16_t)(settings.frame_rows + 1), 40) == STATUS_BAD_ARGUMENT);
        REQUIRE(fake_sensors.sensors[0].count == count && sensors.settings.exposure == 100 && sensors.running);
        REQUIRE(sensors_poll(&sensors, SECOND) == SENSORS_SAME && sensors.running);
        /* A fault is a loss. */
        fake_sensors.sensors[1].nack_at = 3;
        REQUIRE(sensors_expose(&sensors, 101, 40) == STATUS_UNSUPPORTED && !sensors.running && sensors.losses == 1);
        REQUIRE(sensors_expose(&sensors, 101, 40) == STATUS_STATE);
        REQUIRE(sensors_poll(&sensors, SECOND + 1) == SENSORS_GONE && !sensors.running);
        REQUIRE(sensors_poll(&sensors, SECOND + 2) == SENSORS_SAME);
        REQUIRE(sensors_poll(&sensors, 2 * SECOND) == SENSORS_BACK && sensors.running && sensors.losses == 1);
        REQUIRE(sensors.settings.exposure == 101 && sensors.set_ups == 2);
    }
}

static void test_pattern(void)
{
    (void)run(&sensor_mt9v034);
    REQUIRE(sensors_show_pattern(&sensors, true) == STATUS_OK && sensors.settings.pattern);
    REQUIRE_REGISTERS({0x7f, 0x3000}, {0x70, 0});
    REQUIRE(sensors_show_pattern(&sensors, false) == STATUS_OK && !sensors.settings.pattern);
    REQUIRE_REGISTERS({0x7f, 0}, {0x70, 0x0101});
    require_lockstep();
    fake_sensors.sensors[1].deaf = 0x7f;
    REQUIRE(sensors_show_pattern(&sensors, true) == STATUS_UNSUPPORTED && !sensors.running);
    REQUIRE(sensors_show_pattern(&sensors, true) == STATUS_STATE);
    (void)run(&sensor_ov7670);
    REQUIRE(sensors_show_pattern(&sensors, true) == STATUS_OK);
    REQUIRE_REGISTERS({0x71, 0xb5}, {0x70, 0x3a});
    /* It stays with other settings. */
    REQUIRE(sensors_apply(&sensors, &sensors.settings) == STATUS_OK);
    REQUIRE_REGISTERS({0x71, 0xb5});
    REQUIRE(sensors_show_pattern(&sensors, false) == STATUS_OK);
    REQUIRE_REGISTERS({0x71, 0x35});
    (void)run(&sensor_ar0134);
    REQUIRE(sensors_show_pattern(&sensors, true) == STATUS_OK);
    REQUIRE_REGISTERS({0x3070, 2});
    REQUIRE(sensors_show_pattern(&sensors, false) == STATUS_OK);
    REQUIRE_REGISTERS({0x3070, 0});
}

static void test_apply_and_shift(void)
{
    sensor_settings_t settings = run(&sensor_ov7670), bad = settings;

    bad.width = 641;
    REQUIRE(sensors_apply(&sensors, &bad) == STATUS_SIZE && sensors.running && sensors.settings.width == 640);
    /* One sensor gets a longer frame, and the other does not. */
    REQUIRE(sensors_shift(&sensors, SENSOR_RIGHT, 517) == STATUS_OK);
    REQUIRE(*fake_register(0, 0x92) == 0 && *fake_register(1, 0x92) == 7 && sensors.settings.frame_rows == 510);
    REQUIRE(sensors_poll(&sensors, SECOND) == SENSORS_SAME);
    REQUIRE(sensors_apply(&sensors, &settings) == STATUS_OK && *fake_register(1, 0x92) == 0);
    REQUIRE(sensors_shift(&sensors, SENSOR_LEFT, 511) == STATUS_OK && *fake_register(0, 0x92) == 1);
    REQUIRE(sensors_shift(&sensors, SENSOR_BOTH, 511) == STATUS_BAD_ARGUMENT);
    REQUIRE(sensors_shift(&sensors, 0, 511) == STATUS_BAD_ARGUMENT);
    REQUIRE(sensors_shift(&sensors, SENSOR_LEFT, 509) == STATUS_BAD_ARGUMENT && sensors.running);
    fake_sensor_plug(0, false);
    REQUIRE(sensors_shift(&sensors, SENSOR_LEFT, 511) == STATUS_UNSUPPORTED && !sensors.running);
    REQUIRE(sensors_shift(&sensors, SENSOR_LEFT, 511) == STATUS_STATE);
    REQUIRE(sensors_apply(&sensors, &settings) == STATUS_STATE);
    (void)run(&sensor_ov7670);
    fake_sensors.sensors[0].deaf = 0x92;
    settings.frame_rows          = 520;
    REQUIRE(sensors_apply(&sensors, &settings) == STATUS_UNSUPPORTED && bus.fault.kind == SENSOR_FAULT_READ_BACK);
    REQUIRE(bus.fault.reg == 0x92 && bus.fault.expected == 10 && bus.fault.value == 0 && !sensors.running);
}

/* Unplugged and back: told once each, and both are set up anew. */
static void test_polls(void)
{
    static const uint16_t exposures[] = {0x0b, 0x10, 0x3012};

    for (size_t m = 0; m < COUNT(models); m++) {
        for (unsigned which = 0; which < FAKE_SENSORS; which++) {
            uint8_t  others = (uint8_t)(SENSOR_BOTH ^ SENSOR_LEFT << which);
            uint64_t clock  = 0, began;
            uint32_t starts;

            (void)run(models[m]);
            for (int i = 0; i < 3; i++) {
                starts = fake_sensors.starts;
                clock += SECOND - 1;
                REQUIRE(sensors_poll(&sensors, clock) == SENSORS_SAME && fake_sensors.starts == starts);
                began = fake_sensors.clock;
                clock++;
                REQUIRE(sensors_poll(&sensors, clock) == SENSORS_SAME && fake_sensors.starts > starts);
                REQUIRE(fake_sensors.clock - began < SECOND / 50);
                REQUIRE(sensors.present == SENSOR_BOTH && sensors.set_ups == 1);
            }
            fake_sensor_plug(which, false);
            clock += SECOND;
            REQUIRE(sensors_poll(&sensors, clock) == SENSORS_GONE && sensors.present == others && !sensors.running);
            for (int i = 0; i < 3; i++) {
                clock += SECOND;
                REQUIRE(sensors_poll(&sensors, clock) == SENSORS_SAME && sensors.present == others && !sensors.running);
            }
            fake_sensor_plug(which, true);
            fake_sensors.sensors[0].count = fake_sensors.sensors[1].count = 0;
            memset(fake_sensors.sensors[0].log, 0, sizeof(fake_sensors.sensors[0].log));
            memset(fake_sensors.sensors[1].log, 0, sizeof(fake_sensors.sensors[1].log));
            clock += SECOND;
            REQUIRE(sensors_poll(&sensors, clock) == SENSORS_BACK && sensors.present == SENSOR_BOTH && sensors.running);
            REQUIRE(sensors.losses == 1 && sensors.set_ups == 2);
            require_lockstep();
            /* Unplugged and back between two polls: it has lost its settings. */
            fake_sensor_plug(which, false);
            fake_sensor_plug(which, true);
            clock += SECOND;
            REQUIRE(sensors_poll(&sensors, clock) == SENSORS_GONE && sensors.losses == 2);
            clock += SECOND;
            REQUIRE(sensors_poll(&sensors, clock) == SENSORS_BACK && sensors.set_ups == 3);
            /* A disturbance is no loss, two are. */
            fake_sensors.sensors[which].nack_at = 2;
            clock += SECOND;
            REQUIRE(sensors_poll(&sensors, clock) == SENSORS_SAME && sensors.running);
            REQUIRE(fake_sensors.sensors[which].nack_at == 0);
            /* Exposure and gain are asked for as well. */
            *fake_register(which, exposures[m]) ^= 2;
            clock += SECOND;
            REQUIRE(sensors_poll(&sensors, clock) == SENSORS_GONE);
            REQUIRE(bus.fault.kind == SENSOR_FAULT_READ_BACK && bus.fault.sensors == SENSOR_LEFT << which);
        }
    }
    /* Before sensors_begin there is nothing to look after. */
    set_up(&sensor_mt9v034);
    REQUIRE(sensors_poll(&sensors, 10 * SECOND) == SENSORS_SAME && fake_sensors.starts == 0);
}

int main(void)
{
    test_mt9v034();
    test_ov7670();
    test_ar0134();
    test_rates();
    test_limits();
    test_tables();
    test_set_up();
    test_set_up_faults();
    test_held_bus();
    test_expose();
    test_pattern();
    test_apply_and_shift();
    test_polls();
    return 0;
}
