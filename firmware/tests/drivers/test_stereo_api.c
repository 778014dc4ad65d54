/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Functions of the driver for users' programs, apart from submit and poll. */

#include <string.h>

#include "mock_csr.h"
#include "require.h"
#include "stereo_fixture.h"

static void test_sizes(void)
{
    set_up();
    job.settings.width  = 33;
    job.settings.height = 3;
    REQUIRE(stereo_image_bytes(&stereo, &job.settings) == 112 && stereo_map_bytes(&stereo, &job.settings) == 208);
    job.settings.width  = 32;
    REQUIRE(stereo_image_bytes(&stereo, &job.settings) == 96 && stereo_map_bytes(&stereo, &job.settings) == 192);
    job.settings.width  = 4095;
    job.settings.height = 4095;
    REQUIRE(stereo_map_bytes(&stereo, &job.settings) == 33538064);
}

/* Every job is counted once, by its end. */
static void require_counts(uint32_t submitted, uint32_t done, uint32_t config, uint32_t bus, uint32_t aborted,
    uint32_t timeouts)
{
    const stereo_statistics_t *is = &stereo.statistics;

    REQUIRE(is->submitted == submitted && is->done == done && is->config_errors == config && is->bus_errors == bus);
    REQUIRE(is->aborted == aborted && is->timeouts == timeouts);
}

static status_t end_with(uint32_t code)
{
    stereo_result_t result;

    submit(0);
    interrupt(2);
    expect_read("status", code << 8);
    expect_read("status", code << 8);
    return stereo_poll(&stereo, 100, &result);
}

static void test_statistics(void)
{
    stereo_result_t result;

    set_up();
    require_counts(0, 0, 0, 0, 0, 0);
    for (uint32_t clocks = 100; clocks > 0; clocks -= 50) {
        submit(0);
        interrupt(1);
        expect_end(clocks, 1);
        REQUIRE(stereo_poll(&stereo, 100, &result) == STATUS_OK);
    }
    require_counts(2, 2, 0, 0, 0, 0);
    REQUIRE(stereo.statistics.clocks == 150 && stereo.statistics.longest_clocks == 100);
    REQUIRE(end_with(STEREO_ERROR_CONFIG) == STATUS_MATCHER);
    require_counts(3, 2, 1, 0, 0, 0);
    REQUIRE(end_with(STEREO_ERROR_BUS) == STATUS_MATCHER);
    require_counts(4, 2, 1, 1, 0, 0);
    REQUIRE(end_with(STEREO_ERROR_ABORTED) == STATUS_MATCHER);
    require_counts(5, 2, 1, 1, 1, 0);
    REQUIRE(stereo.statistics.interrupts == 5 && stereo.statistics.lost_interrupts == 0);
    /* Refused: with bad settings, while another runs, and while the gateware runs what could not be stopped. */
    job.settings.block_size = 6;
    REQUIRE(stereo_submit(&stereo, &job, 0) == STATUS_BAD_ARGUMENT && stereo.statistics.refused == 1);
    job.settings.block_size = 9;
    submit(0);
    REQUIRE(stereo_submit(&stereo, &job, 0) == STATUS_BUSY && stereo.statistics.refused == 2);
    require_counts(6, 2, 1, 1, 1, 0);
    expect_read("status", 0);
    expect_write("ev_pending", 3);
    REQUIRE(stereo_abort(&stereo) == STATUS_OK);
    require_counts(6, 2, 1, 1, 2, 0);
    /* An abort without a job counts nothing. */
    expect_read("status", 0);
    expect_write("ev_pending", 3);
    REQUIRE(stereo_abort(&stereo) == STATUS_OK);
    require_counts(6, 2, 1, 1, 2, 0);
    /* An end without interrupt. */
    submit(0);
    expect_end(1, 1);
    REQUIRE(stereo_poll(&stereo, stereo_budget(&job.settings) + 1, &result) == STATUS_OK);
    require_counts(7, 3, 1, 1, 2, 0);
    REQUIRE(stereo.statistics.lost_interrupts == 1 && stereo.statistics.stuck == 0);
    require_all_done();
}

/* A job that neither ends nor stops: counted once as a timeout and once as stuck. */
static void test_stuck(void)
{
    stereo_result_t result;

    set_up();
    submit(0);
    mock_clock_step = 60000;
    expect_read("status", BUSY);
    for (int i = 0; i < 2; i++) {
        expect_read("status", BUSY);
        expect_write("control", 2);
    }
    expect_read("status", BUSY);
    REQUIRE(stereo_poll(&stereo, stereo_budget(&job.settings) + 1, &result) == STATUS_TIMEOUT);
    require_all_done();
    require_counts(1, 0, 0, 0, 0, 1);
    REQUIRE(stereo.statistics.stuck == 1 && stereo.statistics.lost_interrupts == 0);
}

/* Waiting needs no interrupt, and has an end. */
static void test_wait(void)
{
    stereo_result_t result;

    set_up();
    REQUIRE(stereo_wait(&stereo, &result) == STATUS_IDLE);
    submit(0);
    expect_read("status", BUSY);
    expect_read("status", BUSY);
    expect_end(70, 7);
    REQUIRE(stereo_wait(&stereo, &result) == STATUS_OK && result.clocks == 70 && result.first_row_clocks == 7);
    require_all_done();
    REQUIRE(stereo.statistics.done == 1 && stereo.statistics.lost_interrupts == 0);

    submit(mock_clock);
    mock_clock_step = stereo_budget(&job.settings);
    expect_read("status", BUSY);
    expect_read("status", BUSY);
    expect_read("status", 3 << 8);
    expect_write("ev_pending", 3);
    expect_read("status", 3 << 8);
    REQUIRE(stereo_wait(&stereo, &result) == STATUS_TIMEOUT && result.clocks == 2 * mock_clock_step);
    require_all_done();
    REQUIRE(stereo_wait(&stereo, &result) == STATUS_IDLE);
}

static void count_call(void *context)
{
    ++*(unsigned *)context;
}

static void test_handler(void)
{
    unsigned calls[2] = {0, 0};

    set_up();
    stereo_on_end(&stereo, count_call, &calls[0]);
    interrupt(0);
    REQUIRE(calls[0] == 0);
    interrupt(1);
    interrupt(2);
    REQUIRE(calls[0] == 2);
    stereo_on_end(&stereo, count_call, &calls[1]);
    interrupt(1);
    REQUIRE(calls[0] == 2 && calls[1] == 1);
    stereo_on_end(&stereo, NULL, NULL);
    interrupt(1);
    REQUIRE(calls[0] == 2 && calls[1] == 1 && stereo.statistics.interrupts == 4);
}

int main(void)
{
    test_sizes();
    test_statistics();
    test_stuck();
    test_wait();
    test_handler();
    return 0;
}
