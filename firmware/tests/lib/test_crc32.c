/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include <stdint.h>
#include <string.h>

#include "lib/bytes.h"
#include "litestereo/crc32.h"
#include "require.h"

/* One bit at a time, as the polynomial is defined. */
static uint32_t slow_crc(const uint8_t *bytes, size_t length)
{
    uint32_t crc = 0xffffffff;

    for (size_t i = 0; i < length; i++) {
        crc ^= bytes[i];
        for (int bit = 0; bit < 8; bit++) {
            crc = crc & 1 ? crc >> 1 ^ 0xedb88320 : crc >> 1;
        }
    }
    return ~crc;
}

static void test_crc(void)
{
    static uint32_t words[64];
    uint8_t        *bytes  = (uint8_t *)words;
    unsigned        random = 1;

    for (size_t i = 0; i < sizeof(words); i++) {
        bytes[i] = (uint8_t)next_random(&random);
    }
    REQUIRE(crc32_update(0, "123456789", 9) == 0xcbf43926);
    REQUIRE(crc32_update(0, bytes, 0) == 0);
    for (size_t start = 0; start < 8; start++) {
        for (size_t length = 0; length < sizeof(words) - 8; length++) {
            uint32_t crc = slow_crc(bytes + start, length);

            REQUIRE(crc32_update(0, bytes + start, length) == crc);
            REQUIRE(crc32_update(crc32_update(0, bytes + start, length / 3), bytes + start + length / 3,
                length - length / 3) == crc);
        }
    }
}

static void test_copy(void)
{
    static uint32_t from_words[32], to_words[32];
    uint8_t        *from = (uint8_t *)from_words;
    uint8_t        *to   = (uint8_t *)to_words;

    for (size_t i = 0; i < sizeof(from_words); i++) {
        from[i] = (uint8_t)(i + 1);
    }
    for (size_t start = 0; start < 16; start++) {
        for (size_t length = 0; length < 100; length++) {
            memset(to, 0, sizeof(to_words));
            copy_bytes(to + start % 4, from + start / 4, length);
            REQUIRE(memcmp(to + start % 4, from + start / 4, length) == 0);
            REQUIRE(to[start % 4 + length] == 0 && (start % 4 == 0 || to[start % 4 - 1] == 0));
        }
    }
}

int main(void)
{
    test_crc();
    test_copy();
    return 0;
}
