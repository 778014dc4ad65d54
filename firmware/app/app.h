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
#include "link/update/update.h"
#include "litestereo/flash.h"
#include "litestereo/reset.h"
#include "litestereo/serial.h"
#include "map_view.h"
#include "matcher.h"

/** The whole firmware: drivers, frames, session, link and console, and how they hang together. */
typedef struct {
    reset_report_t reset;    /**< Why the SoC began anew. */
    stereo_t      stereo;    /**< The accelerator. */
    uint32_t      stuck;     /**< Times that it did not stop, as of the last look. */
    serial_t      serial;    /**< The line. */
    flash_t       flash;     /**< Images of the firmware. */
    update_t      update;    /**< Another firmware on its way there. */
    frame_pool_t  pool;      /**< Frames. */
    counters_t    counters;  /**< What is counted. */
    matcher_t     matcher;   /**< From the pool to the accelerator. */
    screen_t      screen;    /**< What people see. */
    map_view_t    view;      /**< From the pool to the screen. */
    device_info_t info;      /**< What the device tells of itself. */
    session_t     session;   /**< The protocol. */
    serial_link_t link;      /**< The protocol on the line. */
    console_t     console;   /**< People on the line. */
    frame_link_t  udp;       /**< The gateware between UDP and memory. */
    udp_link_t    udp_link;  /**< The protocol over UDP. */
    _Alignas(FRAME_ALIGNMENT) uint8_t mailbox[FRAME_LINK_MAILBOX_SIZE];  /**< Messages that came over UDP. */
} app_t;

/** Brings everything up and greets; says on the line what is wrong if something is. */
status_t app_init(app_t *app);

/** One turn of the main loop. */
void app_poll(app_t *app);

#endif
