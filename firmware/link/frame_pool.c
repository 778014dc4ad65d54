/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "frame_pool.h"

#include <string.h>

#include "lib/bytes.h"

#define CHUNK PROTOCOL_CHUNK_SIZE

/* States that may follow a state, one bit each. */
static const uint8_t followers[] = {
    [FRAME_EMPTY]    = 1 << FRAME_LOADING,
    [FRAME_LOADING]  = 1 << FRAME_READY | 1 << FRAME_EMPTY,
    [FRAME_READY]    = 1 << FRAME_MATCHING | 1 << FRAME_EMPTY,
    [FRAME_MATCHING] = 1 << FRAME_DONE | 1 << FRAME_FAILED,
    [FRAME_DONE]     = 1 << FRAME_EMPTY,
    [FRAME_FAILED]   = 1 << FRAME_EMPTY,
};

static status_t change_state(frame_t *frame, frame_state_t state)
{
    if ((followers[frame->state] & (1 << state)) == 0) {
        return STATUS_STATE;
    }
    frame->state = state;
    return STATUS_OK;
}

static size_t round_up(size_t value, size_t step)
{
    return (value + step - 1) / step * step;
}

/* Most pixels whose images, in whole chunks, and map fit in `size` bytes, a multiple of the alignment. */
static uint32_t capacity(size_t size)
{
    size_t   chunks = size / (4 * CHUNK) + 1;  /* A pixel takes four bytes, and the last chunk may be partly empty. */
    uint32_t pixels = 0;

    for (; chunks > 0 && pixels == 0; chunks--) {
        size_t rest = size > 2 * chunks * CHUNK ? size - 2 * chunks * CHUNK : 0;
        size_t fit  = rest / 2 < chunks * CHUNK ? rest / 2 : chunks * CHUNK;

        if (fit > (chunks - 1) * CHUNK) {
            pixels = fit < FRAME_MAX_PIXELS ? (uint32_t)fit : FRAME_MAX_PIXELS;
        }
    }
    return pixels;
}

status_t frame_pool_init(frame_pool_t *pool, void *memory, size_t size, unsigned slots)
{
    size_t skew = (FRAME_ALIGNMENT - (uintptr_t)memory % FRAME_ALIGNMENT) % FRAME_ALIGNMENT;
    size_t slot_size;

    if (pool == NULL || memory == NULL || slots == 0 || slots > FRAME_POOL_SLOTS || size < skew) {
        return STATUS_BAD_ARGUMENT;
    }
    slot_size = (size - skew) / slots / FRAME_ALIGNMENT * FRAME_ALIGNMENT;
    memset(pool, 0, sizeof(*pool));
    for (unsigned slot = 0; slot < slots; slot++) {
        pool->frame[slot].slot   = (uint8_t)slot;
        pool->frame[slot].memory = (uint8_t *)memory + skew + slot * slot_size;
    }
    pool->slots      = (uint8_t)slots;
    pool->slot_bytes = slot_size < UINT32_MAX ? (uint32_t)slot_size : UINT32_MAX;
    pool->max_pixels = capacity(slot_size);
    return pool->max_pixels > 0 ? STATUS_OK : STATUS_SIZE;
}

status_t frame_pool_open(frame_pool_t *pool, frame_owner_t owner, uint32_t id, const stereo_settings_t *settings,
    frame_t **frame)
{
    uint32_t pixels = (uint32_t)settings->width * settings->height;

    if (owner == FRAME_OWNER_NONE || frame_pool_find(pool, owner, id) != NULL) {
        return STATUS_BAD_ARGUMENT;
    }
    if (pixels == 0 || pixels > pool->max_pixels) {
        return STATUS_SIZE;
    }
    for (unsigned slot = 0; slot < pool->slots; slot++) {
        frame_t *free = &pool->frame[slot];

        if (change_state(free, FRAME_LOADING) == STATUS_OK) {
            free->owner    = owner;
            free->id       = id;
            free->settings = *settings;
            free->pitch    = (uint32_t)round_up(pixels, CHUNK);
            free->missing  = frame_chunks(free);
            free->options  = 0;
            free->streamed = false;
            free->result   = (frame_result_t){0};
            memset(free->received, 0, sizeof(free->received));
            *frame = free;
            return STATUS_OK;
        }
    }
    return STATUS_NO_SLOT;
}

status_t frame_set_options(const frame_pool_t *pool, frame_t *frame, uint8_t options)
{
    if ((options & (OPTION_LEFT | OPTION_RIGHT)) != 0 && 6 * (uint64_t)frame->pitch > pool->slot_bytes) {
        return STATUS_SIZE;
    }
    frame->options = options;
    return STATUS_OK;
}

/* Whether a range is within `bytes` bytes from `first` on. */
static bool is_within(uint32_t offset, uint32_t length, uint32_t first, uint32_t bytes)
{
    return offset >= first && offset - first < bytes && length <= bytes - (offset - first);
}

bool frame_has(const frame_t *frame, uint32_t offset, uint32_t length)
{
    uint32_t pixels = frame_pixels(frame);

    return is_within(offset, length, 0, frame_map_size(frame))
        || (frame_left_out(frame) != NULL && is_within(offset, length, 2 * frame->pitch, pixels))
        || (frame_right_out(frame) != NULL && is_within(offset, length, 3 * frame->pitch, pixels));
}

