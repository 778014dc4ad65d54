/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The whole loop: the registers of both sensors make the images, and these the exposure that is written to both. */

#include "litestereo/exposure.h"
#include "litestereo/sensor.h"

#include <string.h>

#include "fake_sensors.h"
#include "require.h"
#include "scene.h"

#define HZ      60000000u
#define SETTLED 30

static sensor_bus_t bus;
static sensors_t    sensors;
static exposure_t   control;

/* Exposure times gain, in rows, by the registers of a sensor. */
typedef double (*product_t)(unsigned sensor);

static double mt9v034_product(unsigned sensor)
{
    return *fake_register(sensor, 0x0b) * (*fake_register(sensor, 0x35) / 16.0);
}

static double ov7670_product(unsigned sensor)
{
    unsigned rows = (*fake_register(sensor, 0x07) & 0x3fu) << 10 | *fake_register(sensor, 0x10) << 2
        | (*fake_register(sensor, 0x04) & 3);
    unsigned gain = *fake_register(sensor, 0x00);
    double   product = rows * (1 + (gain & 15) / 16.0);

    for (unsigned bit = 4; bit < 8; bit++) {
        product *= 1 + (gain >> bit & 1);
    }
    return product;
}

static double ar0134_product(unsigned sensor)
{
    return *fake_register(sensor, 0x3012) * (double)(1u << (*fake_register(sensor, 0x30b0) >> 4 & 3))
        * (*fake_register(sensor, 0x305e) / 32.0);
}

/* Requires that both sensors got the same writes, at the same time. */
static void require_same(void)
{
    const fake_sensor_t *left = &fake_sensors.sensors[0], *right = &fake_sensors.sensors[1];

    REQUIRE(left->count == right->count && memcmp(left->log, right->log, sizeof(left->log)) == 0);
}

/* Runs frames under a light until nothing may change any more, and longer; returns the mean of the last one. */
static double settle(product_t product_of, const scene_t *scene, double light)
{
    static double      shown[3];  /* Products that show in the next frames. */
    image_statistics_t image;
    unsigned           changes = 0;

    for (int frame = 0; frame < 2 * SETTLED; frame++) {
        double product = product_of(0);

        REQUIRE(product == product_of(1));
        shown[0] = shown[1] == 0 ? product : shown[1];
        shown[1] = shown[2] == 0 ? product : shown[2];
        shown[2] = product;
        image    = scene_image(scene, light, shown[0], 1);
        if (exposure_step(&control, &image, &image)) {
            REQUIRE(sensors_expose(&sensors, control.exposure, control.gain) == STATUS_OK);
            require_same();
            changes += frame >= SETTLED;
        }
        REQUIRE(product_of(0) == control.exposure * (control.gain / 16.0));
    }
    REQUIRE(changes == 0);
    return scene_mean(&image);
}

static void test(const sensor_model_t *model, product_t product_of)
{
    static const double lights[] = {1, 1000, 1, 30, 1000, 2};
    scene_t             scene = scene_of(SCENE_GRADIENT);
    sensor_settings_t   settings;
    exposure_limits_t   limits;
    sensor_pins_t       pins;
    double              least;

    fake_sensors_set_up(model, HZ);
    pins = fake_sensors_pins();
    REQUIRE(sensor_bus_init(&bus, &pins) == STATUS_OK);
    REQUIRE(sensor_defaults(model, 640, 480, &settings) == STATUS_OK);
    sensors_init(&sensors, &bus, model);
    REQUIRE(sensors_begin(&sensors, &settings, 0) == STATUS_OK);
    limits = sensor_exposure_limits(model, &settings);
    REQUIRE(exposure_init(&control, &limits, settings.exposure, settings.gain) == STATUS_OK);
    /* The least light that the sensor makes a good image of. */
    least = 100.0 * 16 / limits.most_gain / limits.most_exposure;
    for (size_t i = 0; i < sizeof(lights) / sizeof(lights[0]); i++) {
        double mean = settle(product_of, &scene, least * lights[i]);

        REQUIRE(mean > 85 && mean < 115);
    }
    (void)settle(product_of, &scene, 0);
    REQUIRE(control.exposure == limits.most_exposure && control.gain == limits.most_gain);
    (void)settle(product_of, &scene, 1e6);
    REQUIRE(control.exposure == 1 && control.gain == 16 && sensors.losses == 0);
}

int main(void)
{
    test(&sensor_mt9v034, mt9v034_product);
    test(&sensor_ov7670, ov7670_product);
    test(&sensor_ar0134, ar0134_product);
    return 0;
}
