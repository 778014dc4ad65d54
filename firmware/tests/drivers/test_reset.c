/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The drivers of the reset record and of the watchdog, against registers that expect accesses. */

#define WITH_WATCHDOG

#include "drivers/reset.c"
#include "drivers/watchdog.c"

#include <setjmp.h>
#include <string.h>

#include "mock_csr.h"
#include "require.h"

#define RUNS 0x00010100u  /* Fed, enabled and with reset, less the feed. */

static jmp_buf after_reset;

uint32_t reset_record_cause_read(void)                 { return mock_take('r', "cause", 0); }
uint32_t reset_record_place_read(void)                 { return mock_take('r', "place", 0); }
void     reset_record_cause_write(uint32_t value)      { mock_take('w', "cause", value); }
void     reset_record_place_write(uint32_t value)      { mock_take('w', "place", value); }
uint32_t watchdog0_control_read(void)                  { return mock_take('r', "control", 0); }
uint32_t watchdog0_cycles_read(void)                   { return mock_take('r', "cycles", 0); }
void     watchdog0_control_write(uint32_t value)       { mock_take('w', "control", value); }
void     watchdog0_cycles_write(uint32_t value)        { mock_take('w', "cycles", value); }
void     watchdog0_ev_pending_write(uint32_t value)    { mock_take('w', "ev_pending", value); }
void     watchdog0_ev_enable_write(uint32_t value)     { mock_take('w', "ev_enable", value); }

void ctrl_reset_write(uint32_t value)
{
    mock_take('w', "reset", value);
    longjmp(after_reset, 1);
}

static reset_report_t begin(uint32_t word, uint32_t place, uint32_t noted)
{
    reset_report_t report;

    expect_read("cause", word);
    expect_read("place", place);
    expect_read("cause", word);
    expect_write("cause", noted);
    expect_write("place", 0);
    reset_begin(&report);
    require_all_done();
    return report;
}

static void test_begin(void)
{
    reset_report_t report = begin(0, 0, 1);

    REQUIRE(report.cause == RESET_POWER_UP && report.resets == 0 && report.line == 0 && report.place == 0);
    report = begin(0x004d0203, 0x40001234, 0x0301);
    REQUIRE(report.cause == RESET_WATCHDOG && report.resets == 3 && report.line == 77 && report.place == 0x40001234);
    /* Starts of a trial and the image are the boot program's: they stay. */
    REQUIRE(report.image == 0);
    report = begin(0x004d02b3, 0, 0x03b1);
    REQUIRE(report.cause == RESET_WATCHDOG && report.resets == 3 && report.image == 2);
    report = begin(0x00000050, 0, 0x0051);
    REQUIRE(report.cause == RESET_POWER_UP && report.resets == 0 && report.image == 1);
    expect_read("cause", 0x004d02b3);
    expect_write("cause", 0x004d0283);
    reset_forget_starts();
    require_all_done();
    /* The count saturates. */
    report = begin(0xffffff04, 1, 0xff01);
    REQUIRE(report.cause == RESET_ENSURE && report.resets == 255 && report.line == 0xffff);
    REQUIRE(strcmp(reset_cause_name(report.cause), "ensure") == 0);
    REQUIRE(strcmp(reset_cause_name(RESET_MATCHER), "matcher") == 0);
    REQUIRE(strcmp(reset_cause_name(RESET_START), "start") == 0);
    REQUIRE(strcmp(reset_cause_name((reset_cause_t)(RESET_START + 1)), "?") == 0);
    REQUIRE(strcmp(reset_cause_name((reset_cause_t)200), "?") == 0);
}

/* The next start reads what was recorded before the reset. */
static void test_now(void)
{
    expect_read("cause", 0x05a1);
    expect_read("cause", 0x05a1);
    expect_write("cause", 0x000705a4);
    expect_write("place", 0x40000010);
    expect_write("reset", 1);
    if (setjmp(after_reset) == 0) {
        reset_now(RESET_ENSURE, 0x40000010, 7);
        REQUIRE(!"back from a reset");
    }
    require_all_done();
}

static void test_watchdog(void)
{
    expect_write("control", 0);
    expect_write("cycles", 5000);
    expect_write("ev_pending", 1);
    expect_write("ev_enable", 1);
    expect_read("cycles", 5000);
    expect_write("control", RUNS | 1);
    watchdog_start(5000);
    expect_read("control", RUNS);
    expect_write("control", RUNS | 1);
    watchdog_feed();
    expect_write("control", 0);
    watchdog_pause();
    /* Feeding does not end a pause. */
    expect_read("control", 0);
    watchdog_feed();
    expect_read("cycles", 5000);
    expect_write("control", RUNS | 1);
    watchdog_resume();
    /* The end of a pause does nothing if the watchdog was never started. */
    expect_read("cycles", 0);
    watchdog_resume();
    require_all_done();
}

int main(void)
{
    test_begin();
    test_now();
    test_watchdog();
    return 0;
}
