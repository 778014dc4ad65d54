/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Exposure and gain for a scene whose light changes. */

#include "litestereo/exposure.h"

#include <string.h>

#include "require.h"
#include "scene.h"

/* Frames after a change of the light by 1000 until nothing changes any more. */
#define SETTLED 30

/* A row is 26 us, a frame 525 of them; the gain goes to 4. */
static const exposure_limits_t limits = {.least_exposure = 1, .most_exposure = 523, .least_gain = 16, .most_gain = 64};

static exposure_t control;

/* Values in force: those written in the blanking after frame n show in frame n + 3. */
static struct {
    uint16_t exposure, gain;
} pipe[3];

static unsigned changes;

static void set_up(void)
{
    REQUIRE(exposure_init(&control, &limits, 100, 16) == STATUS_OK);
    for (int i = 0; i < 3; i++) {
        pipe[i].exposure = 100;
        pipe[i].gain     = 16;
    }
    changes = 0;
}

/* The next frame; returns its mean. `late` is how many frames the sensor needs for new values: 0 to 2. */
static double frame(const scene_t *scene, double light, int late)
{
    image_statistics_t image = scene_image(scene, light, pipe[2 - late].exposure, pipe[2 - late].gain / 16.0);
    exposure_t         before = control;
    bool               changed = exposure_step(&control, &image, &image);

    REQUIRE(changed == (control.exposure != before.exposure || control.gain != before.gain));
    REQUIRE(exposure_check(&limits, control.exposure, control.gain) == STATUS_OK);
    /* No step is more than four times, and it has rounding. */
    REQUIRE(control.exposure * control.gain <= before.exposure * before.gain * 4);
    REQUIRE(control.exposure * control.gain * 4.6 >= before.exposure * before.gain);
    /* Exposure goes before gain: with much gain it is at its limit. */
    REQUIRE(control.gain < 32 || control.exposure == limits.most_exposure);
    changes += changed;
    memmove(pipe, pipe + 1, sizeof(pipe) - sizeof(pipe[0]));
    pipe[2].exposure = control.exposure;
    pipe[2].gain     = control.gain;
    return scene_mean(&image);
}

/* Runs until the light has been the same for `SETTLED` frames; then nothing may change for as long again. Returns the
 * mean. */
static double settle(const scene_t *scene, double light, int late)
{
    double mean = 0;

    for (int i = 0; i < SETTLED; i++) {
        (void)frame(scene, light, late);
    }
    changes = 0;
    for (int i = 0; i < 2 * SETTLED; i++) {
        mean = frame(scene, light, late);
    }
    REQUIRE(changes == 0);
    return mean;
}

/* Lights from where the sensor is at its most to where it is at its least, and steps of up to 1:1000 between them. */
static void test_steps(void)
{
    static const double lights[] = {0.06, 60, 0.06, 0.3, 6, 0.06, 1, 20, 60, 0.1, 0.09, 0.08, 59, 50};

    for (int kind = 0; kind < SCENE_KINDS; kind++) {
        scene_t scene = scene_of(kind);

        for (int late = 0; late <= 2; late++) {
            set_up();
            for (size_t i = 0; i < sizeof(lights) / sizeof(lights[0]); i++) {
                double mean = settle(&scene, lights[i], late);

                /* Within an eighth of the target, unless the bright part is all that there is room for. */
                if (kind == SCENE_FLAT || kind == SCENE_GRADIENT) {
                    REQUIRE(mean > 85 && mean < 115);
                } else {
                    REQUIRE(mean > 45 && mean < 115);
                }
            }
        }
    }
}

