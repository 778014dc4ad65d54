/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* A pair of equal image sensors, set up together so that they run in lockstep: both have one reset and one master
 * clock, and get each write at the same time.
 *
 *   sensor_defaults(&sensor_mt9v034, 640, 480, &settings);
 *   sensor_set_rate(&sensor_mt9v034, &settings, master_hz, 30000);
 *   sensors_init(&sensors, &bus, &sensor_mt9v034);
 *   sensors_begin(&sensors, &settings, clock_now());
 *
 * Then sensors_poll in the main loop. No setting is changed silently: what a sensor cannot do is refused. */

#ifndef LITESTEREO_SENSOR_H
#define LITESTEREO_SENSOR_H

#include <stdbool.h>
#include <stdint.h>

#include "litestereo/exposure.h"
#include "litestereo/sensor_bus.h"
#include "litestereo/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/** A kind of sensor: its registers and their limits. */
typedef struct sensor_model sensor_model_t;

/** MT9V034, monochrome, global shutter: any window of 752 x 480. */
extern const sensor_model_t sensor_mt9v034;

/** OV7670, rolling shutter: 640 x 480, 320 x 240 and 160 x 120. */
extern const sensor_model_t sensor_ov7670;

/** AR0134, monochrome, global shutter: any window of 1280 x 960, with 2 x 2 binning at most. */
extern const sensor_model_t sensor_ar0134;

/** How a sensor uses the signals of its parallel port, as the gateware's `DVPFormat` has it. */
typedef struct {
    bool two_bytes;   /**< A pixel is two bytes; otherwise one. */
    bool grey_second; /**< The second byte of a pixel is its grey value; otherwise the first. */
    bool href_low;    /**< HREF is low during the bytes of a row. */
    bool vsync_low;   /**< VSYNC is low during a frame. */
} sensor_format_t;

/** Settings of both sensors. Clocks are those of the sensor: see sensor_clock_hz. */
typedef struct {
    uint16_t width;       /**< Of a frame, pixels. */
    uint16_t height;      /**< Of a frame, pixels. */
    uint8_t  binning;     /**< Pixels of the sensor, in each direction, for a pixel of the frame: 1, 2 or 4. */
    uint16_t column;      /**< First column of the window, pixels of the sensor from 0 on. */
    uint16_t row;         /**< First row of the window. */
    uint16_t row_clocks;  /**< Clocks of a row, with its blanking. */
    uint16_t frame_rows;  /**< Rows of the sensor in a frame, with the blanking. */
    uint16_t exposure;    /**< Rows. */
    uint16_t gain;        /**< Sixteenths. */
    bool     pattern;     /**< The sensor's test pattern in place of the image. */
} sensor_settings_t;

/** Ranges of the timing, for the window and the binning of settings. */
typedef struct {
    uint16_t least_row_clocks, most_row_clocks;
    uint16_t least_frame_rows, most_frame_rows;
} sensor_timing_t;

/** What sensors_poll has found. */
typedef enum {
    SENSORS_SAME = 0, /**< Nothing new. */
    SENSORS_GONE,     /**< One of the sensors or both no longer answer, or have lost their settings. */
    SENSORS_BACK,     /**< Both answer again, and have been set up anew. */
} sensors_event_t;

/** A pair of sensors; read-only for the caller. */
typedef struct {
    sensor_bus_t         *bus;
    const sensor_model_t *model;
    sensor_settings_t     settings; /**< As last begun. */
    bool                  begun;    /**< sensors_begin has accepted settings. */
    bool                  running;  /**< Both are set up. */
    bool                  told;     /**< By the newest event, or sensors_begin, they are set up. */
    uint8_t               present;  /**< Sensors that answered at the last poll or set-up. */
    uint32_t              set_ups;  /**< Set-ups that succeeded. */
    uint32_t              losses;   /**< Times that they were gone. */
    uint64_t              polled;   /**< Clock of the last poll. */
} sensors_t;

/** Name of a model, such as "MT9V034". */
const char *sensor_name(const sensor_model_t *model);

