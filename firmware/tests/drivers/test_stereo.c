/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "mock_csr.h"
#include "require.h"
#include "stereo_fixture.h"

static void test_init(void)
{
    static const uint32_t versions[] = {0, 3, 0x0100, 0x0104, 0xffff};
    static const uint32_t wrong[][4] = {
        {0, 64, 21 << 8 | 5, 16}, {640, 0, 21 << 8 | 5, 16}, {640, 40, 21 << 8 | 5, 16}, {640, 64, 20 << 8 | 5, 16},
        {640, 64, 21 << 8 | 6, 16}, {640, 64, 5 << 8 | 7, 16}, {640, 64, 21 << 8 | 5, 0}, {640, 64, 21 << 8 | 5, 128},
        {640, 64, 21 << 8 | 5, 24},
    };

    REQUIRE(stereo_init(NULL) == STATUS_BAD_ARGUMENT);
    /* Registers older than the driver supports, or of another major version. */
    for (size_t i = 0; i < sizeof(versions) / sizeof(versions[0]); i++) {
        expect_capabilities(versions[i], 640, 64, 21 << 8 | 5, 16);
        REQUIRE(stereo_init(&stereo) == STATUS_UNSUPPORTED);
        require_all_done();
    }
    for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
        expect_capabilities(4, wrong[i][0], wrong[i][1], wrong[i][2], wrong[i][3]);
        REQUIRE(stereo_init(&stereo) == STATUS_UNSUPPORTED);
        require_all_done();
    }
    set_up();
    REQUIRE(stereo.capabilities.version == 0x0005 && stereo.capabilities.max_width == 640);
    REQUIRE(stereo.capabilities.limits.max_disparities == 64 && stereo.capabilities.limits.features == 0xff);
    REQUIRE(stereo.capabilities.limits.min_block_size == 5 && stereo.capabilities.limits.max_block_size == 21);
    REQUIRE(stereo.capabilities.limits.max_prefilter_cap == 50);
    REQUIRE(stereo.capabilities.dma_alignment == 16 && stereo.capabilities.max_height == 4095);
    /* A matcher that is busy when the firmware starts is stopped first. */
    expect_capabilities(4, 640, 64, 21 << 8 | 5, 16);
    expect_read("status", BUSY);
    expect_write("control", 2);
    expect_read("status", BUSY);
    expect_write("control", 2);
    expect_read("status", 0);
    expect_write("ev_pending", 3);
    expect_write("ev_enable", 3);
    REQUIRE(stereo_init(&stereo) == STATUS_OK);
    require_all_done();
}

/* Bad arguments touch no register. */
static void test_check(void)
{
    static const struct {
        stereo_field_t field;
        size_t         offset, size;
        uintptr_t      value;
    } wrong[] = {
#define FIELD(name) offsetof(stereo_job_t, name), sizeof(job.name)
#define SETTING(name) FIELD(settings.name)
        {STEREO_FIELD_LEFT, FIELD(left), 0},
        {STEREO_FIELD_LEFT, FIELD(left), 0x40000008},
        {STEREO_FIELD_RIGHT, FIELD(right), 0x40000001},
        {STEREO_FIELD_MAP, FIELD(map), 0x40000004},
        {STEREO_FIELD_DISPARITIES, SETTING(disparities), 0},
        {STEREO_FIELD_DISPARITIES, SETTING(disparities), 24},
        {STEREO_FIELD_DISPARITIES, SETTING(disparities), 80},
        {STEREO_FIELD_BLOCK_SIZE, SETTING(block_size), 3},
        {STEREO_FIELD_BLOCK_SIZE, SETTING(block_size), 8},
        {STEREO_FIELD_BLOCK_SIZE, SETTING(block_size), 23},
        {STEREO_FIELD_PREFILTER_CAP, SETTING(prefilter_cap), 0},
        {STEREO_FIELD_PREFILTER_CAP, SETTING(prefilter_cap), 64},
        {STEREO_FIELD_TEXTURE_THRESHOLD, SETTING(texture_threshold), 0x100000},
        {STEREO_FIELD_UNIQUENESS_RATIO, SETTING(uniqueness_ratio), 101},
        {STEREO_FIELD_DISP12_MAX_DIFF, SETTING(disp12_max_diff), (uint16_t)-2},
        {STEREO_FIELD_DISP12_MAX_DIFF, SETTING(disp12_max_diff), 255},
        {STEREO_FIELD_WIDTH, SETTING(width), 43},
        {STEREO_FIELD_WIDTH, SETTING(width), 641},
        {STEREO_FIELD_HEIGHT, SETTING(height), 8},
        {STEREO_FIELD_HEIGHT, SETTING(height), 4096},
#undef SETTING
#undef FIELD
    };

    for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
        set_up();
        memcpy((uint8_t *)&job + wrong[i].offset, &wrong[i].value, wrong[i].size);
        REQUIRE(stereo_check(&stereo, &job) == wrong[i].field);
        REQUIRE(stereo_submit(&stereo, &job, 0) == STATUS_BAD_ARGUMENT);
    }
    REQUIRE(stereo_submit(NULL, &job, 0) == STATUS_BAD_ARGUMENT);
    REQUIRE(stereo_submit(&stereo, NULL, 0) == STATUS_BAD_ARGUMENT);
    set_up();
    job.settings.width  = 44;
    job.settings.height = 9;
    REQUIRE(stereo_check(&stereo, &job) == STEREO_FIELD_NONE);
    REQUIRE(strcmp(stereo_field_name(STEREO_FIELD_BLOCK_SIZE), "block_size") == 0);
}

