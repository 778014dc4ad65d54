//
// This file is part of LiteStereo.
//
// SPDX-License-Identifier: BSD-2-Clause

// The SoC in Verilator with clocks that drift, memory that stalls and fails, and Ethernet on a UDP port.

#include "machine.h"

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <sys/mman.h>

#include "Vcore.h"
#include "verilated.h"

extern "C" {
#include "error.h"
#include "modules.h"
int litex_sim_ext_module_init(int (*register_module)(struct ext_module_s *));
}

double sc_time_stamp() { return 0; }

machine_counts_t machine_counts;

namespace {

// Mean clocks between two changes of the memory's behaviour, and of the clocks' ratio.
constexpr uint32_t MOOD_CLOCKS = 20000, RATIO_CLOCKS = 200000, ERROR_CLOCKS = 4000000;
constexpr uint64_t SYS_HALF = 1000;  // Half a period of `sys`; that of `eth` is drawn.
constexpr unsigned MATCHER_PORTS = 2;  // The first ones: only their DMA is answered with errors.
constexpr unsigned FAULTS = 16;

enum { MOOD_STRIKES = 8, RATIO_STRIKES, ERROR_STRIKES };

VerilatedContext context;
Vcore *core;
uint8_t *memory;
ext_module_s wire_module;
void *wire;
uint64_t random_state, now, eth_half = 1000, next_sys, next_eth;
#if MATCHER_CLOCK
uint64_t matcher_half = 1000, next_matcher;
#endif
uint64_t due[FAULTS];
unsigned mood;
uint32_t hurry;
bool error_due, in_interrupt;

uint64_t drawn(uint64_t limit)
{
    random_state ^= random_state >> 12;
    random_state ^= random_state << 25;
    random_state ^= random_state >> 27;
    return (random_state * 0x2545f4914f6cdd1dull >> 20) % limit;
}

[[noreturn]] void fail(const char *what, uint64_t value)
{
    fprintf(stderr, "machine: %s: 0x%llx\n", what, (unsigned long long)value);
    exit(3);
}

// Clocks that an access waits, by the memory's mood.
uint32_t wait_clocks()
{
    switch (mood) {
    case 0: return 0;
    case 1: return (uint32_t)drawn(4);
    case 2: return drawn(20) == 0 ? 40 : 0;
    default:
        if (drawn(200) == 0) {
            machine_counts.freezes++;
            return (uint32_t)drawn(5000);
        }
        return 0;
    }
}

// A port of the memory, as the SoC sees it after a rising edge.
struct Port {
    unsigned number;
    CData &cyc, &stb, &we, &sel, &ack, &err;
    IData &address;
    QData &written, &read;
    bool begun;
    uint32_t wait;

    uint8_t *word() const
    {
        uint64_t byte = (uint64_t)address * 8;
        if (byte < MACHINE_MEMORY_BASE || byte + 8 > (uint64_t)MACHINE_MEMORY_BASE + MACHINE_MEMORY_SIZE) {
            fail("access outside of the memory", byte);
        }
        return memory + (byte - MACHINE_MEMORY_BASE);
    }

    void access()
    {
        uint8_t *bytes = word();
        if (number < MATCHER_PORTS && error_due) {
            error_due = false;
            machine_counts.bus_errors++;
            err = 1;
            return;
        }
        ack = 1;
        if (we) {
            for (unsigned i = 0; i < 8; i++) {
                if (sel >> i & 1) {
                    bytes[i] = (uint8_t)(written >> 8 * i);
                }
            }
        } else {
            memcpy(&read, bytes, 8);
        }
    }

