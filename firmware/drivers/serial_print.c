/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "litestereo/print.h"

static void write_serial(void *context, const uint8_t *bytes, size_t length)
{
    serial_send(context, bytes, length);
}

void print(serial_t *serial, const char *format, ...)
{
    va_list arguments;

    va_start(arguments, format);
    print_to(write_serial, serial, format, arguments);
    va_end(arguments);
}
