//
// This file is part of LiteStereo.
//
// SPDX-License-Identifier: BSD-2-Clause

// The Verilator model of any core, as both benches make, clock and free it. A model that is built for it writes a
// waveform, with a clock of 100 MHz.
// `ports.h` is generated for each core: the model's class and functions to set and get its ports.

#ifndef CORE_H
#define CORE_H

#include "verilated.h"
#if VM_COVERAGE
#include "verilated_cov.h"
#endif
#if VM_TRACE_FST
#include "verilated_fst_c.h"
using Waveform = VerilatedFstC;
#elif VM_TRACE
#include "verilated_vcd_c.h"
using Waveform = VerilatedVcdC;
#endif
#include "ports.h"

double sc_time_stamp() { return 0; }

struct Core {
    VerilatedContext context;
    Model model{&context};
#if VM_TRACE
    Waveform waveform;
#endif

    void half_clock(int level)
    {
        model.sys_clk = level;
        model.eval();
#if VM_TRACE
        context.timeInc(5000);  // Picoseconds.
        waveform.dump(context.time());
#endif
    }

    void clock()
    {
        half_clock(1);
        half_clock(0);
    }
};

extern "C" {

// Makes a core. Its waveform goes to the file `waveform`, if the model has one.
Core *core_new(const char *waveform)
{
    Core *core = new Core;
#if VM_TRACE
    core->context.traceEverOn(true);
    core->model.trace(&core->waveform, 99);
    core->waveform.open(waveform);
#else
    (void)waveform;
#endif
    core->model.sys_rst = 0;
    core->model.sys_clk = 0;
    core->model.eval();
    return core;
}

// Frees the core. How often each line was run goes to the file `coverage`, if the model counts it.
void core_free(Core *core, const char *coverage)
{
    core->model.final();
#if VM_TRACE
    core->waveform.close();
#endif
#if VM_COVERAGE
    core->context.coveragep()->write(coverage);
#else
    (void)coverage;
#endif
    delete core;
}

}  // extern "C"

#endif
