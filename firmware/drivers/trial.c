/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "litestereo/trial.h"

#include <stddef.h>

#include "trial_choice.h"

void trial_init(trial_t *trial, records_t *records, const reset_report_t *report, uint32_t clock_hz)
{
    *trial = (trial_t){.records = records, .started = report->image, .second = clock_hz};
    if (records == NULL || !trial_read(&trial->record)) {
        trial->record = (trial_record_t){.state = TRIAL_NONE};
        return;
    }
    /* Without a boot program it is unknown which firmware this is. */
    if (trial->record.state != TRIAL_RUNNING || trial->started == 0) {
        return;
    }
    trial->here = trial->started == trial->record.image + 1;
    if (!trial->here) {
        trial->record.state = TRIAL_FELL_BACK;
        trial->wanted       = true;
        trial->insists      = true;
    }
}

trial_state_t trial_state(const trial_t *trial)
{
    return (trial_state_t)trial->record.state;
}

const char *trial_state_name(trial_state_t state)
{
    static const char *const names[] = {
        [TRIAL_NONE] = "unknown", [TRIAL_RUNNING] = "on trial", [TRIAL_CONFIRMED] = "confirmed",
        [TRIAL_FELL_BACK] = "failed on trial",
    };

    return (unsigned)state < sizeof(names) / sizeof(names[0]) ? names[state] : "?";
}

bool trial_confirm(trial_t *trial)
{
    if (!trial->here || trial->record.state != TRIAL_RUNNING) {
        return false;
    }
    trial->record.state = TRIAL_CONFIRMED;
    trial->wanted       = true;
    trial->insists      = true;
    return true;
}

static void begin(trial_t *trial)
{
    status_t status = records_begin_write(trial->records, RECORD_TRIAL, &trial->record, sizeof(trial->record));

    if (status == STATUS_OK) {
        trial->wanted  = false;
        trial->writing = true;
    }
}

static void proceed(trial_t *trial, uint64_t clock)
{
    trial->status = records_poll(trial->records, clock);
    if (trial->status == STATUS_BUSY) {
        return;
    }
    trial->writing = false;
    trial->since   = clock;
    if (trial->status == STATUS_OK) {
        /* The starts so far were those of a trial that has ended, or has not begun. */
        trial->insists = false;
        reset_forget_starts();
    }
}

void trial_poll(trial_t *trial, uint64_t clock)
{
    if (trial->since == 0) {
        trial->since = clock;
    }
    if (trial->writing) {
        proceed(trial, clock);
    } else if (trial->wanted) {
        begin(trial);
    } else if (clock - trial->since >= TRIAL_S * trial->second) {
        trial->since = clock;
        trial_confirm(trial);
        trial->wanted |= trial->insists;
    }
}

status_t trial_record(trial_t *trial, trial_state_t state, uint32_t image, uint32_t crc32)
{
    if (trial->records == NULL) {
        return STATUS_UNSUPPORTED;
    }
    if (trial->wanted || trial->writing) {
        return STATUS_BUSY;
    }
    trial->here    = false;
    trial->insists = false;
    trial->record  = (trial_record_t){.state = state, .image = image, .crc32 = crc32};
    trial->wanted  = true;
    return STATUS_OK;
}

status_t trial_status(const trial_t *trial)
{
    return trial->wanted || trial->writing ? STATUS_BUSY : trial->status;
}
