/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* A firmware that hangs at once, before it could start a watchdog; for the trial on the full system. */

#include <stdbool.h>

int main(void)
{
    for (volatile bool forever = true; forever;) {
    }
    return 0;
}
