/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/* The arguments of the module in litex_sim's configuration. A wrong one ends the simulator. */

#ifndef SETTINGS_H
#define SETTINGS_H

#include <arpa/inet.h>
#include <json-c/json.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "frames.h"

struct settings {
    int port;     /* of 127.0.0.1; 0: the kernel picks one */
    char *clock;  /* name of the pads */
    unsigned gap; /* clocks between two frames */
    struct station device;
    char *capture; /* path; NULL: none */
    char *paced;   /* name of the abstract socket of a host in the device's time; NULL: there is none */
    unsigned paced_latency; /* clocks */
    /* A station that sends the same datagram again and again, and answers nothing, not even ARP. */
    struct station stranger;
    unsigned stranger_clocks; /* from one of its datagrams to the next; 0: no such station */
    uint8_t *stranger_payload;
    size_t stranger_length;
};

static void fail(const char *format, ...) __attribute__((format(printf, 1, 2), noreturn));

/* litex_sim would continue with a device that no host can reach. */
static void fail(const char *format, ...)
{
    va_list values;

    fputs("[ethernet2socket] ", stderr);
    va_start(values, format);
    vfprintf(stderr, format, values);
    va_end(values);
    fputc('\n', stderr);
    exit(1);
}

static inline const char *text_argument(json_object *arguments, const char *name, const char *standard)
{
    json_object *value = NULL;

    return json_object_object_get_ex(arguments, name, &value) ? json_object_get_string(value) : standard;
}

static inline int number_argument(json_object *arguments, const char *name, int standard, int least, int most)
{
    json_object *value = NULL;
    int number = standard;

    if (json_object_object_get_ex(arguments, name, &value)) {
        number = json_object_get_int(value);
    }
    if (number < least || number > most) {
        fail("%s is %d to %d, not %d", name, least, most, number);
    }
    return number;
}

static inline uint32_t address_argument(json_object *arguments, const char *name, const char *standard)
{
    const char *text = text_argument(arguments, name, standard);
    struct in_addr address;

    if (!text || inet_pton(AF_INET, text, &address) != 1) {
        fail("%s is an IPv4 address, not %s", name, text ? text : "null");
    }
    return ntohl(address.s_addr);
}

static inline void mac_argument(json_object *arguments, const char *name, const char *standard, uint8_t *mac)
{
    const char *text = text_argument(arguments, name, standard);
    int end = 0;

    if (text) {
        sscanf(text, "%2hhx:%2hhx:%2hhx:%2hhx:%2hhx:%2hhx%n", mac, mac + 1, mac + 2, mac + 3, mac + 4, mac + 5, &end);
    }
    if (!end || text[end]) {
        fail("%s is six bytes in hexadecimal with colons, not %s", name, text ? text : "null");
    }
}

/* Bytes of a datagram, and their number in `length`. */
static inline uint8_t *payload_argument(json_object *arguments, const char *name, size_t *length)
{
    const char *text = text_argument(arguments, name, "");
    uint8_t *bytes = calloc(1, PAYLOAD_MOST);

    if (!bytes || !text || strlen(text) % 2 || strspn(text, "0123456789abcdef") != strlen(text)
        || strlen(text) > 2 * PAYLOAD_MOST) {
        fail("%s is at most %d bytes in hexadecimal, not %s", name, PAYLOAD_MOST, text ? text : "null");
    }
    *length = strlen(text) / 2;
    for (size_t i = 0; i < *length; i++) {
        sscanf(text + 2 * i, "%2hhx", bytes + i);
    }
    return bytes;
}

static inline struct settings read_settings(const char *args)
{
    json_object *arguments = args ? json_tokener_parse(args) : NULL;
    struct settings settings;
    const char *clock, *capture, *paced;

    if (args && !json_object_is_type(arguments, json_type_object)) {
        fail("arguments are a JSON object, not %s", args);
    }
    settings.port           = number_argument(arguments, "port", 0, 0, 65535);
    settings.gap            = (unsigned)number_argument(arguments, "gap", 24, 1, 1000000);
    settings.device.port    = (uint16_t)number_argument(arguments, "device_port", 19539, 1, 65535);
    settings.device.address = address_argument(arguments, "device_address", "192.168.1.50");
    mac_argument(arguments, "device_mac", "10:e2:d5:00:00:02", settings.device.mac);
    clock            = text_argument(arguments, "clock", NULL);
    settings.clock   = strdup(clock ? clock : "sys_clk");
    capture          = text_argument(arguments, "capture", NULL);
    settings.capture = capture ? strdup(capture) : NULL;
    paced            = text_argument(arguments, "paced", NULL);
    settings.paced   = paced ? strdup(paced) : NULL;
    settings.paced_latency = (unsigned)number_argument(arguments, "paced_latency", 0, 0, 1000000000);
    settings.stranger_clocks = (unsigned)number_argument(arguments, "stranger_clocks", 0, 0, 1000000000);
    settings.stranger_payload = payload_argument(arguments, "stranger_payload", &settings.stranger_length);
    settings.stranger.port    = (uint16_t)number_argument(arguments, "stranger_port", 40000, 1, 65535);
    settings.stranger.address = address_argument(arguments, "stranger_address", "192.168.1.200");
    mac_argument(arguments, "stranger_mac", "02:00:00:00:00:c8", settings.stranger.mac);
    json_object_put(arguments);
    return settings;
}

#endif
