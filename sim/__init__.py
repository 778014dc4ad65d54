"""Reference model, Verilator co-simulation of the cores, and the full system in litex_sim."""
