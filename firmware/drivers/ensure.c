/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "litestereo/ensure.h"

#include <stdio.h>

#include "litestereo/reset.h"
#include "litestereo/serial.h"

void ensure_failed(const char *file, unsigned line)
{
    uintptr_t place = (uintptr_t)__builtin_return_address(0);
    char      text[120];

    snprintf(text, sizeof(text), "\r\n%s:%u: ensure failed, reset\r\n", file, line);
    serial_say(text);
    reset_now(RESET_ENSURE, (uint32_t)place, (uint16_t)line);
}