    void clock()
    {
        bool answered = ack || err;
        ack = err = 0;
        read = 0xdeadbeefdeadbeefull;
        if (!cyc || !stb || answered) {
            begun = false;
            return;
        }
        if (!begun) {
            begun = true;
            wait = wait_clocks();
            machine_counts.stalls += wait > 0;
        }
        if (wait > 0) {
            wait--;
        } else {
            access();
        }
    }
};

Port *ports[4];

#define PORT(n, we) new Port{n, core->ram##n##_cyc, core->ram##n##_stb, we, core->ram##n##_sel, core->ram##n##_ack, \
    core->ram##n##_err, core->ram##n##_adr, core->ram##n##_dat_w, core->ram##n##_dat_r, false, 0}

int take_module(ext_module_s *module)
{
    wire_module = *module;
    return RC_OK;
}

void connect_wire()
{
    char arguments[] = "{\"clock\": \"eth_clk\"}";
    pad_s clock_pads[] = {{(char *)"eth_clk", 1, (char *)&core->eth_clk}, {nullptr, 0, nullptr}};
    pad_s wire_pads[] = {
        {(char *)"source_data", 8, (char *)&core->source_data}, {(char *)"source_valid", 1, (char *)&core->source_valid},
        {(char *)"source_ready", 1, (char *)&core->source_ready}, {(char *)"sink_data", 8, (char *)&core->sink_data},
        {(char *)"sink_valid", 1, (char *)&core->sink_valid}, {nullptr, 0, nullptr}};
    pad_list_s clocks = {(char *)"eth_clk", clock_pads, 0, nullptr};
    pad_list_s pads = {(char *)"eth", wire_pads, 0, nullptr};

    litex_sim_ext_module_init(take_module);
    wire_module.new_sess(&wire, arguments);
    wire_module.add_pads(wire, &clocks);
    wire_module.add_pads(wire, &pads);
}

void disturb()
{
    if (machine_strikes(MOOD_STRIKES, MOOD_CLOCKS)) {
        mood = (unsigned)drawn(4);
    }
    if (machine_strikes(RATIO_STRIKES, RATIO_CLOCKS)) {
        // Between a quarter and two and a half times as fast as the system. A word of the wire is four bytes.
        eth_half = 400 + drawn(3600);
#if MATCHER_CLOCK
        matcher_half = 400 + drawn(3600);
#endif
        machine_counts.ratios++;
    }
    error_due |= machine_strikes(ERROR_STRIKES, ERROR_CLOCKS) != 0;
}

// An edge of the matcher's separate clock, if it has one and that edge comes first.
bool step_of_matcher()
{
#if MATCHER_CLOCK
    if (next_matcher < next_sys && next_matcher < next_eth) {
        next_matcher += matcher_half;
        core->matcher_clk = !core->matcher_clk;
        core->eval();
        return true;
    }
#endif
    return false;
}

// One edge of one clock, whichever comes first.
void step()
{
    if (step_of_matcher()) {
        return;
    }

    bool of_sys = next_sys <= next_eth;

    now = of_sys ? next_sys : next_eth;
    if (of_sys) {
        next_sys += SYS_HALF;
        core->sys_clk = !core->sys_clk;
        core->eval();
        if (core->sys_clk) {
            machine_counts.clocks++;
            for (Port *port : ports) {
                port->clock();
            }
            if (machine_counts.clocks % 256 == 0) {
                disturb();
            }
        }
    } else {
        next_eth += eth_half;
        core->eth_clk = !core->eth_clk;
        core->eval();
        machine_counts.wire_clocks += core->eth_clk;
        wire_module.tick(wire, now);
    }
}

void sys_clock()
{
    uint64_t before = machine_counts.clocks;

    while (machine_counts.clocks == before) {
        step();
    }
}

void interrupt()
{
    if (!in_interrupt && (core->stereo_irq || core->watchdog_irq)) {
        in_interrupt = true;
        if (core->watchdog_irq) {
            machine_watchdog_interrupt();
        }
        machine_stereo_interrupt();
        in_interrupt = false;
    }
}

uint32_t access(uint32_t address, bool write, uint32_t value)
{
    core->host_adr = address / 4;
    core->host_dat_w = value;
    core->host_sel = 0xf;
    core->host_we = write;
    core->host_cyc = core->host_stb = 1;
    core->eval();
    for (unsigned clocks = 0; !core->host_ack; clocks++) {
        if (clocks == 1000 || core->host_err) {
            fail("no answer from the register", address);
        }
        sys_clock();
        if (core->in_reset) {
            core->host_cyc = core->host_stb = 0;
            in_interrupt = false;
            while (core->in_reset) {
                sys_clock();
            }
            machine_restart();
        }
    }
    uint32_t result = core->host_dat_r;
    sys_clock();
    core->host_cyc = core->host_stb = 0;
    core->eval();
    interrupt();
    return result;
}

}  // namespace

int machine_strikes(unsigned fault, uint32_t clocks)
{
    if (machine_counts.clocks < due[fault]) {
        return 0;
    }
    bool first = due[fault] == 0;
    due[fault] = machine_counts.clocks + (clocks / 2 + drawn(clocks)) / hurry;
    return !first;
}

void machine_begin(uint64_t seed, uint32_t haste)
{
    hurry = haste;
    random_state = seed * 2 + 1;
    for (int number = 0; number < 16; number++) {
        drawn(2);
    }
    memory = (uint8_t *)mmap((void *)(uintptr_t)MACHINE_MEMORY_BASE, MACHINE_MEMORY_SIZE, PROT_READ | PROT_WRITE,
        MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED_NOREPLACE, -1, 0);
    if (memory == MAP_FAILED) {
        fail("no memory at", MACHINE_MEMORY_BASE);
    }
    core = new Vcore{&context};
    ports[0] = PORT(0, core->ram0_we);
    ports[1] = PORT(1, core->ram1_we);
    ports[2] = PORT(2, core->ram2_we);
    ports[3] = PORT(3, core->ram3_we);
    connect_wire();
    core->eval();
    do {
        sys_clock();
    } while (core->in_reset);
}

uint32_t machine_read(uint32_t address)
{
    return access(address, false, 0);
}

void machine_write(uint32_t address, uint32_t value)
{
    access(address, true, value);
}

void machine_run(uint32_t clocks)
{
    while (clocks-- > 0) {
        sys_clock();
        interrupt();
    }
}
