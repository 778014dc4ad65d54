//
// This file is part of LiteStereo.
//
// SPDX-License-Identifier: BSD-2-Clause

// What LiteX's simulator calls of its model. LiteX's own file is for traces: even where none is wanted it keeps every
// signal, and flushes a file twice a clock.

#include <cstdint>

#include "Vsim.h"
#include "verilated.h"

namespace {

uint64_t now_ps;

}  // namespace

extern "C" {

void litex_sim_init_cmdargs(int argc, char *argv[])
{
    Verilated::commandArgs(argc, argv);
}

void litex_sim_init_tracer(void *, long, long) {}

void litex_sim_tracer_dump() {}

void litex_sim_eval(void *model, uint64_t time_ps)
{
    static_cast<Vsim *>(model)->eval();
    now_ps = time_ps;
}

int litex_sim_got_finish()
{
    return Verilated::gotFinish();
}

}  // extern "C"

double sc_time_stamp()
{
    return now_ps;
}
