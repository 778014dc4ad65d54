/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The pool of frames: any sequence of operations, against a model with a list of rules for each frame's state. */

#include <stdbool.h>
#include <string.h>

#include "fuzz.h"
#include "link/frame_pool.h"

#define SLOTS      3
#define SLOT_SIZE  12288u
#define CHUNKS_MAX 8u

/* The model of a slot. */
typedef struct {
    frame_state_t state;
    frame_owner_t owner;
    uint32_t      id, pixels, chunks;
    bool          has[CHUNKS_MAX];
    uint8_t       filled[CHUNKS_MAX];  /* The byte that fills each chunk. */
    unsigned      place;               /* In the queue. */
} slot_t;

static _Alignas(FRAME_ALIGNMENT) uint8_t memory[SLOTS * SLOT_SIZE];

static frame_pool_t pool;
static slot_t       slots[SLOTS];
static unsigned     places;

static uint32_t missing_of(const slot_t *slot)
{
    uint32_t missing = 0;

    for (uint32_t chunk = 0; chunk < slot->chunks; chunk++) {
        missing += !slot->has[chunk];
    }
    return missing;
}

static uint32_t length_of(const slot_t *slot, uint32_t chunk)
{
    uint32_t begin = chunk % (slot->chunks / 2) * PROTOCOL_CHUNK_SIZE;

    return slot->pixels - begin < PROTOCOL_CHUNK_SIZE ? slot->pixels - begin : PROTOCOL_CHUNK_SIZE;
}

static void open_frame(input_t *input)
{
    frame_owner_t     owner    = take(input) % 3;
    uint32_t          id       = take(input) % 4;
    stereo_settings_t settings = {.width = take(input), .height = take(input) % 32};
    uint32_t          pixels   = (uint32_t)settings.width * settings.height;
    status_t          wanted   = STATUS_NO_SLOT;
    unsigned          free     = 0;
    frame_t          *frame    = NULL;

    while (free < SLOTS && slots[free].state != FRAME_EMPTY) {
        free++;
    }
    if (free < SLOTS) {
        wanted = STATUS_OK;
    }
    if (pixels == 0 || pixels > pool.max_pixels) {
        wanted = STATUS_SIZE;
    }
    for (unsigned i = 0; i < SLOTS; i++) {
        if (slots[i].state != FRAME_EMPTY && slots[i].owner == owner && slots[i].id == id) {
            wanted = STATUS_BAD_ARGUMENT;
        }
    }
    if (owner == FRAME_OWNER_NONE) {
        wanted = STATUS_BAD_ARGUMENT;
    }
    HOLDS(frame_pool_open(&pool, owner, id, &settings, &frame) == wanted);
    if (wanted == STATUS_OK) {
        HOLDS(frame == &pool.frame[free]);
        slots[free] = (slot_t){.state = FRAME_LOADING, .owner = owner, .id = id, .pixels = pixels,
            .chunks = 2 * ((pixels + PROTOCOL_CHUNK_SIZE - 1) / PROTOCOL_CHUNK_SIZE)};
        HOLDS(slots[free].chunks <= CHUNKS_MAX && frame_chunks(frame) == slots[free].chunks);
    }
}

static void write_chunk(input_t *input, frame_t *frame, slot_t *slot)
{
    uint32_t chunk    = take(input) % 10;
    uint32_t offset   = chunk * PROTOCOL_CHUNK_SIZE + take(input) / 250;
    bool     fits     = slot->state == FRAME_LOADING && chunk < slot->chunks && offset % PROTOCOL_CHUNK_SIZE == 0;
    uint32_t length   = (fits ? length_of(slot, chunk) : 1) + take(input) / 250;
    bool     right    = fits && length == length_of(slot, chunk);
    bool     repeated = false;
    uint8_t *bytes    = malloc(length);
    uint8_t  with     = take(input);
    status_t wanted   = slot->state != FRAME_LOADING ? STATUS_STATE
        : right ? STATUS_OK : fits ? STATUS_LENGTH : STATUS_OFFSET;

    memset(bytes, with, length);
    HOLDS(frame_write(frame, offset, bytes, length, &repeated) == wanted);
    free(bytes);
    if (right) {
        HOLDS(repeated == slot->has[chunk]);
        slot->has[chunk]    = true;
        slot->filled[chunk] = with;
    }
#ifdef PLANTED_FAULT
    /* The planted fault: a repeated chunk counts again. */
    frame->missing -= right && repeated;
#endif
}

static void note(input_t *input, frame_t *frame, slot_t *slot)
{
    uint32_t arrived = take(input);
    uint32_t word    = take(input) / 250;

    frame_mark_received(frame, word, arrived);
    for (uint32_t chunk = 0; chunk < slot->chunks && slot->state == FRAME_LOADING && word == 0; chunk++) {
        if ((arrived >> chunk & 1) != 0 && !slot->has[chunk]) {
            slot->has[chunk]    = true;
            slot->filled[chunk] = frame->memory[chunk * PROTOCOL_CHUNK_SIZE];
            memset(frame->memory + chunk * PROTOCOL_CHUNK_SIZE, slot->filled[chunk], length_of(slot, chunk));
        }
    }
}

