/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Slots of memory for frames, and the state of the frame in each. Knows neither hardware nor link.
 *
 *   EMPTY -> LOADING -> READY -> MATCHING -> DONE | FAILED -> EMPTY
 *
 * A release leads from any state but MATCHING to EMPTY; a match has to be stopped first. The memory of a slot holds
 * left image, right image and map at 0, pitch and 2 x pitch, where pitch is width x height rounded up to whole chunks.
 * If the frame asks for the images that the matcher gets, they are at 4 x pitch and 5 x pitch. A streamed frame is READY
 * at once, and its images are not in memory.
 */

#ifndef LITESTEREO_LINK_FRAME_POOL_H
#define LITESTEREO_LINK_FRAME_POOL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "link/protocol/protocol.h"
#include "litestereo/status.h"
#include "litestereo/stereo_settings.h"

/** Most slots of a pool. */
#ifndef FRAME_POOL_SLOTS
#define FRAME_POOL_SLOTS 4
#endif

/** Most pixels of a frame, regardless of memory: it bounds the array of received chunks. */
#define FRAME_MAX_PIXELS (4096u * 1024u)

/** Alignment of slots and maps in bytes; no DMA needs more. */
#define FRAME_ALIGNMENT 64u

/** States of a frame, as the link protocol numbers them. */
typedef enum {
    FRAME_EMPTY    = 0,  /**< Free. */
    FRAME_LOADING  = 1,  /**< The owner fills the images. */
    FRAME_READY    = 2,  /**< Complete, queued for the matcher. */
    FRAME_MATCHING = 3,  /**< The matcher reads the images and writes the map. */
    FRAME_DONE     = 4,  /**< The map is valid. */
    FRAME_FAILED   = 5,  /**< The match failed; there is no map. */
} frame_state_t;

/** Owner of a frame, who opened it and may release it. */
typedef enum {
    FRAME_OWNER_NONE,     /**< None: the slot is empty. */
    FRAME_OWNER_LINK,     /**< The host, over the link. */
    FRAME_OWNER_CONSOLE,  /**< A command of the console. */
} frame_owner_t;

/** Result of a match. */
typedef struct {
    uint16_t error;             /**< enum protocol_error: ERROR_NONE, ERROR_MATCHER or ERROR_TIMEOUT. */
    uint32_t detail;            /**< The accelerator's error code, or the clocks waited. */
    uint32_t clocks;            /**< Clocks from start to the map's last write; 0 if it failed. */
    uint32_t first_row_clocks;  /**< Clocks from start to the end of the first row with disparities; 0 if it failed. */
    uint16_t flags;             /**< enum protocol_flag. */
    uint32_t grid_crc;          /**< Of the calibration by which it was rectified, else 0. */
} frame_result_t;

/** A slot and the frame in it. */
typedef struct {
    frame_state_t    state;     /**< Changed by the functions below only. */
    frame_owner_t    owner;     /**< Owner of the frame. */
    uint8_t          slot;      /**< Number of the slot, 0 to FRAME_POOL_SLOTS - 1. */
    uint8_t         *memory;    /**< First byte of the slot. */
    uint32_t         id;        /**< The owner's number of the frame. */
    stereo_settings_t settings; /**< Settings when the frame was opened. */
    uint32_t         pitch;     /**< Bytes from one image to the next. */
    uint32_t         missing;   /**< Chunks still missing. */
    uint32_t         order;     /**< Position in the queue for the matcher, modulo 2**32. */
    uint8_t          options;   /**< enum protocol_option. */
    bool             streamed;  /**< Its pixels are never in memory: they arrive while it is matched. */
    uint32_t         sequence;  /**< Of a streamed frame: sequence of the parts of its map sent without READ. */
    frame_result_t   result;    /**< Valid once DONE or FAILED. */
    uint32_t         received[2 * FRAME_MAX_PIXELS / PROTOCOL_CHUNK_SIZE / 32];  /**< One bit per chunk. */
} frame_t;

/** The pool. */
typedef struct {
    frame_t  frame[FRAME_POOL_SLOTS];  /**< The first `slots` are in use. */
    uint8_t  slots;                    /**< Number of slots, 1 to FRAME_POOL_SLOTS. */
    uint32_t max_pixels;               /**< Most pixels of a frame. */
    uint32_t slot_bytes;               /**< Bytes of a slot. */
    uint32_t next_order;               /**< Position of the next frame that is queued. */
} frame_pool_t;