/* A missing stage is reported for the first setting that needs it. */
static void test_features(void)
{
    static const struct {
        uint32_t       features;
        stereo_field_t field;
    } missing[] = {
        {0xff & ~LITESTEREO_FEATURE_XSOBEL,        STEREO_FIELD_PREFILTER},
        {0xff & ~LITESTEREO_FEATURE_TEXTURE,       STEREO_FIELD_TEXTURE_THRESHOLD},
        {0xff & ~LITESTEREO_FEATURE_UNIQUENESS,    STEREO_FIELD_UNIQUENESS_RATIO},
        {0xff & ~LITESTEREO_FEATURE_SUBPIXEL,      STEREO_FIELD_SUBPIXEL},
        {0xff & ~LITESTEREO_FEATURE_MIN_DISPARITY, STEREO_FIELD_MIN_DISPARITY},
        {0xff & ~LITESTEREO_FEATURE_LEFT_RIGHT,    STEREO_FIELD_DISP12_MAX_DIFF},
        {0xff & ~LITESTEREO_FEATURE_MEDIAN,        STEREO_FIELD_MEDIAN},
        {0xff & ~LITESTEREO_FEATURE_RAW,           STEREO_FIELD_NONE},
    };

    for (size_t i = 0; i < sizeof(missing) / sizeof(missing[0]); i++) {
        features = missing[i].features;
        set_up();
        job.settings.disp12_max_diff = 0;
        job.settings.median          = true;
        REQUIRE(stereo_check(&stereo, &job) == missing[i].field);
        /* Its own defaults suit every device. */
        job.settings        = stereo_settings_default(&stereo.capabilities.limits);
        job.settings.width  = 320;
        job.settings.height = 240;
        REQUIRE(stereo_check(&stereo, &job) == STEREO_FIELD_NONE);
        job.settings        = stereo_settings_bare(&stereo.capabilities.limits);
        job.settings.width  = 320;
        job.settings.height = 240;
        REQUIRE(stereo_check(&stereo, &job) == STEREO_FIELD_NONE);
        REQUIRE(job.settings.xsobel == ((features & LITESTEREO_FEATURE_RAW) == 0));
    }
    features = LITESTEREO_FEATURE_XSOBEL;
    set_up();
    job.settings        = stereo_settings_bare(&stereo.capabilities.limits);
    job.settings.xsobel = false;
    REQUIRE(stereo_check(&stereo, &job) == STEREO_FIELD_PREFILTER);
    /* One of the two prefilter stages must exist. */
    features = 0xfc;
    expect_capabilities(4, 640, 64, 21 << 8 | 5, 16);
    REQUIRE(stereo_init(&stereo) == STATUS_UNSUPPORTED);
    require_all_done();
    features = 0xff;
    REQUIRE(strcmp(stereo_feature_name(0), "xsobel") == 0 && strcmp(stereo_feature_name(7), "median") == 0);
}

/* Every option has its bit, and the left-right check its switch. */
static void test_options(void)
{
    for (unsigned bits = 0; bits < 32; bits++) {
        set_up();
        job.settings.xsobel          = (bits & 1) != 0;
        job.settings.subpixel        = (bits & 2) != 0;
        job.settings.median          = (bits & 4) != 0;
        job.settings.disp12_max_diff = (bits & 8) != 0 ? 254 : -1;
        job.streamed                 = (bits & 16) != 0;
        submit(0);
    }
}

static void test_done(void)
{
    stereo_result_t result;

    set_up();
    REQUIRE(stereo_poll(&stereo, 0, &result) == STATUS_IDLE);
    submit(1000);
    REQUIRE(stereo_submit(&stereo, &job, 1000) == STATUS_BUSY);
    REQUIRE(stereo_poll(&stereo, 2000, &result) == STATUS_BUSY);
    require_all_done();
    interrupt(1);
    expect_end(77000, 1700);
    REQUIRE(stereo_poll(&stereo, 80000, &result) == STATUS_OK);
    require_all_done();
    REQUIRE(result.error == STEREO_ERROR_NONE && result.clocks == 77000 && result.first_row_clocks == 1700);
    REQUIRE(stereo_poll(&stereo, 80000, &result) == STATUS_IDLE && stereo.statistics.interrupts == 1);
    submit(90000);
    interrupt(0);
    REQUIRE(stereo_poll(&stereo, 90001, &result) == STATUS_BUSY && stereo.statistics.interrupts == 1);
}

