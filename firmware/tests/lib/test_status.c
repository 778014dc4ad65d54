/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Names of statuses: one for each, and one for all other numbers. The names are those of the header: see
 * tests/firmware/test_headers.py. */

#include <stdio.h>
#include <string.h>

#include "litestereo/status.h"
#include "require.h"

/* Prints the names of all statuses, and ends at the first number that has none. */
static int count_names(void)
{
    int count = 0;

    while (strcmp(status_name((status_t)count), "unknown") != 0) {
        for (int other = 0; other < count; other++) {
            REQUIRE(strcmp(status_name((status_t)other), status_name((status_t)count)) != 0);
        }
        count++;
    }
    return count;
}

int main(int arguments, char **argument)
{
    static const long others[] = {-1, 0x7f, 0x80, 0xff, 0x100, 0x7fffffff};
    int               count    = count_names();

    REQUIRE(count == STATUS_ROWS + 1 && STATUS_OK == 0);
    for (int status = count; status < 100000; status++) {
        REQUIRE(strcmp(status_name((status_t)status), "unknown") == 0);
    }
    for (size_t i = 0; i < sizeof(others) / sizeof(others[0]); i++) {
        REQUIRE(strcmp(status_name((status_t)others[i]), "unknown") == 0);
    }
    for (int status = 0; arguments > 1 && strcmp(argument[1], "names") == 0 && status < count; status++) {
        puts(status_name((status_t)status));
    }
    return 0;
}
