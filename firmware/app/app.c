/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

#include "app.h"

#include <string.h>

#include "litestereo/firmware_tag.h"
#include "litestereo/platform.h"
#include "litestereo/watchdog.h"

/* Most bytes from the line per poll. */
#define MOST_BYTES 256

static void write_line(void *context, const uint8_t *bytes, size_t length)
{
    serial_send(context, bytes, length);
    /* A long text on a slow line takes longer than the watchdog allows, but each piece of it is bounded. */
    watchdog_feed();
}

static void type_on_console(void *context, const uint8_t *bytes, size_t length)
{
    console_receive(context, bytes, length);
}

static void stop_match(void *context, frame_t *frame)
{
    matcher_stop(context, frame);
}

static void describe(app_t *app)
{
    const stereo_capabilities_t *can = &app->stereo.capabilities;

    app->info = (device_info_t){
        .gateware_version = can->version,
        .firmware_version = (uint16_t)firmware_tag.version,
        .max_width        = can->max_width,
        .max_height       = can->max_height,
        .limits           = can->limits,
        .dma_alignment    = can->dma_alignment,
        .sys_clk_hz       = clock_hz(),
        .name             = platform_name(),
    };
}

/* Starts UDP. If the SoC has none, or one that this firmware does not support, there is still the serial line. */
static void start_udp(app_t *app, app_buffers_t *buffers)
{
    status_t status = frame_link_init(&app->udp, buffers->mailbox);

    if (status == STATUS_OK) {
        app->info.address = app->udp.capabilities.address;
        app->info.port    = app->udp.capabilities.port;
        status            = udp_link_init(&app->udp_link, &app->udp, &app->session, &app->counters, buffers->payload);
    }
    if (status == STATUS_OK) {
        app->matcher.stream = app->udp_link.transfer.stream;
        return;
    }
    if (app->udp.capabilities.version != 0) {
        console_printf(&app->console, "\nThe frame link does not answer as one that this firmware knows: no UDP.\n");
    }
}

/* Reserves memory; null if there is not more than that. */
static uint8_t *reserve(uint8_t **memory, size_t *size, size_t bytes)
{
    uint8_t *reserved = *memory;

    if (*size <= bytes) {
        return NULL;
    }
    *memory += bytes;
    *size   -= bytes;
    return reserved;
}

/* Prepares records and trial, if there is a flash, and reserves memory for an update's image. */
static void prepare_update(app_t *app, uint8_t **memory, size_t *size)
{
    bool     has_records = flash_init(&app->flash, clock_hz()) == STATUS_OK
                        && records_init(&app->records, &app->flash) == STATUS_OK;
    uint8_t *image       = NULL;

    trial_init(&app->trial, has_records ? &app->records : NULL, &app->reset, clock_hz());
    if (has_records && app->flash.images >= 2) {
        image = reserve(memory, size, app->flash.image_bytes);
    }
    if (image != NULL) {
        update_init(&app->update, &app->flash, &app->trial, image);
    }
}

/* Says why the calibration in flash is not used. */
static void report_calibration(app_t *app, status_t status)
{
    if (status == STATUS_ROWS) {
        console_printf(&app->console, "\nThe calibration needs %u rows of the images, the gateware keeps %u: not used.\n",
            app->rectification.rows_needed, app->rectification.rows);
    } else if (status != STATUS_OK && status != STATUS_NO_RECORD) {
        console_printf(&app->console, "\nThe calibration in flash is not used: %s.\n", status_name(status));
    }
}

/* Prepares the rectification, if there is one, reserves memory for calibrations, and uses the one in flash. */
static void prepare_rectification(app_t *app, uint8_t **memory, size_t *size)
{
    uint8_t *reserved = NULL;

    if (rectification_init(&app->rectification, &app->stereo) == STATUS_OK) {
        reserved = reserve(memory, size, CALIBRATE_MEMORY_BYTES);
    }
    if (reserved == NULL) {
        return;
    }
    calibrate_init(&app->calibrate, &app->rectification, app->records.flash != NULL ? &app->records : NULL, reserved);
    app->matcher.rectification = &app->rectification;
    report_calibration(app, calibrate_recall(&app->calibrate));
}

