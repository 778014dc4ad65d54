/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "litestereo/reset.h"

#include "platform.h"
#include "reset_word.h"

static void record(reset_cause_t cause, uint32_t resets, uint32_t place, uint16_t line)
{
    uint32_t kept = reset_record_cause_read() & RESET_BOOT_MASK;

    reset_record_cause_write((uint32_t)cause | kept | resets << RESET_RESETS_SHIFT | (uint32_t)line << RESET_LINE_SHIFT);
    reset_record_place_write(place);
}

static uint32_t resets_of(uint32_t word)
{
    return word >> RESET_RESETS_SHIFT & RESET_RESETS_MOST;
}

void reset_begin(reset_report_t *report)
{
    uint32_t word   = reset_record_cause_read();
    uint32_t resets = resets_of(word);

    *report = (reset_report_t){
        .cause = (reset_cause_t)(word & RESET_CAUSE_MOST),
        .place = reset_record_place_read(),
        .line  = (uint16_t)(word >> RESET_LINE_SHIFT),
        .image = (uint8_t)reset_image(word),
    };
    if (report->cause != RESET_POWER_UP && resets < RESET_RESETS_MOST) {
        resets++;
    }
    report->resets = (uint8_t)resets;
    /* The next start reads this unless reset_now records a cause before. */
    record(RESET_UNKNOWN, resets, 0, 0);
}

void reset_now(reset_cause_t cause, uint32_t place, uint16_t line)
{
    record(cause, resets_of(reset_record_cause_read()), place, line);
    for (;;) {
        ctrl_reset_write(REGISTER_BIT(CTRL_RESET_SOC_RST));
    }
}

void reset_forget_starts(void)
{
    reset_record_cause_write(reset_record_cause_read() & ~(RESET_STARTS_MOST << RESET_STARTS_SHIFT));
}

const char *reset_cause_name(reset_cause_t cause)
{
    static const char *const names[] = {
        [RESET_POWER_UP] = "power-up", [RESET_UNKNOWN] = "unknown", [RESET_REQUESTED] = "requested",
        [RESET_WATCHDOG] = "watchdog", [RESET_ENSURE] = "ensure", [RESET_MATCHER] = "matcher",
        [RESET_START] = "start",
    };

    return (unsigned)cause < sizeof(names) / sizeof(names[0]) ? names[cause] : "?";
}
