/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#ifndef LITESTEREO_APP_APP_H
#define LITESTEREO_APP_APP_H

#include "console.h"
#include "drivers/frame_link.h"
#include "link/serial_link.h"
#include "link/udp/udp_link.h"
#include "link/update/calibrate.h"
#include "link/update/update.h"
#include "litestereo/flash.h"
#include "litestereo/records.h"
#include "litestereo/rectification.h"
#include "litestereo/reset.h"
#include "litestereo/serial.h"
#include "litestereo/trial.h"
#include "map_view.h"
#include "matcher.h"

/** The whole firmware: drivers, frames, session, link and console, and their connections. */
typedef struct {
    reset_report_t reset;    /**< Report of the last reset. */
    stereo_t      stereo;    /**< The accelerator. */
    uint32_t      stuck;     /**< statistics.stuck at the last poll. */
    serial_t      serial;    /**< The serial line. */
    flash_t       flash;     /**< Images of the firmware, and records. */
    records_t     records;   /**< Records in flash. */
    trial_t       trial;     /**< Trial of the newest firmware. */
    update_t      update;    /**< Update of the firmware. */
    rectification_t rectification;  /**< The rectification before the accelerator. */
    calibrate_t   calibrate; /**< Its calibration. */
    frame_pool_t  pool;      /**< Frames. */
    counters_t    counters;  /**< All counters. */
    matcher_t     matcher;   /**< Passes frames from the pool to the accelerator. */
    screen_t      screen;    /**< The screen. */
    map_view_t    view;      /**< Shows maps from the pool on the screen. */
    device_info_t info;      /**< The device's description of itself. */
    session_t     session;   /**< The protocol. */
    serial_link_t link;      /**< The protocol on the serial line. */
    console_t     console;   /**< Commands on the serial line. */
    frame_link_t  udp;       /**< Driver of the frame link. */
    udp_link_t    udp_link;  /**< The protocol over UDP. */
} app_t;

/** Memory that gateware reads and writes: it must be in main RAM. */
typedef struct {
    _Alignas(FRAME_ALIGNMENT) uint8_t mailbox[FRAME_LINK_MAILBOX_SIZE];  /**< Received UDP messages. */
    _Alignas(FRAME_ALIGNMENT) uint8_t payload[PROTOCOL_CHUNK_SIZE];      /**< Payload of a reply over UDP. */
} app_buffers_t;

/** Initialises everything and prints a greeting; if that fails, prints why. */
status_t app_init(app_t *app, app_buffers_t *buffers);

/** Resets the SoC after a second: for a program that could not be initialised. */
void app_give_up(void);

/** One round of the main loop. */
void app_poll(app_t *app);

#endif
