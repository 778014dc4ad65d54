/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/*
 * litex_sim module: the Ethernet of the simulated SoC, at the pads of LiteEth's PHY model, on a UDP socket of this
 * machine.
 *
 * Unlike LiteX's ethernet it needs no TAP and no privileges, and many can run at once: the module itself plays the only
 * host of the device's network, 192.168.1.100. A datagram from 127.0.0.1:P is a frame from port P of that host for the
 * SoC, and what the SoC sends to that port goes to 127.0.0.1:P. The host answers ARP, and discards what a real one
 * would. Frames come to the SoC at the pace of a wire: a byte per clock, and between two frames the clocks that the
 * preamble, the FCS and the gap of a wire take.
 */

#define _GNU_SOURCE /* SOCK_NONBLOCK in strict C11 */

#include <arpa/inet.h>
#include <errno.h>
#include <netinet/in.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

#include "capture.h"
#include "error.h"
#include "frames.h"
#include "modules.h"
#include "../pads.h"
#include "paced.h"
#include "settings.h"

#define HOST_MAC     {0x02, 0x00, 0x00, 0x00, 0x00, 0x64}
#define HOST_ADDRESS 0xc0a80164 /* 192.168.1.100 */

/* Clocks between two polls of an empty socket: rare enough to cost nothing. */
#define POLL_CLOCKS  64
/* Room for a frame of images: there is no flow control. */
#define SOCKET_BYTES (4 * 1024 * 1024)

/* Outcomes of a frame or datagram: the verdicts on frames of the SoC, and these. */
enum {
    DATAGRAM_UNSENT = FRAME_VERDICTS,
    DATAGRAM_LONG,
    DATAGRAM_ELSEWHERE,
    OUTCOMES,
};

/* Reasons for a drop; printed the first time. */
static const char *const complaints[OUTCOMES] = {
    [FRAME_SHORT]        = "a frame of the SoC has less than 60 bytes, or a gap",
    [FRAME_LONG]         = "a frame of the SoC has more than 1514 bytes",
    [FRAME_IP_LENGTH]    = "a frame of the SoC has lengths in its IPv4 header that cannot be, or a gap",
    [FRAME_IP_CHECKSUM]  = "a frame of the SoC has a wrong IPv4 header checksum",
    [FRAME_FRAGMENT]     = "a frame of the SoC is a fragment",
    [FRAME_UDP_LENGTH]   = "a frame of the SoC has a wrong UDP length",
    [FRAME_UDP_CHECKSUM] = "a frame of the SoC has a wrong UDP checksum",
    [FRAME_SENDER]       = "a frame of the SoC does not come from its address and port",
    [DATAGRAM_UNSENT]    = "a datagram of the SoC cannot be sent to its port",
    [DATAGRAM_LONG]      = "a datagram for the SoC has more than 1472 bytes",
    [DATAGRAM_ELSEWHERE] = "a datagram for the SoC does not come from 127.0.0.1",
};

struct frame {
    uint8_t bytes[FRAME_MOST];
    size_t length;
};

struct session {
    /* The names are LiteX's, seen from the pads: the SoC's source is what it sends. */
    char *clock;
    char *source_data, *source_valid;
    char *source_ready; /* NULL: the SoC does not use it */
    char *sink_data, *sink_valid;
    clk_edge_state_t edge;
    uint64_t clocks;
    struct settings settings;
    struct station host;
    int socket;
    FILE *capture; /* NULL: none */
    struct frame from_soc; /* if it is too long, only the length increases */
    struct frame to_soc;
    size_t sent;            /* bytes of to_soc */
    unsigned remaining_gap; /* clocks */
    unsigned idle;          /* clocks since a frame could begin */
    uint64_t stranger_sent; /* datagrams of the stranger */
    struct frame answer;    /* to ARP, waits for the gap after the frame to the SoC; length 0: none */
    uint64_t outcomes[OUTCOMES];
    struct paced paced;
};

static void count(struct session *session, unsigned outcome)
{
    if (++session->outcomes[outcome] == 1 && complaints[outcome]) {
        fprintf(stderr, "[ethernet2socket] dropped, from now on silently: %s\n", complaints[outcome]);
    }
}

