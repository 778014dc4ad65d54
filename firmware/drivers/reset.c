/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "litestereo/reset.h"

#include "platform.h"

/* Fields of the register `cause`, from bit 0 up: cause, resets, line. */
#define RESETS_SHIFT 8
#define LINE_SHIFT   16
#define RESETS_MOST  0xffu

static void record(reset_cause_t cause, uint32_t resets, uint32_t place, uint16_t line)
{
    reset_record_cause_write((uint32_t)cause | resets << RESETS_SHIFT | (uint32_t)line << LINE_SHIFT);
    reset_record_place_write(place);
}

void reset_begin(reset_report_t *report)
{
    uint32_t word   = reset_record_cause_read();
    uint32_t resets = word >> RESETS_SHIFT & RESETS_MOST;

    *report = (reset_report_t){
        .cause = (reset_cause_t)(word & 0xff),
        .place = reset_record_place_read(),
        .line  = (uint16_t)(word >> LINE_SHIFT),
    };
    if (report->cause != RESET_POWER_UP && resets < RESETS_MOST) {
        resets++;
    }
    report->resets = (uint8_t)resets;
    /* The next start reads this unless reset_now records a cause before. */
    record(RESET_UNKNOWN, resets, 0, 0);
}

void reset_now(reset_cause_t cause, uint32_t place, uint16_t line)
{
    record(cause, reset_record_cause_read() >> RESETS_SHIFT & RESETS_MOST, place, line);
    for (;;) {
        ctrl_reset_write(REGISTER_BIT(CTRL_RESET_SOC_RST));
    }
}

const char *reset_cause_name(reset_cause_t cause)
{
    static const char *const names[] = {
        [RESET_POWER_UP] = "power-up", [RESET_UNKNOWN] = "unknown", [RESET_REQUESTED] = "requested",
        [RESET_WATCHDOG] = "watchdog", [RESET_ENSURE] = "ensure", [RESET_MATCHER] = "matcher",
    };

    return (unsigned)cause < sizeof(names) / sizeof(names[0]) ? names[cause] : "?";
}
