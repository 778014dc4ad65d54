/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "litestereo/print.h"

#include <stdio.h>
#include <string.h>

void print_to(print_write_t write, void *context, const char *format, va_list arguments)
{
    char  text[PRINT_MOST + 1];
    char *line = text;

    if (vsnprintf(text, sizeof(text), format, arguments) < 0) {
        return;
    }
    for (;;) {
        char *end = strchr(line, '\n');

        if (end == NULL) {
            break;
        }
        write(context, (const uint8_t *)line, (size_t)(end - line));
        write(context, (const uint8_t *)"\r\n", 2);
        line = end + 1;
    }
    write(context, (const uint8_t *)line, strlen(line));
}
