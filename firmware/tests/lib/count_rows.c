/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Reads calibrations, each after its length in bytes and a line end, and prints what a device finds: rows, fold. */

#include <stdio.h>

#include "drawn_calibration.h"
#include "require.h"

static uint8_t record[DRAWN_CALIBRATION_MOST];

int main(void)
{
    unsigned      size;
    calibration_t calibration;
    row_budget_t  budget;

    while (scanf("%u", &size) == 1) {
        REQUIRE(getchar() == '\n' && size <= sizeof(record) && fread(record, 1, size, stdin) == size);
        REQUIRE(calibration_parse(&calibration, record, size) == STATUS_OK);
        row_budget_begin(&budget, &calibration);
        while (row_budget_step(&budget)) {
        }
        printf("%u %d\n", (unsigned)row_budget_rows(&budget), calibration_folds(&calibration));
    }
    return 0;
}
