/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The rows that a map needs: docs/rectification.md has the arithmetic of a position. */

#include "litestereo/calibration.h"

/* Rows that may come in before they are needed, as gateware lets them; one more is under way. */
#define LEAD 2u

#define CAMERAS 2u

void row_budget_begin(row_budget_t *budget, const calibration_t *calibration)
{
    *budget = (row_budget_t){.calibration = calibration};
}

/* Displacement of a camera's columns or rows along a row of pixels, from a column of nodes on. */
typedef struct {
    int32_t value;  /* Of the pixel, with 15 bits of fraction. */
    int32_t step;   /* To the next one. */
} line_t;

static int32_t edge(const calibration_t *calibration, unsigned camera, uint32_t node, unsigned axis, int32_t line)
{
    int32_t upper = calibration_node(calibration, camera, node, axis);
    int32_t lower = calibration_node(calibration, camera, node + calibration_columns(calibration), axis);

    return (int32_t)CALIBRATION_STEP * upper + line * (lower - upper);
}

static line_t line_at(const row_budget_t *budget, unsigned camera, uint32_t column, unsigned axis)
{
    const calibration_t *calibration = budget->calibration;
    uint32_t node  = budget->row / CALIBRATION_STEP * calibration_columns(calibration) + column / CALIBRATION_STEP;
    int32_t  line  = (int32_t)(budget->row % CALIBRATION_STEP);
    int32_t  first = edge(calibration, camera, node, axis, line);

    return (line_t){
        .value = (int32_t)CALIBRATION_STEP * first,
        .step  = edge(calibration, camera, node + 1, axis, line) - first,
    };
}

/* Whole pixel of a position, down; the next one moves on. */
static int32_t advance(line_t *line, uint32_t own)
{
    int32_t place = (int32_t)own + (((line->value + 512) >> 10) >> 5);

    line->value += line->step;
    return place;
}

static void count_position(row_budget_t *budget, const int32_t *column, const int32_t *row)
{
    int32_t width  = budget->calibration->width;
    int32_t height = budget->calibration->height;
    int32_t oldest = height;

    for (unsigned camera = 0; camera < CAMERAS; camera++) {
        /* Without a neighbour inside of the image a position needs no row. */
        if (column[camera] >= -1 && column[camera] < width && row[camera] >= -1 && row[camera] < height) {
            int32_t need  = row[camera] + 2 < height ? row[camera] + 2 : height;
            int32_t first = row[camera] > 0 ? row[camera] : 0;

            budget->newest = (uint32_t)need > budget->newest ? (uint32_t)need : budget->newest;
            oldest         = first < oldest ? first : oldest;
        }
    }
    if ((int32_t)budget->newest - oldest > (int32_t)budget->span) {
        budget->span = budget->newest - (uint32_t)oldest;
    }
}

bool row_budget_step(row_budget_t *budget)
{
    const calibration_t *calibration = budget->calibration;
    line_t               columns[CAMERAS], rows[CAMERAS];

    for (uint32_t column = 0; column < calibration->width; column++) {
        int32_t place[CAMERAS], row[CAMERAS];

        for (unsigned camera = 0; camera < CAMERAS; camera++) {
            if (column % CALIBRATION_STEP == 0) {
                columns[camera] = line_at(budget, camera, column, 0);
                rows[camera]    = line_at(budget, camera, column, 1);
            }
            place[camera] = advance(&columns[camera], column);
            row[camera]   = advance(&rows[camera], budget->row);
        }
        count_position(budget, place, row);
    }
    budget->row++;
    return budget->row < calibration->height;
}

uint32_t row_budget_rows(const row_budget_t *budget)
{
    uint32_t rows = (budget->span + LEAD + 1 + 1) & ~1u;

    return rows > 4 ? rows : 4;
}