/* The number whose power to `frames` is 1000. */
static double root_of_1000(int frames)
{
    double low = 1, high = 2;

    for (int i = 0; i < 40; i++) {
        double middle = (low + high) / 2, power = 1;

        for (int n = 0; n < frames && power < 1000; n++) {
            power *= middle;
        }
        if (power < 1000) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

/* A light that changes steadily by 1:1000, faster and slower. */
static void test_ramps(void)
{
    scene_t scene = scene_of(SCENE_GRADIENT);

    for (int frames = 30; frames <= 3000; frames *= 10) {
        double factor = root_of_1000(frames);

        for (int up = 0; up < 2; up++) {
            double light = up ? 0.06 : 60;

            set_up();
            (void)settle(&scene, light, 2);
            for (int n = 0; n < frames; n++) {
                double mean;

                light = up ? light * factor : light / factor;
                mean  = frame(&scene, light, 2);
                /* A slow change is followed. */
                REQUIRE(frames < 300 || (mean > 70 && mean < 145));
            }
            REQUIRE(light > (up ? 30 : 0.03) && light < (up ? 90 : 0.12));
            (void)settle(&scene, up ? 60 : 0.06, 2);
        }
    }
}

/* A light that trembles by less than an eighth changes nothing. */
static void test_hysteresis(void)
{
    scene_t  scene  = scene_of(SCENE_GRADIENT);
    unsigned random = 1;

    set_up();
    (void)settle(&scene, 1, 2);
    for (int i = 0; i < 1000; i++) {
        (void)frame(&scene, 1 + (double)(next_random(&random) % 101) / 1000 - 0.05, 2);
    }
    REQUIRE(changes <= 1);
}

/* Scenes that are too dark or too bright end at the limits, and stay there. */
static void test_ends(void)
{
    for (int kind = 0; kind < SCENE_KINDS; kind++) {
        scene_t scene = scene_of(kind);

        set_up();
        (void)settle(&scene, 0.0001, 2);
        REQUIRE(control.exposure == limits.most_exposure && control.gain == limits.most_gain);
        (void)settle(&scene, 100000, 2);
        REQUIRE(control.exposure == limits.least_exposure && control.gain == limits.least_gain);
        (void)settle(&scene, 0, 2);
        REQUIRE(control.exposure == limits.most_exposure && control.gain == limits.most_gain);
        REQUIRE(settle(&scene, 1, 2) > 45);
    }
}

/* New values are not judged before they show: three frames from one change to the next. */
static void test_wait(void)
{
    scene_t            scene = scene_of(SCENE_FLAT);
    image_statistics_t dark  = scene_image(&scene, 0.01, 100, 1), none = {0};

    set_up();
    for (int step = 0; step < 2; step++) {
        REQUIRE(exposure_step(&control, &dark, &dark));
        REQUIRE(!exposure_step(&control, &dark, &dark) && !exposure_step(&control, &dark, &dark));
    }
    REQUIRE(control.exposure == 523 && control.gain == 48);
    /* Frames without pixels do not count. */
    REQUIRE(exposure_step(&control, &dark, &dark) && control.gain == 64);
    REQUIRE(!exposure_step(&control, &none, &none) && control.wait == EXPOSURE_DELAY);
}

/* The factor of a step, in exposure of 100 rows. */
static uint16_t exposure_after(const image_statistics_t *left, const image_statistics_t *right)
{
    set_up();
    (void)exposure_step(&control, left, right);
    return control.gain == 16 ? control.exposure : (uint16_t)(control.exposure * control.gain / 16);
}

static image_statistics_t flat(unsigned value)
{
    image_statistics_t image = {.pixels = 800, .sum = 800 * value};

    image.dark             = value < 6 ? 800 : 0;
    image.bright           = value > 249 ? 800 : 0;
    image.bins[value / 16] = 800;
    return image;
}

/* A part of an image, in eighths, has one value, and the rest another. */
static image_statistics_t mixed(unsigned part, unsigned value, unsigned rest)
{
    image_statistics_t image = {.pixels = 800, .sum = part * 100 * value + (8 - part) * 100 * rest};

    image.dark = (value < 6 ? part * 100 : 0) + (rest < 6 ? (8 - part) * 100 : 0);
    image.bright = (value > 249 ? part * 100 : 0) + (rest > 249 ? (8 - part) * 100 : 0);
    image.bins[value / 16] += part * 100;
    image.bins[rest / 16] += (8 - part) * 100;
    return image;
}

static void test_factors(void)
{
    image_statistics_t dark = flat(50), bright = flat(150), none = {0}, image;

    REQUIRE(exposure_after(&dark, &dark) == 200);
    REQUIRE(exposure_after(&bright, &bright) >= 65 && exposure_after(&bright, &bright) <= 66);
    /* Both count, and one alone counts for both. */
    REQUIRE(exposure_after(&dark, &bright) == 100);
    REQUIRE(exposure_after(&dark, &none) == 200 && exposure_after(&none, &dark) == 200);
    REQUIRE(exposure_after(&none, &none) == 100);
    /* No change within an eighth. */
    for (unsigned value = 1; value < 249; value++) {
        image = flat(value);
        REQUIRE((exposure_after(&image, &image) == 100) == (value >= 89 && value <= 114));
    }
    /* A step is four times at most. */
    image = flat(20);
    REQUIRE(exposure_after(&image, &image) == 400);
    image = flat(0);
    REQUIRE(exposure_after(&image, &image) == 400);
    image = flat(255);
    REQUIRE(exposure_after(&image, &image) == 25);
    /* More than an eighth saturated, and not more, though the mean is right. */
    image = mixed(2, 255, 48);
    REQUIRE(exposure_after(&image, &image) == 75);
    image = mixed(1, 255, 78);
    REQUIRE(exposure_after(&image, &image) == 100);
    /* More than half, and half. */
    image = mixed(5, 255, 0);
    REQUIRE(exposure_after(&image, &image) == 25);
    image = mixed(4, 255, 0);
    REQUIRE(exposure_after(&image, &image) == 75);
    /* The mean asks for less than that. */
    image = mixed(2, 255, 245);
    REQUIRE(exposure_after(&image, &image) == 40);
    /* Mostly black: it is not known by how much. */
    image = mixed(3, 60, 5);
    REQUIRE(exposure_after(&image, &image) == 394);
    image = mixed(4, 60, 5);
    REQUIRE(exposure_after(&image, &image) == 307);
    image = mixed(3, 250, 5);
    REQUIRE(exposure_after(&image, &image) == 75);
    /* Brighter, but an eighth is all that may be saturated: to 249 for the brightest value of the bin. */
    image = mixed(2, 160, 20);
    REQUIRE(exposure_after(&image, &image) == 142);
    image = mixed(1, 160, 20);
    REQUIRE(exposure_after(&image, &image) > 200);
    image = mixed(2, 240, 20);
    REQUIRE(exposure_after(&image, &image) == 100);
}

/* Images with too many bright pixels make longer steps the more of them follow each other. */
static void test_bright_steps(void)
{
    static const uint16_t expected[] = {75, 37, 9, 2, 1};
    image_statistics_t    bright = mixed(3, 250, 5), good = flat(100);

    set_up();
    for (size_t i = 0; i < sizeof(expected) / sizeof(expected[0]); i++) {
        REQUIRE(exposure_step(&control, &bright, &bright) && control.exposure == expected[i]);
        control.wait = 0;
    }
    REQUIRE(!exposure_step(&control, &bright, &bright) && !exposure_step(&control, &good, &good));
    REQUIRE(exposure_init(&control, &limits, 100, 16) == STATUS_OK);
    REQUIRE(exposure_step(&control, &bright, &bright) && control.exposure == 75);
    control.wait = 0;
    REQUIRE(!exposure_step(&control, &good, &good));
    REQUIRE(exposure_step(&control, &bright, &bright) && control.exposure == 56);
}

/* Drawn scenes of any contrast: each settles, at each light. */
static void test_drawn(void)
{
    unsigned random = 1;

    for (int i = 0; i < 300; i++) {
        scene_t  scene = {{0}};
        unsigned range = 1 + next_random(&random) % 12;

        for (int patch = 0; patch < SCENE_PATCHES; patch++) {
            scene.patches[patch] = (double)(1u << next_random(&random) % range) * (1 + next_random(&random) % 16) / 64;
        }
        set_up();
        for (int light = 0; light < 4; light++) {
            (void)settle(&scene, (double)(1 + next_random(&random) % 10000) / 300, light % 3);
        }
    }
}

static void test_gains(void)
{
    static const uint16_t bad[][2] = {{0, 16}, {524, 16}, {9, 15}, {9, 65}, {9, 33}, {9, 68}};

    REQUIRE(exposure_round_gain(0) == 0 && exposure_round_gain(16) == 16 && exposure_round_gain(31) == 31);
    REQUIRE(exposure_round_gain(32) == 32 && exposure_round_gain(33) == 32 && exposure_round_gain(34) == 34);
    REQUIRE(exposure_round_gain(63) == 62 && exposure_round_gain(64) == 64 && exposure_round_gain(67) == 64);
    REQUIRE(exposure_round_gain(127) == 124 && exposure_round_gain(0xffff) == 0xf800);
    REQUIRE(exposure_check(&limits, 1, 16) == STATUS_OK && exposure_check(&limits, 523, 64) == STATUS_OK);
    for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
        REQUIRE(exposure_check(&limits, bad[i][0], bad[i][1]) == STATUS_BAD_ARGUMENT);
    }
}

static void test_init(void)
{
    static const exposure_limits_t bad[] = {
        {0, 523, 16, 64}, {1, 523, 0, 64}, {1, 523, 33, 64}, {524, 523, 16, 64}, {1, 523, 65, 64}, {101, 523, 16, 64},
    };

    set_up();
    REQUIRE(exposure_init(&control, &limits, 101, 17) == STATUS_OK && control.exposure == 101 && control.gain == 17);
    for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
        REQUIRE(exposure_init(&control, &bad[i], 100, 16) == STATUS_BAD_ARGUMENT);
        REQUIRE(control.exposure == 101 && control.limits.most_exposure == 523);
    }
    REQUIRE(exposure_init(&control, &limits, 100, 15) == STATUS_BAD_ARGUMENT);
}