frame_t *frame_pool_find(frame_pool_t *pool, frame_owner_t owner, uint32_t id)
{
    for (unsigned slot = 0; slot < pool->slots; slot++) {
        frame_t *frame = &pool->frame[slot];

        if (frame->state != FRAME_EMPTY && frame->owner == owner && frame->id == id) {
            return frame;
        }
    }
    return NULL;
}

frame_t *frame_pool_next(frame_pool_t *pool)
{
    frame_t *next = NULL;

    for (unsigned slot = 0; slot < pool->slots; slot++) {
        frame_t *frame = &pool->frame[slot];

        /* A signed difference orders them even after the count has wrapped around. */
        if (frame->state == FRAME_READY && (next == NULL || (int32_t)(frame->order - next->order) < 0)) {
            next = frame;
        }
    }
    return next;
}

frame_t *frame_pool_matching(frame_pool_t *pool)
{
    for (unsigned slot = 0; slot < pool->slots; slot++) {
        if (pool->frame[slot].state == FRAME_MATCHING) {
            return &pool->frame[slot];
        }
    }
    return NULL;
}

uint32_t frame_chunk_length(const frame_t *frame, uint32_t offset)
{
    uint32_t pixels = frame_pixels(frame);

    if (offset % CHUNK != 0) {
        return 0;
    }
    if (offset >= frame->pitch) {
        offset -= frame->pitch;
    }
    if (offset >= pixels) {
        return 0;
    }
    return pixels - offset < CHUNK ? pixels - offset : CHUNK;
}

status_t frame_write(frame_t *frame, uint32_t offset, const uint8_t *chunk, uint32_t length, bool *repeated)
{
    uint32_t  index = offset / CHUNK;
    uint32_t  bit   = 1u << index % 32;
    uint32_t *word;

    if (frame->state != FRAME_LOADING) {
        return STATUS_STATE;
    }
    if (frame_chunk_length(frame, offset) == 0) {
        return STATUS_OFFSET;
    }
    if (length != frame_chunk_length(frame, offset)) {
        return STATUS_LENGTH;
    }
    copy_bytes(frame->memory + offset, chunk, length);
    word      = &frame->received[index / 32];
    *repeated = (*word & bit) != 0;
    if (!*repeated) {
        *word |= bit;
        frame->missing--;
    }
    return STATUS_OK;
}

void frame_mark_received(frame_t *frame, uint32_t word, uint32_t arrived)
{
    uint32_t chunks = frame_chunks(frame);

    if (frame->state != FRAME_LOADING || word >= (chunks + 31) / 32) {
        return;
    }
    if (word == chunks / 32) {
        arrived &= (1u << chunks % 32) - 1;
    }
    arrived &= ~frame->received[word];
    frame->received[word] |= arrived;
    for (; arrived != 0; arrived &= arrived - 1) {
        frame->missing--;
    }
}

status_t frame_fill(frame_t *frame)
{
    if (frame->state != FRAME_LOADING) {
        return STATUS_STATE;
    }
    memset(frame->received, 0xff, sizeof(frame->received));
    frame->missing = 0;
    return STATUS_OK;
}

uint32_t frame_first_missing(const frame_t *frame)
{
    for (uint32_t index = 0; index < frame_chunks(frame); index++) {
        if ((frame->received[index / 32] & (1u << index % 32)) == 0) {
            return index * CHUNK;
        }
    }
    return PROTOCOL_NO_OFFSET;
}

status_t frame_pool_start(frame_pool_t *pool, frame_t *frame)
{
    if (frame->state == FRAME_LOADING && frame->missing != 0) {
        return STATUS_INCOMPLETE;
    }
    if (change_state(frame, FRAME_READY) != STATUS_OK) {
        return STATUS_STATE;
    }
    frame->order = pool->next_order++;
    return STATUS_OK;
}

status_t frame_pool_stream(frame_pool_t *pool, frame_t *frame, uint32_t sequence)
{
    /* The chunks never come to memory, so none is missing there. */
    status_t status = frame_fill(frame);

    if (status != STATUS_OK) {
        return status;
    }
    frame->streamed = true;
    frame->sequence = sequence;
    return frame_pool_start(pool, frame);
}

status_t frame_pool_begin(frame_pool_t *pool, frame_t *frame)
{
    if (frame_pool_matching(pool) != NULL) {
        return STATUS_BUSY;
    }
    return change_state(frame, FRAME_MATCHING);
}

status_t frame_finish(frame_t *frame, const frame_result_t *result)
{
    status_t status = change_state(frame, result->error == ERROR_NONE ? FRAME_DONE : FRAME_FAILED);

    if (status == STATUS_OK) {
        frame->result = *result;
    }
    return status;
}

status_t frame_release(frame_t *frame)
{
    status_t status = change_state(frame, FRAME_EMPTY);

    if (status == STATUS_OK) {
        frame->owner = FRAME_OWNER_NONE;
    }
    return status;
}
