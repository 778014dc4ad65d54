/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "console.h"

#include <stdarg.h>

#include "litestereo/print.h"

void console_printf(console_t *console, const char *format, ...)
{
    va_list arguments;

    va_start(arguments, format);
    print_to(console->write, console->context, format, arguments);
    va_end(arguments);
}
