/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/*
 * litex_sim module: the UART of the simulated SoC on a TCP socket of this machine.
 *
 * Unlike LiteX's serial2tcp it listens on the loopback interface only, can be given port 0 (the kernel picks one, and
 * it is printed), stops bytes when either side is slow, and outlives its clients: it serves one at a time, and accepts
 * the next once the previous one has gone. Without a client, the SoC's output is dropped, as on a UART without a cable.
 */

#define _GNU_SOURCE /* accept4 */

#include <arpa/inet.h>
#include <errno.h>
#include <json-c/json.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "error.h"
#include "modules.h"
#include "../pads.h"

#define BUFFER_SIZE 4096
/* Clocks between two polls of the socket: rare enough to cost nothing, often enough to go unnoticed. */
#define POLL_CLOCKS 256

struct buffer {
    char bytes[BUFFER_SIZE];
    size_t start;
    size_t end;
};

struct session {
    /* The names are LiteX's, seen from the pads: the SoC's source is what it sends. */
    char *sys_clk;
    char *source_data, *source_valid, *source_ready;
    char *sink_data, *sink_valid, *sink_ready;
    clk_edge_state_t edge;
    unsigned clocks;
    int listener;
    int client; /* -1: none */
    struct buffer to_soc;
    struct buffer from_soc;
};

static int start(void *base)
{
    (void)base;
    return RC_OK;
}

static int port_argument(const char *args)
{
    json_object *arguments = args ? json_tokener_parse(args) : NULL;
    json_object *port = NULL;
    int number = 0;

    if (arguments && json_object_object_get_ex(arguments, "port", &port)) {
        number = json_object_get_int(port);
    }
    json_object_put(arguments);
    return number;
}

static int listen_on(int port)
{
    struct sockaddr_in address = {.sin_family = AF_INET, .sin_port = htons(port)};
    socklen_t length = sizeof(address);
    int listener = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    int one = 1;

    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    setsockopt(listener, SOL_SOCKET, SO_REUSEADDR, &one, sizeof(one));
    if (listener < 0 || bind(listener, (struct sockaddr *)&address, sizeof(address)) || listen(listener, 1)
        || getsockname(listener, (struct sockaddr *)&address, &length)) {
        fprintf(stderr, "[serial2socket] cannot listen on port %d: %s\n", port, strerror(errno));
        if (listener >= 0) {
            close(listener);
        }
        return -1;
    }
    printf("[serial2socket] listening on 127.0.0.1:%d\n", ntohs(address.sin_port));
    fflush(stdout);
    return listener;
}

static int new_session(void **out, char *args)
{
    struct session *session = calloc(1, sizeof(*session));

    if (!session) {
        return RC_NOENMEM;
    }
    session->client = -1;
    session->listener = listen_on(port_argument(args));
    *out = session;
    if (session->listener < 0) {
        /* litex_sim would continue with a UART that no client can reach. */
        exit(1);
    }
    return RC_OK;
}

static int add_pads(void *state, struct pad_list_s *list)
{
    struct session *session = state;

    if (!strcmp(list->name, "sys_clk")) {
        session->sys_clk = pad(list, "sys_clk");
    } else if (!strcmp(list->name, "serial")) {
        session->source_data = pad(list, "source_data");
        session->source_valid = pad(list, "source_valid");
        session->source_ready = pad(list, "source_ready");
        session->sink_data = pad(list, "sink_data");
        session->sink_valid = pad(list, "sink_valid");
        session->sink_ready = pad(list, "sink_ready");
    }
    return RC_OK;
}

static void drop_client(struct session *session)
{
    close(session->client);
    session->client = -1;
    session->from_soc.start = session->from_soc.end = 0;
}

static void accept_client(struct session *session)
{
    int one = 1;

    session->client = accept4(session->listener, NULL, NULL, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (session->client >= 0) {
        setsockopt(session->client, IPPROTO_TCP, TCP_NODELAY, &one, sizeof(one));
    }
}

static void receive(struct session *session)
{
    struct buffer *buffer = &session->to_soc;
    ssize_t length;

    if (buffer->start != buffer->end) {
        return;
    }
    length = recv(session->client, buffer->bytes, BUFFER_SIZE, 0);
    if (length > 0) {
        buffer->start = 0;
        buffer->end = length;
    } else if (length == 0 || (errno != EAGAIN && errno != EINTR)) {
        drop_client(session);
    }
}

static void transmit(struct session *session)
{
    struct buffer *buffer = &session->from_soc;
    ssize_t length;

    if (buffer->start == buffer->end) {
        return;
    }
    length = send(session->client, buffer->bytes + buffer->start, buffer->end - buffer->start, MSG_NOSIGNAL);
    if (length > 0) {
        buffer->start += length;
        if (buffer->start == buffer->end) {
            buffer->start = buffer->end = 0;
        }
    } else if (errno != EAGAIN && errno != EINTR) {
        drop_client(session);
    }
}

static int tick(void *state, uint64_t time_ps)
{
    struct session *session = state;
    struct buffer *to_soc = &session->to_soc;
    struct buffer *from_soc = &session->from_soc;

    (void)time_ps;
    if (!clk_pos_edge(&session->edge, *session->sys_clk)) {
        return RC_OK;
    }

    if (++session->clocks % POLL_CLOCKS == 0 || from_soc->end == BUFFER_SIZE) {
        if (session->client < 0) {
            accept_client(session);
        }
        if (session->client >= 0) {
            transmit(session);
        }
        if (session->client >= 0) {
            receive(session);
        }
    }

    /* What is valid and ready now moves with the next rising edge, so it is taken now. */
    *session->source_ready = session->client < 0 || from_soc->end < BUFFER_SIZE;
    if (*session->source_valid && *session->source_ready && session->client >= 0) {
        from_soc->bytes[from_soc->end++] = *session->source_data;
    }
    *session->sink_valid = to_soc->start != to_soc->end;
    if (*session->sink_valid) {
        *session->sink_data = to_soc->bytes[to_soc->start];
        if (*session->sink_ready) {
            to_soc->start++;
        }
    }
    return RC_OK;
}

static struct ext_module_s module = {
    .name = "serial2socket",
    .start = start,
    .new_sess = new_session,
    .add_pads = add_pads,
    .tick = tick,
};

int litex_sim_ext_module_init(int (*register_module)(struct ext_module_s *))
{
    return register_module(&module);
}