static int start(void *base)
{
    (void)base;
    return RC_OK;
}

static FILE *capture_to(const char *path)
{
    FILE *file = fopen(path, "wb");

    if (!file || !capture_begin(file)) {
        fail("cannot write the capture %s: %s", path, strerror(errno));
    }
    return file;
}

static int listen_on(int port)
{
    struct sockaddr_in address = {.sin_family = AF_INET, .sin_port = htons((uint16_t)port)};
    socklen_t length = sizeof(address);
    int listener = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    int bytes = SOCKET_BYTES;

    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (listener < 0 || bind(listener, (struct sockaddr *)&address, sizeof(address))
        || getsockname(listener, (struct sockaddr *)&address, &length)) {
        fail("cannot listen on port %d: %s", port, strerror(errno));
    }
    /* The first option exceeds the system's limit, where that is permitted. */
    if (setsockopt(listener, SOL_SOCKET, SO_RCVBUFFORCE, &bytes, sizeof(bytes))) {
        setsockopt(listener, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof(bytes));
    }
    printf("[ethernet2socket] listening on 127.0.0.1:%d\n", ntohs(address.sin_port));
    fflush(stdout);
    return listener;
}

static int new_session(void **out, char *args)
{
    struct session *session = calloc(1, sizeof(*session));

    if (!session) {
        return RC_NOENMEM;
    }
    session->settings = read_settings(args);
    session->host     = (struct station){.mac = HOST_MAC, .address = HOST_ADDRESS};
    session->capture  = session->settings.capture ? capture_to(session->settings.capture) : NULL;
    paced_init(&session->paced, session->settings.paced, session->settings.paced_latency);
    session->socket   = listen_on(session->settings.port);
    *out = session;
    return RC_OK;
}

static int add_pads(void *state, struct pad_list_s *list)
{
    struct session *session = state;

    if (!strcmp(list->name, session->settings.clock)) {
        session->clock = pad(list, session->settings.clock);
    } else if (!strcmp(list->name, "eth")) {
        session->source_data  = pad(list, "source_data");
        session->source_valid = pad(list, "source_valid");
        session->source_ready = optional_pad(list, "source_ready");
        session->sink_data    = pad(list, "sink_data");
        session->sink_valid   = pad(list, "sink_valid");
    }
    return RC_OK;
}

static void capture(struct session *session, const struct frame *frame)
{
    if (session->capture && !capture_frame(session->capture, session->clocks, frame->bytes, frame->length)) {
        fprintf(stderr, "[ethernet2socket] the capture ends here: %s\n", strerror(errno));
        fclose(session->capture);
        session->capture = NULL;
    }
}

static void send_on(struct session *session, const struct datagram *datagram)
{
    struct sockaddr_in to = {.sin_family = AF_INET, .sin_port = htons(datagram->port)};

    if (session->paced.client >= 0 && datagram->port == PACED_PORT) {
        put_letter(&session->paced.to_host, session->clocks + session->paced.latency, datagram->payload,
                   datagram->length);
        return;
    }
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (sendto(session->socket, datagram->payload, datagram->length, 0, (struct sockaddr *)&to, sizeof(to)) < 0) {
        count(session, DATAGRAM_UNSENT);
    }
}

static void take_frame(struct session *session)
{
    struct frame *frame = &session->from_soc;
    struct datagram datagram;
    enum verdict verdict = judge(frame->bytes, frame->length, &session->host, &session->settings.device, &datagram);

    capture(session, frame);
    count(session, verdict);
    if (verdict == FRAME_DATAGRAM) {
        send_on(session, &datagram);
    } else if (verdict == FRAME_ARP_REQUEST) {
        session->answer.length = put_arp_answer(session->answer.bytes, frame->bytes, &session->host);
    }
}

/* As on a wire, a clock without a byte is the end of the frame. */
static void take_byte(struct session *session)
{
    struct frame *frame = &session->from_soc;

    if (*session->source_valid) {
        if (frame->length < FRAME_MOST) {
            frame->bytes[frame->length] = (uint8_t)*session->source_data;
        }
        frame->length++;
    } else if (frame->length) {
        take_frame(session);
        frame->length = 0;
    }
}