/** How it uses its signals. */
sensor_format_t sensor_format(const sensor_model_t *model);

/** Clocks per second of a sensor with this master clock, in Hz; 0 if it cannot use that. */
uint32_t sensor_clock_hz(const sensor_model_t *model, uint32_t master_hz);

/** Settings for frames of a size: the window in the middle with the most binning, the shortest rows, the usual
 * blanking between frames, an exposure of half of a frame's time, and a gain of 1. STATUS_SIZE if the sensor has
 * no such frames. */
status_t sensor_defaults(const sensor_model_t *model, uint16_t width, uint16_t height, sensor_settings_t *settings);

/** Ranges of the timing, for settings with a window that the sensor has; STATUS_SIZE for others. */
status_t sensor_timing(const sensor_model_t *model, const sensor_settings_t *settings, sensor_timing_t *timing);

/** Ranges of exposure and gain at the timing of settings, as exposure_init wants them. */
exposure_limits_t sensor_exposure_limits(const sensor_model_t *model, const sensor_settings_t *settings);

/** Frames per 1000 seconds of settings. */
uint32_t sensor_rate(const sensor_model_t *model, const sensor_settings_t *settings, uint32_t master_hz);

/** Sets `frame_rows` to the rate, in frames per 1000 seconds, rounded to whole rows.
 *
 * STATUS_BAD_ARGUMENT if the sensor cannot have the rate with rows of this length, or the exposure would be longer
 * than a frame: the settings are as before then.
 */
status_t sensor_set_rate(const sensor_model_t *model, sensor_settings_t *settings, uint32_t master_hz, uint32_t rate);

/** Whether a sensor can have these settings: STATUS_SIZE if not the window, STATUS_BAD_ARGUMENT if not another one. */
status_t sensor_check(const sensor_model_t *model, const sensor_settings_t *settings);

/** Prepares a pair; touches no sensor. */
void sensors_init(sensors_t *sensors, sensor_bus_t *bus, const sensor_model_t *model);

/** Resets both sensors, checks their identity, sets them up and reads all settings back. It takes up to half a second.
 * `clock` is now, as the bus's clock has it.
 *
 * What sensor_check returns, if that refuses: then nothing is changed. STATUS_UNSUPPORTED if a sensor does not
 * answer, is another one, or does not have what was written; STATUS_TIMEOUT if the bus is held low; `bus->fault`
 * says which. In these cases sensors_poll tries again.
 */
status_t sensors_begin(sensors_t *sensors, const sensor_settings_t *settings, uint64_t clock);

/** Changes settings of sensors that run, without a reset, and reads them back. Returns what sensors_begin does, or
 * STATUS_STATE if they do not run. The first frame after another window is no good. */
status_t sensors_apply(sensors_t *sensors, const sensor_settings_t *settings);

/** Writes exposure and gain to both sensors at once: to be called in the blanking, of which it uses about a
 * millisecond. It reads nothing back: sensors_poll does.
 *
 * STATUS_BAD_ARGUMENT if they are not within sensor_exposure_limits, STATUS_STATE if the sensors do not run; otherwise
 * what sensor_bus_write does.
 */
status_t sensors_expose(sensors_t *sensors, uint16_t exposure, uint16_t gain);

/** Turns the test pattern of both sensors on or off, and reads that back. Returns what sensors_apply does. */
status_t sensors_show_pattern(sensors_t *sensors, bool on);

/** Changes `frame_rows` of one sensor alone, to move its frames against those of the other; sensors_apply makes both
 * equal again. Returns what sensors_apply does. */
status_t sensors_shift(sensors_t *sensors, uint8_t sensor, uint16_t frame_rows);

/** Once a second asks both sensors for their identity, exposure and gain, and for a register that a reset would have
 * changed. If one of them does not have these, or one of the functions above has failed, the pair is gone; it is set up
 * anew once a second until that succeeds. A poll takes a few milliseconds, a set-up as long as sensors_begin. */
sensors_event_t sensors_poll(sensors_t *sensors, uint64_t clock);

#ifdef __cplusplus
}
#endif

#endif
