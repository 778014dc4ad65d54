/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* No driver hands a peripheral an address outside of main RAM: at and around each limit, for several memory maps. */

#include <stdio.h>

#include "drivers/dma_memory.h"
#include "drivers/frame_link.h"
#include "mock_csr.h"
#include "require.h"
#include "stereo_fixture.h"

enum { ALIGNMENT = 16 };  /* Of the fixture's matcher, and of the frame link here. */

/* Main RAM of a SoC; one ends at 2**32, one has all addresses, one is no multiple of anything. */
static const struct {
    uint64_t base, size;
} maps[] = {
    {0x40000000, 0x00800000}, {0x80000000, 0x80000000}, {0, 0x100000000}, {0x10000, 0x40000}, {0xfffc0000, 0x40000},
    {0x40000000, 0x40000 - 8}, {0x40000000 + 16, 0x30000},
};

#define MAPS (sizeof(maps) / sizeof(maps[0]))

static frame_link_t link;
static _Alignas(FRAME_LINK_MAX_ALIGNMENT) uint8_t mailbox[FRAME_LINK_MAILBOX_SIZE];

static uint32_t seed = 1;

static uint32_t draw(void)
{
    seed = seed * 1664525u + 1013904223u;
    return seed >> 8;
}

static void use_map(size_t map)
{
    stub_ram_base  = maps[map].base;
    stub_ram_bytes = maps[map].size;
}

static void use_all(void)
{
    stub_ram_base  = 0;
    stub_ram_bytes = 1ull << 32;
}

/* The definition: each byte of the range is in RAM, and there is one. Both ends are enough. */
static bool is_in_ram(uint64_t first, uint64_t bytes)
{
    __int128 last = (__int128)first + bytes - 1;

    return first != 0 && bytes > 0 && first >= stub_ram_base && last < (__int128)stub_ram_base + stub_ram_bytes;
}

/* An address at or around a limit of the memory map: so that `bytes` bytes begin or end there. */
static uint64_t draw_address(uint64_t bytes)
{
    static const int64_t steps[] = {-2 * ALIGNMENT, -ALIGNMENT, -1, 0, 1, ALIGNMENT, 2 * ALIGNMENT};
    int64_t              step    = steps[draw() % (sizeof(steps) / sizeof(steps[0]))];
    uint64_t             limits[] = {
        stub_ram_base, stub_ram_base + stub_ram_bytes, stub_ram_base - bytes, stub_ram_base + stub_ram_bytes - bytes,
        stub_ram_base + stub_ram_bytes / 2, 0, 1ull << 32, (1ull << 32) - bytes,
    };

    /* Registers have 32 bits, but a pointer of this computer may be beyond them. */
    return (limits[draw() % (sizeof(limits) / sizeof(limits[0]))] + (uint64_t)step) & 0x1ffffffff;
}

static uint8_t *at(uint64_t address)
{
    return (uint8_t *)(uintptr_t)address;
}

static void test_rule(void)
{
    static const uint32_t sizes[] = {0, 1, 2, 15, 16, 17, 1024, 0x40000, 0x7fffffff, 0x80000000, 0xffffffff};
    unsigned              counts[2] = {0, 0};

    for (unsigned round = 0; round < 200000; round++) {
        uint32_t bytes     = sizes[draw() % (sizeof(sizes) / sizeof(sizes[0]))];
        uint32_t alignment = 1u << draw() % 7;
        uint64_t address;
        bool     reached;

        use_map(draw() % MAPS);
        address = draw_address(bytes);
        reached = dma_reaches(at(address), bytes, alignment);
        REQUIRE(reached == (is_in_ram(address, bytes) && address % alignment == 0));
        counts[reached]++;
    }
    REQUIRE(counts[0] > 20000 && counts[1] > 20000);
}

/* Draws addresses for one field of a job that is otherwise in the middle of RAM, and all sizes. */
static void test_jobs(void)
{
    unsigned refused = 0, accepted = 0;

    for (unsigned round = 0; round < 50000; round++) {
        stereo_field_t field = (stereo_field_t[]){STEREO_FIELD_LEFT, STEREO_FIELD_RIGHT, STEREO_FIELD_MAP}[draw() % 3];
        uint64_t       bytes, address;
        bool           good;

        use_all();
        set_up();
        job.settings.width  = (uint16_t)(44 + draw() % 60);
        job.settings.height = (uint16_t)(9 + draw() % 40);
        job.streamed        = draw() % 4 == 0;
        use_map(draw() % MAPS);
        job.left = job.right = job.map = at((stub_ram_base + stub_ram_bytes / 4 + ALIGNMENT) / ALIGNMENT * ALIGNMENT);
        REQUIRE(stereo_check(&stereo, &job) == STEREO_FIELD_NONE);
        bytes   = field == STEREO_FIELD_MAP ? stereo_map_bytes(&stereo, &job.settings)
                                            : stereo_image_bytes(&stereo, &job.settings);
        address = draw_address(bytes);
        if (field == STEREO_FIELD_LEFT) {
            job.left = at(address);
        } else if (field == STEREO_FIELD_RIGHT) {
            job.right = at(address);
        } else {
            job.map = at(address);
        }
        good = address != 0 && address % ALIGNMENT == 0
            && (is_in_ram(address, bytes) || (job.streamed && field != STEREO_FIELD_MAP));
        REQUIRE(stereo_check(&stereo, &job) == (good ? STEREO_FIELD_NONE : field));
        if (!good) {
            /* No register is touched. */
            REQUIRE(stereo_submit(&stereo, &job, 0) == STATUS_BAD_ARGUMENT && stereo.statistics.refused == 1);
        }
        refused  += !good;
        accepted += good;
    }
    REQUIRE(refused > 5000 && accepted > 5000);
    use_all();
}

