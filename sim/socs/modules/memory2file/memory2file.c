/*
 * This file is part of LiteStereo.
 *
 * SPDX-License-Identifier: BSD-2-Clause
 */

/*
 * litex_sim module: counts the events that sim/socs/memory_monitor.py shows, a bit each, and appends the counts to a
 * file at equal distances. A row is 33 words of 64 bits in this computer's byte order: the time in ps, and how often
 * each event has been since the start.
 */

#include <errno.h>
#include <json-c/json.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "error.h"
#include "modules.h"
#include "../pads.h"

#define EVENTS     32
#define ROW_CLOCKS 4096

struct session {
    char *sys_clk;
    char *events;
    clk_edge_state_t edge;
    uint64_t clocks;
    struct {
        uint64_t time_ps;
        uint64_t count[EVENTS];
    } row;
    FILE *file;
};

static int start(void *base)
{
    (void)base;
    return RC_OK;
}

static FILE *open_file(const char *args)
{
    json_object *arguments = args ? json_tokener_parse(args) : NULL;
    json_object *path = NULL;
    FILE *file = NULL;

    if (arguments && json_object_object_get_ex(arguments, "file", &path)) {
        file = fopen(json_object_get_string(path), "wb");
    }
    if (!file) {
        fprintf(stderr, "[memory2file] cannot write its file: %s\n", path ? strerror(errno) : "it has no name");
        exit(1);
    }
    json_object_put(arguments);
    return file;
}

static int new_session(void **out, char *args)
{
    struct session *session = calloc(1, sizeof(*session));

    if (!session) {
        return RC_NOENMEM;
    }
    session->file = open_file(args);
    *out = session;
    return RC_OK;
}

static int add_pads(void *state, struct pad_list_s *list)
{
    struct session *session = state;

    if (!strcmp(list->name, "sys_clk")) {
        session->sys_clk = pad(list, "sys_clk");
    } else if (!strcmp(list->name, "memory")) {
        session->events = pad(list, "events");
    }
    return RC_OK;
}

static void write_row(struct session *session, uint64_t time_ps)
{
    session->row.time_ps = time_ps;
    /* Nothing is buffered: the simulator may be killed at any time. */
    if (fwrite(&session->row, sizeof(session->row), 1, session->file) != 1 || fflush(session->file)) {
        fprintf(stderr, "[memory2file] cannot write: %s\n", strerror(errno));
        exit(1);
    }
}

static int tick(void *state, uint64_t time_ps)
{
    struct session *session = state;
    uint32_t events;

    if (!clk_pos_edge(&session->edge, *session->sys_clk)) {
        return RC_OK;
    }
    for (memcpy(&events, session->events, sizeof(events)); events; events &= events - 1) {
        session->row.count[__builtin_ctz(events)]++;
    }
    if (++session->clocks % ROW_CLOCKS == 0) {
        write_row(session, time_ps);
    }
    return RC_OK;
}

static struct ext_module_s module = {
    .name = "memory2file",
    .start = start,
    .new_sess = new_session,
    .add_pads = add_pads,
    .tick = tick,
};

int litex_sim_ext_module_init(int (*register_module)(struct ext_module_s *))
{
    return register_module(&module);
}