static void test_errors(void)
{
    stereo_result_t result;

    for (uint32_t code = STEREO_ERROR_CONFIG; code <= STEREO_ERROR_ABORTED; code++) {
        set_up();
        submit(0);
        interrupt(2);
        expect_read("status", code << 8);
        expect_read("status", code << 8);
        REQUIRE(stereo_poll(&stereo, 100, &result) == STATUS_MATCHER);
        require_all_done();
        REQUIRE(result.error == code && result.clocks == 0);
    }
    /* The gateware still runs a job that could not be stopped. */
    set_up();
    expect_read("status", BUSY);
    REQUIRE(stereo_submit(&stereo, &job, 0) == STATUS_BUSY);
    require_all_done();
}

static void test_watchdog(void)
{
    const uint64_t  budget = 100000 + 16 * 320 * 240;
    stereo_result_t result;

    set_up();
    submit(5000);
    REQUIRE(stereo_poll(&stereo, 5000 + budget, &result) == STATUS_BUSY);
    require_all_done();
    expect_read("status", BUSY);
    expect_read("status", BUSY);
    expect_write("control", 2);
    expect_read("status", BUSY);
    expect_write("control", 2);
    expect_read("status", 3 << 8);
    expect_write("ev_pending", 3);
    expect_read("status", 3 << 8);
    REQUIRE(stereo_poll(&stereo, 5001 + budget, &result) == STATUS_TIMEOUT);
    require_all_done();
    REQUIRE(result.clocks == budget + 1 && stereo.statistics.timeouts == 1);
    REQUIRE(stereo_poll(&stereo, 5002 + budget, &result) == STATUS_IDLE);

    /* A frame whose interrupt was lost is late, but good. */
    submit(0);
    expect_end(1, 1);
    REQUIRE(stereo_poll(&stereo, budget + 1, &result) == STATUS_OK);
    require_all_done();
    /* And one that failed has failed, not timed out. */
    submit(0);
    expect_read("status", 2 << 8);
    expect_read("status", 2 << 8);
    REQUIRE(stereo_poll(&stereo, budget + 1, &result) == STATUS_MATCHER && result.error == 2);
    require_all_done();
    REQUIRE(stereo.statistics.lost_interrupts == 2 && stereo.statistics.timeouts == 1);

    /* A wait too long for the result saturates. */
    submit(0);
    expect_read("status", BUSY);
    expect_read("status", 0);
    expect_write("ev_pending", 3);
    expect_read("status", 0);
    REQUIRE(stereo_poll(&stereo, 1ull << 40, &result) == STATUS_TIMEOUT && result.clocks == UINT32_MAX);
    require_all_done();
}

/* A job that waits for something other than memory is allowed another budget, from that moment on. */
static void test_allow(void)
{
    const uint64_t  budget = 100000 + 16 * 320 * 240;
    stereo_result_t result;

    set_up();
    REQUIRE(stereo_budget(&job.settings) == budget);
    submit(1000);
    stereo_allow(&stereo, 5000, 10 * budget);
    REQUIRE(stereo_poll(&stereo, 5000 + 10 * budget, &result) == STATUS_BUSY);
    stereo_allow(&stereo, 5000 + 10 * budget, 100);
    REQUIRE(stereo_poll(&stereo, 5100 + 10 * budget, &result) == STATUS_BUSY);
    require_all_done();
    expect_read("status", BUSY);
    expect_read("status", BUSY);
    expect_write("control", 2);
    expect_read("status", 3 << 8);
    expect_write("ev_pending", 3);
    expect_read("status", 3 << 8);
    REQUIRE(stereo_poll(&stereo, 5101 + 10 * budget, &result) == STATUS_TIMEOUT);
    require_all_done();
    REQUIRE(result.clocks == 101 && stereo.statistics.timeouts == 1);
}

static void test_abort(void)
{
    set_up();
    expect_read("status", 0);
    expect_write("ev_pending", 3);
    REQUIRE(stereo_abort(&stereo) == STATUS_OK);
    require_all_done();

    /* If it does not stop, the wait is bounded. */
    submit(0);
    mock_clock      = 0;
    mock_clock_step = 30000;
    for (int i = 0; i < 4; i++) {
        expect_read("status", BUSY);
        expect_write("control", 2);
    }
    REQUIRE(stereo_abort(&stereo) == STATUS_TIMEOUT);
    require_all_done();
}

int main(void)
{
    test_init();
    test_check();
    test_features();
    test_options();
    test_done();
    test_errors();
    test_watchdog();
    test_allow();
    test_abort();
    return 0;
}