/* Reserves memory for the screen's pictures, if there is a screen and enough memory remains for frames. */
static void prepare_screen(app_t *app, uint8_t **memory, size_t *size)
{
    size_t bytes = screen_bytes();

    if (*size / 2 >= bytes && screen_init(&app->screen, *memory) == STATUS_OK) {
        *memory += bytes;
        *size   -= bytes;
    }
}

static void report_reset(app_t *app)
{
    const reset_report_t *reset = &app->reset;

    if (reset->cause != RESET_POWER_UP) {
        console_printf(&app->console, "\nreset %u since power-up: %s, at 0x%08x, line %u\n", reset->resets,
            reset_cause_name(reset->cause), (unsigned)reset->place, reset->line);
    }
}

status_t app_init(app_t *app, app_buffers_t *buffers)
{
    size_t   size;
    uint8_t *memory = platform_frame_memory(&size);
    status_t status;

    memset(app, 0, sizeof(*app));
    reset_begin(&app->reset);
    app->matcher = (matcher_t){.stereo = &app->stereo, .pool = &app->pool, .counters = &app->counters};
    app->console = (console_t){
        .info     = &app->info,
        .matcher  = &app->matcher,
        .counters = &app->counters,
        .session  = &app->session,
        .trial    = &app->trial,
        .write    = write_line,
        .context  = &app->serial,
    };
    serial_init(&app->serial);
    status = stereo_init(&app->stereo);
    if (status != STATUS_OK) {
        console_printf(&app->console, "\nThe matcher does not answer as one that this firmware knows.\n");
        return status;
    }
    prepare_update(app, &memory, &size);
    prepare_rectification(app, &memory, &size);
    prepare_screen(app, &memory, &size);
    status = frame_pool_init(&app->pool, memory, size, FRAME_POOL_SLOTS);
    if (status != STATUS_OK) {
        console_printf(&app->console, "\n%u bytes of memory are too few for frames.\n", (unsigned)size);
        return status;
    }
    map_view_init(&app->view, &app->screen, &app->pool);
    describe(app);
    session_init(&app->session, &app->info, &app->pool, &app->counters, stop_match, &app->matcher);
    app->session.update    = app->update.flash != NULL ? &app->update : NULL;
    app->session.calibrate = app->calibrate.rectification != NULL ? &app->calibrate : NULL;
    serial_link_init(&app->link, &app->session, &app->counters, clock_hz());
    app->link.write           = write_line;
    app->link.write_context   = &app->serial;
    app->link.console         = type_on_console;
    app->link.console_context = &app->console;
    start_udp(app, buffers);
    report_reset(app);
    console_start(&app->console);
    return STATUS_OK;
}

void app_give_up(void)
{
    uint64_t began = clock_now();

    /* The serial line sends the reason, and a cause that is temporary may pass. */
    while (clock_now() - began < clock_hz()) {
        watchdog_feed();
    }
    reset_now(RESET_START, 0, 0);
}

/* Stops once more a matcher that did not stop; if that fails, only a reset helps. */
static void recover(app_t *app)
{
    if (app->stereo.statistics.stuck != app->stuck) {
        if (stereo_abort(&app->stereo) != STATUS_OK) {
            reset_now(RESET_MATCHER, 0, 0);
        }
        app->stuck = app->stereo.statistics.stuck;
    }
}

void app_poll(app_t *app)
{
    uint8_t  bytes[MOST_BYTES];
    uint64_t clock  = clock_now();
    size_t   length = serial_receive(&app->serial, bytes, sizeof(bytes));

    if (length > 0) {
        serial_link_receive(&app->link, clock, bytes, length);
    } else {
        serial_link_poll(&app->link, clock);
    }
    if (app->session.transfer != NULL) {
        udp_link_poll(&app->udp_link, clock);
    }
    session_poll(&app->session, clock);
    matcher_poll(&app->matcher, clock);
    map_view_poll(&app->view);
    if (app->counters.value[COUNTER_SESSIONS] > 0) {
        trial_confirm(&app->trial);
    }
    trial_poll(&app->trial, clock);
    if (app->session.update != NULL) {
        update_poll(&app->update, clock);
    }
    if (app->session.calibrate != NULL && !(app->session.update != NULL && update_is_running(&app->update))) {
        calibrate_poll(&app->calibrate, clock);
    }
    recover(app);
    if (session_wants_restart(&app->session, clock)) {
        reset_now(RESET_REQUESTED, 0, 0);
    }
    watchdog_feed();
}