/* Values by command stay until they are released. */
static void test_fixed(void)
{
    image_statistics_t dark = flat(1);

    set_up();
    REQUIRE(exposure_fix(&control, 524, 16) == STATUS_BAD_ARGUMENT);
    REQUIRE(exposure_fix(&control, 5, 33) == STATUS_BAD_ARGUMENT);
    REQUIRE(!control.fixed && control.exposure == 100);
    REQUIRE(exposure_fix(&control, 50, 24) == STATUS_OK && control.exposure == 50 && control.gain == 24);
    for (int i = 0; i < 10; i++) {
        REQUIRE(!exposure_step(&control, &dark, &dark));
    }
    REQUIRE(control.exposure == 50 && control.gain == 24);
    exposure_release(&control);
    REQUIRE(!exposure_step(&control, &dark, &dark) && !exposure_step(&control, &dark, &dark));
    REQUIRE(exposure_step(&control, &dark, &dark) && control.exposure == 300 && control.gain == 16);
}

/* The largest numbers that fit. */
static void test_large(void)
{
    static const exposure_limits_t wide = {1, 65535, 1, 63488};
    image_statistics_t             dark = {.pixels = UINT32_MAX, .sum = 1, .bins = {UINT32_MAX}};

    REQUIRE(exposure_init(&control, &wide, 65535, 63488) == STATUS_OK);
    REQUIRE(!exposure_step(&control, &dark, &dark) && control.exposure == 65535 && control.gain == 63488);
}

int main(void)
{
    test_steps();
    test_ramps();
    test_hysteresis();
    test_ends();
    test_wait();
    test_factors();
    test_bright_steps();
    test_drawn();
    test_gains();
    test_init();
    test_fixed();
    test_large();
    return 0;
}