static size_t receive(struct session *session, uint8_t *frame)
{
    struct sockaddr_in from = {.sin_family = AF_INET};
    socklen_t from_length = sizeof(from);
    struct station sender = session->host;
    /* With MSG_TRUNC the result is the length that was sent, which may exceed the buffer. */
    ssize_t length = recvfrom(session->socket, frame + PAYLOAD_START, PAYLOAD_MOST, MSG_TRUNC,
                              (struct sockaddr *)&from, &from_length);

    if (length < 0) {
        return 0;
    }
    session->idle = 0;
    if (length > PAYLOAD_MOST || from.sin_addr.s_addr != htonl(INADDR_LOOPBACK)) {
        count(session, length > PAYLOAD_MOST ? DATAGRAM_LONG : DATAGRAM_ELSEWHERE);
        return 0;
    }
    sender.port = ntohs(from.sin_port);
    return put_datagram(frame, &sender, &session->settings.device, (size_t)length);
}

static size_t receive_paced(struct session *session, uint8_t *frame)
{
    struct station sender = session->host;
    struct letter *letter = first_letter(&session->paced.to_soc);

    if (!letter) {
        return 0;
    }
    sender.port = PACED_PORT;
    memcpy(frame + PAYLOAD_START, letter->bytes, letter->length);
    session->paced.to_soc.taken++;
    return put_datagram(frame, &sender, &session->settings.device, letter->length);
}

static bool stranger_is_due(const struct session *session)
{
    unsigned clocks = session->settings.stranger_clocks;

    return clocks && session->clocks / clocks > session->stranger_sent;
}

static size_t put_stranger(struct session *session, uint8_t *frame)
{
    struct settings *settings = &session->settings;

    session->stranger_sent++;
    memcpy(frame + PAYLOAD_START, settings->stranger_payload, settings->stranger_length);
    return put_datagram(frame, &settings->stranger, &settings->device, settings->stranger_length);
}

/* The next frame to the SoC, if there is one; its length is 0 if not. */
static void begin_frame(struct session *session)
{
    session->sent = 0;
    session->to_soc.length = 0;
    if (session->answer.length) {
        session->to_soc = session->answer;
        session->answer.length = 0;
    } else if (stranger_is_due(session)) {
        session->to_soc.length = put_stranger(session, session->to_soc.bytes);
    } else if (session->paced.client >= 0) {
        session->to_soc.length = receive_paced(session, session->to_soc.bytes);
    } else if (session->idle++ % POLL_CLOCKS == 0) {
        session->to_soc.length = receive(session, session->to_soc.bytes);
    }
}

static void drive_byte(struct session *session)
{
    struct frame *frame = &session->to_soc;

    *session->sink_valid = 0;
    if (session->remaining_gap) {
        session->remaining_gap--;
        return;
    }
    if (session->sent == frame->length) {
        begin_frame(session);
    }
    if (session->sent < frame->length) {
        *session->sink_valid = 1;
        *session->sink_data = (char)frame->bytes[session->sent++];
        if (session->sent == frame->length) {
            capture(session, frame);
            session->remaining_gap = session->settings.gap;
            session->idle = 0;
        }
    }
}

static int tick(void *state, uint64_t time_ps)
{
    struct session *session = state;

    (void)time_ps;
    if (!session->clock || !session->sink_valid) {
        fail("needs the interfaces eth and %s", session->settings.clock);
    }
    if (!clk_pos_edge(&session->edge, *session->clock)) {
        return RC_OK;
    }
    session->clocks++;
    if (session->source_ready) {
        *session->source_ready = 1;
    }
    take_byte(session);
    paced_tick(&session->paced, session->clocks);
    drive_byte(session);
    return RC_OK;
}

static struct ext_module_s module = {
    .name = "ethernet2socket",
    .start = start,
    .new_sess = new_session,
    .add_pads = add_pads,
    .tick = tick,
};

int litex_sim_ext_module_init(int (*register_module)(struct ext_module_s *))
{
    return register_module(&module);
}
