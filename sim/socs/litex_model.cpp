//
// This file is part of LiteStereo.
//
// SPDX-License-Identifier: BSD-2-Clause

// What LiteX's simulator calls of its model. LiteX's own file is for traces: even where none is wanted it keeps every
// signal, and flushes a file twice a clock. It also evaluates the model at each step of time, of which a clock has fifty
// if the wire has another one.

#include <cstdint>

#include "Vsim.h"
#include "verilated.h"

namespace {

uint64_t now_ps;

// Clocks of the model as bits. Not all models have one for the matcher.
template <typename Model> auto matcher_clk(const Model &model, int) -> decltype(+model.matcher_clk)
{
    return model.matcher_clk;
}

template <typename Model> int matcher_clk(const Model &, long)
{
    return 0;
}

template <typename Model> unsigned clocks(const Model &model)
{
    return model.sys_clk | model.eth_clk << 1 | static_cast<unsigned>(matcher_clk(model, 0)) << 2;
}

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
    static unsigned last = ~0u;
    Vsim *sim = static_cast<Vsim *>(model);
    unsigned now = clocks(*sim);

    // litex_sim's modules drive pads at edges only: what they drive is seen at the next edge, of any clock.
    now_ps = time_ps;
    if (now != last) {
        last = now;
        sim->eval();
    }
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