/* Sizes of 0 are refused as sizes, at any address. */
static void test_empty_jobs(void)
{
    set_up();
    job.settings.width = 0;
    REQUIRE(stereo_check(&stereo, &job) == STEREO_FIELD_WIDTH);
    set_up();
    job.settings.height = 0;
    REQUIRE(stereo_check(&stereo, &job) == STEREO_FIELD_HEIGHT);
    set_up();
    stub_ram_bytes = 0;
    REQUIRE(stereo_check(&stereo, &job) == STEREO_FIELD_LEFT);
    use_all();
}

static status_t start_link(void)
{
    mock_clock      = 0;
    mock_clock_step = 10;
    expect_read("version", FRAME_LINK_VERSION);
    expect_read("slots", 1);
    expect_read("max_chunks", 96);
    expect_read("mailbox_entries", 8);
    expect_read("alignment", ALIGNMENT);
    expect_read("port", 0);
    expect_read("streaming", 0);
    if (!is_in_ram((uintptr_t)mailbox, sizeof(mailbox))) {
        return frame_link_init(&link, mailbox);
    }
    expect_write("control", 0);
    expect_write("token", 0);
    expect_write("slot_control", 1u << 9);
    expect_write("send_control", 4);
    expect_read("send_status", 0);
    expect_read("send_status", 0);
    expect_write("stream_control", 2);
    expect_read("stream_status", 0);
    expect_read("slot_status", 0);
    expect_write("mac_high", 0x10e2);
    expect_write("mac_low", 0xd5000002);
    expect_write("netmask", 0xffffff00);
    expect_write("gateway", 0xc0a80101);
    expect_write("address", 0xc0a80132);
    expect_write("mailbox_base", (uint32_t)(uintptr_t)mailbox);
    expect_read("mailbox_produced", 0);
    expect_write("mailbox_consumed", 0);
    expect_call("memory_to_device");
    expect_write("control", 1);
    return frame_link_init(&link, mailbox);
}

static void test_mailbox(void)
{
    const uint64_t first = (uintptr_t)mailbox;

    for (unsigned base = 0; base < 2; base++) {
        for (unsigned missing = 0; missing < 2; missing++) {
            stub_ram_base  = first + base;
            stub_ram_bytes = sizeof(mailbox) - missing;
            REQUIRE(start_link() == (base + missing == 0 ? STATUS_OK : STATUS_BAD_ARGUMENT));
            require_all_done();
        }
    }
    use_all();
}

/* Slots, replies and bursts: a refusal touches no register. Good ones are in test_frame_link.c. */
static void test_link(void)
{
    static const peer_t peer = {.udp = true};
    unsigned            refused = 0;

    use_all();
    REQUIRE(start_link() == STATUS_OK);
    require_all_done();
    for (unsigned round = 0; round < 50000; round++) {
        uint32_t  pixels  = 1 + draw() % (3 * PROTOCOL_CHUNK_SIZE);
        uint32_t  slot    = 2 * ((pixels + PROTOCOL_CHUNK_SIZE - 1) / PROTOCOL_CHUNK_SIZE) * PROTOCOL_CHUNK_SIZE;
        message_t message = {.length = draw() % 3 == 0 ? 0 : 1 + draw() % PROTOCOL_CHUNK_SIZE};
        uint64_t  address;

        use_map(draw() % MAPS);
        address         = draw_address(draw() % 2 == 0 ? slot : message.length);
        message.payload = at(address);
        if (!is_in_ram(address, slot) || address % ALIGNMENT != 0) {
            REQUIRE(frame_link_open_slot(&link, 0, 1, at(address), pixels) == STATUS_BAD_ARGUMENT);
            refused++;
        }
        if (!is_in_ram(address, message.length > 0 ? message.length : 1) || address % ALIGNMENT != 0) {
            REQUIRE(frame_link_reply(&link, &peer, &message) == STATUS_BAD_ARGUMENT);
            REQUIRE(frame_link_send_burst(&link, &peer, &message) == STATUS_BAD_ARGUMENT);
            refused++;
        }
    }
    REQUIRE(refused > 10000);
    use_all();
}

int main(void)
{
    test_rule();
    test_jobs();
    test_empty_jobs();
    test_mailbox();
    test_link();
    return 0;
}
