//
// This file is part of LiteStereo.
//
// SPDX-License-Identifier: BSD-2-Clause

// Drives the Verilator model of any core pin by pin, called from Python through a C interface.
// `ports.h` is generated for each core: the model's class and functions to set and get its ports.

#include <cstdint>

#include "verilated.h"
#include "ports.h"

double sc_time_stamp() { return 0; }

struct Core {
    VerilatedContext context;
    Model model{&context};
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

void core_free(Core *core)
{
    core->model.final();
    delete core;
}

void core_set(Core *core, uint32_t port, const uint32_t *words)
{
    set_port(core->model, port, words);
}

void core_get(Core *core, uint32_t port, uint32_t *words)
{
    get_port(core->model, port, words);
}

void core_eval(Core *core)
{
    core->model.eval();
}

void core_clock(Core *core)
{
    core->model.sys_clk = 1;
    core->model.eval();
    core->model.sys_clk = 0;
    core->model.eval();
}

}  // extern "C"
