//
// This file is part of LiteStereo.
//
// SPDX-License-Identifier: BSD-2-Clause

// Drives the Verilator model of any core pin by pin, called from Python through a C interface.
// `ports.h` is generated for each core: the model's class and functions to set and get its ports.

#include <cstdint>

#include "core.h"

extern "C" {

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
    core->clock();
}

}  // extern "C"
