/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include <string.h>
#include <wchar.h>

#include "litestereo/print.h"
#include "require.h"

static char   sent[1000];
static size_t length;

/* In place of the UART's driver. */
void serial_send(serial_t *serial, const uint8_t *bytes, size_t count)
{
    REQUIRE(serial == NULL && length + count < sizeof(sent));
    memcpy(sent + length, bytes, count);
    length += count;
}

static void require_sent(const char *text)
{
    sent[length] = 0;
    REQUIRE(strcmp(sent, text) == 0);
    length = 0;
}

int main(void)
{
    char long_text[300];

    print(NULL, "%s: %d of 0x%08x\n", "frames", -3, 0xbeefu);
    require_sent("frames: -3 of 0x0000beef\r\n");
    print(NULL, "%s", "");
    require_sent("");
    print(NULL, "\n\na\nb");
    require_sent("\r\n\r\na\r\nb");
    /* Too long: cut, and no more. */
    memset(long_text, 'x', sizeof(long_text) - 1);
    long_text[sizeof(long_text) - 1] = 0;
    print(NULL, "%s", long_text);
    long_text[PRINT_MOST] = 0;
    require_sent(long_text);
    /* Nothing is sent of text that cannot be formatted. */
    print(NULL, "begun %lc\n", (wint_t)0x20ac);
    require_sent("");
    return 0;
}
