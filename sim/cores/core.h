//
// This file is part of LiteStereo.
//
// SPDX-License-Identifier: BSD-2-Clause

// The Verilator model of any core, as both benches make, clock and free it.
// `ports.h` is generated for each core: the model's class and functions to set and get its ports.

#ifndef CORE_H
#define CORE_H

#include "verilated.h"
#if VM_COVERAGE
#include "verilated_cov.h"
#endif
#include "ports.h"

double sc_time_stamp() { return 0; }

struct Core {
    VerilatedContext context;
    Model model{&context};

    void clock()
    {
        model.sys_clk = 1;
        model.eval();
        model.sys_clk = 0;
        model.eval();
    }
};

extern "C" {

Core *core_new(void)
{
    Core *core = new Core;
    core->model.sys_rst = 0;
    core->model.sys_clk = 0;
    core->model.eval();
    return core;
}

// Frees the core. How often each line was run goes to the file `coverage`, if the model counts it.
void core_free(Core *core, const char *coverage)
{
    core->model.final();
#if VM_COVERAGE
    core->context.coveragep()->write(coverage);
#else
    (void)coverage;
#endif
    delete core;
}

}  // extern "C"

#endif
