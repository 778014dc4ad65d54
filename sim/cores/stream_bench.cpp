//
// This file is part of LiteStereo.
//
// SPDX-License-Identifier: BSD-2-Clause

// Drives the Verilator model of any core with one sink and one source, called from Python through a C interface.
// `ports.h` is generated for each core: the model's class and functions to set and get its ports.

#include <cstddef>
#include <cstdint>

#include "core.h"

namespace {

// Marsaglia's xorshift64*: small, fast and the same everywhere.
struct Random {
    uint64_t state;

    bool chance(uint32_t per_mille)
    {
        state ^= state >> 12;
        state ^= state << 25;
        state ^= state >> 27;
        return ((state * 0x2545f4914f6cdd1dull) >> 40) % 1000 < per_mille;
    }
};

}  // namespace

extern "C" {

struct Run {
    const uint32_t *input;       // Sink words, SINK_WORDS each.
    const uint8_t *input_marks;  // Bit 0 first, bit 1 last.
    uint64_t inputs;
    uint32_t *output;  // Source words, SOURCE_WORDS each.
    uint8_t *output_marks;
    uint64_t outputs;         // Stop when as many have come.
    uint64_t idle_clocks;     // Stop when nothing has moved for as many clocks.
    uint32_t valid_per_mille; // Chance that the sink is offered the next item.
    uint32_t ready_per_mille; // Chance that the source is ready.
    uint64_t seed;
    uint64_t reset_clock; // Stop, in reset, at this clock; 0: never.
    uint64_t probe;       // Output whose clock is wanted.
    // Results.
    uint64_t accepted;    // Items that the sink took.
    uint64_t captured;    // Items that the source gave.
    uint64_t clocks;      // From the first item offered to the last one captured.
    uint64_t probe_clock; // From the first item offered to the capture of `probe`.
};

void core_set(Core *core, uint32_t setting, uint32_t value)
{
    set_setting(core->model, setting, value);
}

uint32_t core_get(Core *core, uint32_t status)
{
    core->model.eval();
    return get_status(core->model, status);
}

void core_reset(Core *core)
{
    core->model.sys_rst = 1;
    core->model.sink_valid = 0;
    core->model.source_ready = 0;
    core->clock();
    core->model.sys_rst = 0;
    core->model.eval();
}

void core_run(Core *core, Run *run)
{
    Model &model = core->model;
    Random random{run->seed * 2 + 1};
    bool offered = false;
    uint64_t idle = 0;
    run->accepted = run->captured = run->clocks = run->probe_clock = 0;
    for (uint64_t now = 1; run->captured < run->outputs && idle < run->idle_clocks; now++) {
        if (run->reset_clock && now == run->reset_clock) {
            break;
        }
        // An item once offered stays until it is taken.
        if (!offered && run->accepted < run->inputs && random.chance(run->valid_per_mille)) {
            offered = true;
            set_sink(model, run->input + run->accepted * SINK_WORDS);
            model.sink_first = run->input_marks[run->accepted] & 1;
            model.sink_last = run->input_marks[run->accepted] >> 1;
        }
        model.sink_valid = offered;
        model.source_ready = random.chance(run->ready_per_mille);
        model.eval();
        idle++;
        if (model.source_valid && model.source_ready) {
            get_source(model, run->output + run->captured * SOURCE_WORDS);
            run->output_marks[run->captured] = model.source_first | model.source_last << 1;
            if (run->captured == run->probe) {
                run->probe_clock = now;
            }
            run->captured++;
            run->clocks = now;
            idle = 0;
        }
        if (offered && model.sink_ready) {
            run->accepted++;
            offered = false;
            idle = 0;
        }
        core->clock();
    }
    model.sink_valid = 0;
    model.source_ready = 0;
    model.eval();
}

}  // extern "C"
