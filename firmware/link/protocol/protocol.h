/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* Numbers of the link protocol; docs/protocol.md says what they mean, and a test compares the two. */

#ifndef LITESTEREO_LINK_PROTOCOL_PROTOCOL_H
#define LITESTEREO_LINK_PROTOCOL_PROTOCOL_H

#include "link/protocol/parameters.h"

#define PROTOCOL_MAGIC       0x534cu
#define PROTOCOL_VERSION     1u
#define PROTOCOL_CHUNK_SIZE  1024u
#define PROTOCOL_HEADER_SIZE 24u
#define PROTOCOL_CRC_SIZE    4u
#define PROTOCOL_MESSAGE_MIN (PROTOCOL_HEADER_SIZE + PROTOCOL_CRC_SIZE)
#define PROTOCOL_MESSAGE_MAX (PROTOCOL_MESSAGE_MIN + PROTOCOL_CHUNK_SIZE)
#define PROTOCOL_REPLY_BIT   0x80u
#define PROTOCOL_NO_OFFSET   0xffffffffu
#define PROTOCOL_UDP_PORT    19539u

/* READs over UDP that a device queues, including the one that it serves. */
#define PROTOCOL_QUEUED_READS 8u

/* Seconds of silence after which another host may take over a session. */
#define PROTOCOL_SILENCE_S 5u

/* Seconds that a streamed frame waits for its next pairs before it fails. */
#define PROTOCOL_PAIRS_S 5u

#define PROTOCOL_CAPABILITIES_SIZE 52u
#define PROTOCOL_CAPABILITY_SIZE   8u
#define PROTOCOL_NAME_OFFSET       36u
#define PROTOCOL_NAME_SIZE         16u
#define PROTOCOL_STATUS_SIZE       16u
#define PROTOCOL_STATUS_MORE       8u
#define PROTOCOL_CALIBRATION_SIZE  24u
#define PROTOCOL_PROGRESS_SIZE     16u
#define PROTOCOL_ERROR_SIZE        8u
#define PROTOCOL_PARAMETER_SIZE    8u

/** Offset of each field of the header, in bytes. */
enum protocol_header {
    HEADER_MAGIC     = 0,
    HEADER_VERSION   = 2,
    HEADER_TYPE      = 3,
    HEADER_SESSION   = 4,
    HEADER_SEQUENCE  = 8,
    HEADER_FRAME_ID  = 12,
    HEADER_OFFSET    = 16,
    HEADER_LENGTH    = 20,
};

/** Types of requests; a reply has PROTOCOL_REPLY_BIT set as well. */
enum protocol_type {
    TYPE_HELLO       = 0x01,
    TYPE_CONFIGURE   = 0x02,
    TYPE_OPEN        = 0x03,
    TYPE_UPLOAD      = 0x04,
    TYPE_START       = 0x05,
    TYPE_STATUS      = 0x06,
    TYPE_READ        = 0x07,
    TYPE_RELEASE     = 0x08,
    TYPE_STATISTICS  = 0x09,
    TYPE_BYE         = 0x0a,
    TYPE_MISSING     = 0x0b,
    TYPE_STREAM      = 0x0c,
    TYPE_PAIRS       = 0x0d,
    TYPE_UPDATE      = 0x0e,
    TYPE_IMAGE       = 0x0f,
    TYPE_WRITE       = 0x10,
    TYPE_PROGRESS    = 0x11,
    TYPE_RESTART     = 0x12,
    TYPE_CALIBRATE   = 0x13,
    TYPE_RECORD      = 0x14,
    TYPE_ADOPT       = 0x15,
    TYPE_CALIBRATION = 0x16,
    TYPE_RECALL      = 0x17,
    TYPE_FORGET      = 0x18,
    TYPE_ERROR       = 0xff,
};

/** Codes of an ERROR reply. */
enum protocol_error {
    ERROR_NONE        = 0,
    ERROR_VERSION     = 1,
    ERROR_TYPE        = 2,
    ERROR_SESSION     = 3,
    ERROR_LENGTH      = 4,
    ERROR_PARAMETER   = 5,
    ERROR_RANGE       = 6,
    ERROR_NO_SLOT     = 7,
    ERROR_FRAME       = 8,
    ERROR_STATE       = 9,
    ERROR_OFFSET      = 10,
    ERROR_INCOMPLETE  = 11,
    ERROR_SIZE        = 12,
    ERROR_MATCHER     = 13,
    ERROR_TIMEOUT     = 14,
    ERROR_DUPLICATE   = 15,
    ERROR_FEATURE     = 16,
    ERROR_BUSY        = 17,
    ERROR_CALIBRATION = 18,
    ERROR_FLASH       = 19,
};

/** Options of OPEN and STREAM; bits. */
enum protocol_option {
    OPTION_RECTIFIED = 1,
    OPTION_LEFT      = 2,
    OPTION_RIGHT     = 4,
    OPTIONS_ALL      = 7,
};

/** Flags of a frame's status; bits. */
enum protocol_flag {
    FLAG_RECTIFIED = 1,
    FLAG_ROW_GONE  = 2,
    FLAG_FOLDED    = 4,
};

/** Details of ERROR_SIZE. */
enum protocol_size {
    SIZE_TOO_WIDE   = 1,
    SIZE_TOO_HIGH   = 2,
    SIZE_TOO_LARGE  = 3,
    SIZE_TOO_NARROW = 4,
    SIZE_TOO_LOW    = 5,
    SIZE_TOO_LONG   = 6,
};

#endif