/* Changes the state, if the current one allows it. */
static void move(slot_t *slot, status_t status, frame_state_t from, frame_state_t to)
{
    HOLDS(status == (slot->state == from ? STATUS_OK : STATUS_STATE));
    if (slot->state == from) {
        slot->state = to;
    }
}

static bool is_matching(void)
{
    bool matching = false;

    for (unsigned i = 0; i < SLOTS; i++) {
        matching |= slots[i].state == FRAME_MATCHING;
    }
    return matching;
}

static void start(frame_t *frame, slot_t *slot)
{
    if (slot->state == FRAME_LOADING && missing_of(slot) > 0) {
        HOLDS(frame_pool_start(&pool, frame) == STATUS_INCOMPLETE);
        return;
    }
    slot->place = slot->state == FRAME_LOADING ? ++places : slot->place;
    move(slot, frame_pool_start(&pool, frame), FRAME_LOADING, FRAME_READY);
}

static void fill(input_t *input, frame_t *frame, slot_t *slot)
{
    bool loading = slot->state == FRAME_LOADING;

    if (take(input) % 2 == 0) {
        HOLDS(frame_fill(frame) == (loading ? STATUS_OK : STATUS_STATE));
    } else {
        move(slot, frame_pool_stream(&pool, frame, 5), FRAME_LOADING, FRAME_READY);
        slot->place = loading ? ++places : slot->place;
        HOLDS(!loading || (frame->streamed && frame->sequence == 5));
    }
    for (uint32_t chunk = 0; chunk < slot->chunks && loading; chunk++) {
        slot->has[chunk]    = true;
        slot->filled[chunk] = frame->memory[chunk * PROTOCOL_CHUNK_SIZE];
        memset(frame->memory + chunk * PROTOCOL_CHUNK_SIZE, slot->filled[chunk], length_of(slot, chunk));
    }
}

static void release(frame_t *frame, slot_t *slot)
{
    bool may = slot->state != FRAME_EMPTY && slot->state != FRAME_MATCHING;

    HOLDS(frame_release(frame) == (may ? STATUS_OK : STATUS_STATE));
    if (may) {
        *slot = (slot_t){0};
    }
}

static void finish(input_t *input, frame_t *frame, slot_t *slot)
{
    frame_result_t result = {.error = take(input) % 2 != 0 ? ERROR_MATCHER : ERROR_NONE, .clocks = 9};

    move(slot, frame_finish(frame, &result), FRAME_MATCHING, result.error == ERROR_NONE ? FRAME_DONE : FRAME_FAILED);
    HOLDS(slot->state < FRAME_DONE || frame->result.clocks == 9);
}

static void check_slot(const frame_t *frame, const slot_t *slot)
{
    HOLDS(frame->state == slot->state && frame->owner == slot->owner);
    if (slot->state == FRAME_EMPTY) {
        return;
    }
    HOLDS(frame_pool_find(&pool, slot->owner, slot->id) == frame && frame->missing == missing_of(slot));
    for (uint32_t chunk = 0; chunk < slot->chunks; chunk++) {
        const uint8_t *bytes = frame->memory + chunk * PROTOCOL_CHUNK_SIZE;

        HOLDS(!slot->has[chunk] || (bytes[0] == slot->filled[chunk]
            && bytes[length_of(slot, chunk) - 1] == slot->filled[chunk]));
    }
    HOLDS(frame_map(frame) + frame_map_size(frame) <= frame->memory + SLOT_SIZE);
}

static void check(void)
{
    const slot_t *next = NULL;

    for (unsigned i = 0; i < SLOTS; i++) {
        check_slot(&pool.frame[i], &slots[i]);
        if (slots[i].state == FRAME_READY && (next == NULL || slots[i].place < next->place)) {
            next = &slots[i];
        }
    }
    HOLDS(frame_pool_next(&pool) == (next != NULL ? &pool.frame[next - slots] : NULL));
    HOLDS((frame_pool_matching(&pool) != NULL) == is_matching());
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    input_t input = {data, size};

    memset(memory, 0, sizeof(memory));
    memset(slots, 0, sizeof(slots));
    places = 0;
    HOLDS(frame_pool_init(&pool, memory, sizeof(memory), SLOTS) == STATUS_OK);
    /* The queue's count may wrap around in between. */
    pool.next_order = UINT32_MAX - take(&input);
    while (input.length > 0) {
        uint8_t  what  = take(&input);
        frame_t *frame = &pool.frame[what / 16 % SLOTS];
        slot_t  *slot  = &slots[what / 16 % SLOTS];

        switch (what % 8) {
        case 0:  open_frame(&input); break;
        case 1:  note(&input, frame, slot); break;
        case 2:  fill(&input, frame, slot); break;
        case 3:  start(frame, slot); break;
        case 4:
            if (is_matching()) {
                HOLDS(frame_pool_begin(&pool, frame) == STATUS_BUSY);
            } else {
                move(slot, frame_pool_begin(&pool, frame), FRAME_READY, FRAME_MATCHING);
            }
            break;
        case 5:  finish(&input, frame, slot); break;
        case 6:  release(frame, slot); break;
        default: write_chunk(&input, frame, slot); break;
        }
        check();
    }
    return 0;
}