/** Splits `size` bytes at `memory` evenly into `slots` slots; STATUS_SIZE if they are too small for any frame. */
status_t frame_pool_init(frame_pool_t *pool, void *memory, size_t size, unsigned slots);

/** Opens a frame in a free slot; it is LOADING then. Else STATUS_BAD_ARGUMENT, STATUS_SIZE or STATUS_NO_SLOT. */
status_t frame_pool_open(frame_pool_t *pool, frame_owner_t owner, uint32_t id, const stereo_settings_t *settings,
    frame_t **frame);

/** Has the frame rectified, or its images written, as its options say; it is LOADING. STATUS_SIZE if its slot is too small
 * for the images. */
status_t frame_set_options(const frame_pool_t *pool, frame_t *frame, uint8_t options);

/** Frame of that owner and id, in any state but EMPTY; null if there is none. */
frame_t *frame_pool_find(frame_pool_t *pool, frame_owner_t owner, uint32_t id);

/** Frame that has been READY longest; null if none is. */
frame_t *frame_pool_next(frame_pool_t *pool);

/** Frame that is MATCHING; null if none is. */
frame_t *frame_pool_matching(frame_pool_t *pool);

/** Length in bytes of the chunk that begins at `offset` of the upload space; 0 if none does. */
uint32_t frame_chunk_length(const frame_t *frame, uint32_t offset);

/** Stores a chunk of a LOADING frame; `repeated` tells whether it was received before. */
status_t frame_write(frame_t *frame, uint32_t offset, const uint8_t *chunk, uint32_t length, bool *repeated);

/** Chunks of a frame's upload space, both images. */
static inline uint32_t frame_chunks(const frame_t *frame)
{
    return 2 * frame->pitch / PROTOCOL_CHUNK_SIZE;
}

/** Marks chunks of a LOADING frame that gateware has received: bit i of `arrived` is chunk 32 x `word` + i.
 *
 * Marks are never removed. Bits of chunks that the frame does not have are ignored.
 */
void frame_mark_received(frame_t *frame, uint32_t word, uint32_t arrived);

/** Marks all chunks as received, for an owner that wrote both images in place. */
status_t frame_fill(frame_t *frame);

/** LOADING -> READY, at the end of the queue, of a frame that is streamed; see frame_stream.h. */
status_t frame_pool_stream(frame_pool_t *pool, frame_t *frame, uint32_t sequence);

/** Offset of the first missing chunk, or PROTOCOL_NO_OFFSET. */
uint32_t frame_first_missing(const frame_t *frame);

/** LOADING -> READY, at the end of the queue; STATUS_INCOMPLETE if chunks are missing. */
status_t frame_pool_start(frame_pool_t *pool, frame_t *frame);

/** READY -> MATCHING; STATUS_BUSY if another frame is MATCHING. */
status_t frame_pool_begin(frame_pool_t *pool, frame_t *frame);

/** MATCHING -> DONE, or FAILED if the result has an error. */
status_t frame_finish(frame_t *frame, const frame_result_t *result);

/** Any state but MATCHING -> EMPTY. */
status_t frame_release(frame_t *frame);

/** Left image, width x height bytes. */
static inline uint8_t *frame_left(const frame_t *frame)
{
    return frame->memory;
}

/** Right image, width x height bytes. */
static inline uint8_t *frame_right(const frame_t *frame)
{
    return frame->memory + frame->pitch;
}

/** Disparity map, width x height int16, in sixteenths of a pixel. */
static inline uint8_t *frame_map(const frame_t *frame)
{
    return frame->memory + 2 * frame->pitch;
}

/** Left image as the matcher got it, width x height bytes; null if the frame did not ask for it. */
static inline uint8_t *frame_left_out(const frame_t *frame)
{
    return (frame->options & OPTION_LEFT) != 0 ? frame->memory + 4 * frame->pitch : NULL;
}

/** Right image as the matcher got it. */
static inline uint8_t *frame_right_out(const frame_t *frame)
{
    return (frame->options & OPTION_RIGHT) != 0 ? frame->memory + 5 * frame->pitch : NULL;
}

/** Whether bytes of the download space, which begins with the map, are those of the map or of an image. */
bool frame_has(const frame_t *frame, uint32_t offset, uint32_t length);

/** Pixels of the frame. */
static inline uint32_t frame_pixels(const frame_t *frame)
{
    return (uint32_t)frame->settings.width * frame->settings.height;
}

/** Bytes of the disparity map. */
static inline uint32_t frame_map_size(const frame_t *frame)
{
    return 2 * frame_pixels(frame);
}

#endif
