#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

PYTHON := .venv/bin/python
# Where `make sim` listens, and the main memory of its SoC: integrated-ram, sdram, or a board for its own.
PORT     ?= 2000
UDP_PORT ?= 19539
RAM      ?= integrated-ram
# Board of `make bitstream`, `load` and `flash`: one of `make boards`.
BOARD ?= colorlight_i5
# Boards of `make boards-sim`.
BOARDS ?= colorlight_i5 colorlight_i9 ulx3s ecpix5 tang_primer_20k arty atlys
# Program of `make example`.
NAME ?= hello_disparity
# Seconds of each target of `make fuzz-firmware`.
SECONDS ?= 60
# What `make test` runs, and how many of the tests at once.
TESTS ?= tests
JOBS  ?= 2
# The tests of a file share a simulator, so one worker runs them all. (pytest 9.2 takes no notice of xdist's groups.)
BY_FILE := --dist loadfile --no-loadscope-reorder
# Frames of `make soak`.
N     ?= 100000
# COUNT=1 counts what all tests run: `make test` begins, `make test-long` goes on, and fails below the floors.
COUNT ?=
BEGIN_COUNT = $(if $(COUNT),--count-gateware --cov=host_tools --cov-report=)
END_COUNT   = $(if $(COUNT),--count-gateware-on --cov=host_tools --cov-append --cov-report= --cov-fail-under=90)

export LITESTEREO_BUILD := $(CURDIR)/build
export COVERAGE_FILE    := $(LITESTEREO_BUILD)/host_tools.coverage

# What is set on the command line is for this file alone: the tests call other makefiles, which have a TESTS of their own.
MAKEOVERRIDES :=

.DEFAULT_GOAL := help

help: ## Show the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "%-14s %s\n", $$1, $$2}' Makefile

install: ## Install what is missing: Debian packages, and Python packages in .venv
	@.ci/install

demo: install ## Match a real pair on the full system in simulation, and check every pixel
	@$(PYTHON) -m litestereo.sim.demo

test: lint ## Run the linters, and the tests that a person waits for
	@mkdir -p $(LITESTEREO_BUILD)
	@$(PYTHON) -m pytest -n $(JOBS) $(BY_FILE) $(BEGIN_COUNT) -m "not long" $(TESTS)

test-long: install ## Run the tests that make test leaves out
	@mkdir -p $(LITESTEREO_BUILD)
	@$(PYTHON) -m pytest -n $(JOBS) $(BY_FILE) $(END_COUNT) -m long $(TESTS)

sim: install ## Run the full system in simulation: udp://127.0.0.1:UDP_PORT, and its UART on tcp://127.0.0.1:PORT
	@$(PYTHON) -m litestereo.sim.system.serve --port $(PORT) --udp-port $(UDP_PORT) --ram $(RAM)

example: install ## Run a program of firmware/examples in simulation: NAME=hello_disparity, obstacle, throughput or recovery
	@$(PYTHON) -m litestereo.sim.system.example $(NAME)

bench: install ## Measure clocks, print a table and write build/bench.json
	@$(PYTHON) -m litestereo.sim.bench

resources: ## Synthesize and place the matcher for several FPGAs, and write docs/resources.md
	@.ci/install fpga
	@$(PYTHON) -m litestereo.soc.reports.resources

network: ## Synthesize and place the Ethernet part for an ECP5, check its clocks, and write docs/network.md
	@.ci/install fpga
	@$(PYTHON) -m litestereo.soc.reports.network

thesis: ## Measure a counterpart of every table and figure of the thesis, and write docs/thesis.md
	@.ci/install fpga
	@$(PYTHON) -m litestereo.sim.thesis

boards: install ## List the boards and what is built for each
	@$(PYTHON) -m litestereo.soc.reports.boards list

bitstream: ## Build the bitstream and the firmware's image for BOARD with Yosys and nextpnr, into build/BOARD
	@.ci/install fpga
	@$(PYTHON) -m litestereo.soc.flow.target $(BOARD) --build

load: ## Load the bitstream into BOARD, until its power is off
	@.ci/install fpga
	@$(PYTHON) -m litestereo.soc.flow.target $(BOARD) --load

flash: ## Write bitstream and firmware to the flash of BOARD
	@.ci/install fpga
	@$(PYTHON) -m litestereo.soc.flow.target $(BOARD) --flash

boards-sim: install ## Boot each board's own SoC in simulation, and match a real pair on it
	@LITESTEREO_BOARDS="$(BOARDS)" $(PYTHON) -m pytest -q --timeout 0 tests/sim/system/test_boards.py

boards-check: ## Check that every bitstream is of these sources, and meets its clocks
	@.ci/install fpga
	@$(PYTHON) -m litestereo.soc.flow.check

boards-doc: ## Write docs/boards.md from the bitstreams that are built
	@.ci/install fpga
	@$(PYTHON) -m litestereo.soc.reports.boards

reproduce: install ## Build the firmware twice, from copies of all sources in two folders, and compare the binaries
	@$(PYTHON) -m litestereo.soc.release.reproduce

sbom: install ## Write docs/sbom.cdx.json and docs/licences.md: what the products are made of, and its licences
	@$(PYTHON) -m litestereo.soc.release.sbom

sweep: install ## Compare the matcher with cv2.StereoBM at 2000 settings instead of 200
	@LITESTEREO_SETTINGS=2000 $(PYTHON) -m pytest -n $(JOBS) tests/gateware/matcher/test_opencv.py

fuzz: install ## Ten million datagrams into the firmware, a hundred thousand into the gateware
	@$(MAKE) -s -f firmware/tests/Makefile OUT=$(LITESTEREO_BUILD)/fuzz fuzz_udp
	@$(LITESTEREO_BUILD)/fuzz/fuzz_udp 1 10000000
	@LITESTEREO_DATAGRAMS=100000 $(PYTHON) -m pytest -q -rP tests/gateware/link/test_frame_link_fuzz.py

coverage: ## Run all tests, and write what they have run of gateware, firmware and host tools to docs/coverage.md
	@$(MAKE) -s test COUNT=1
	@$(MAKE) -s test-long COUNT=1
	@PYTHONPATH=tests $(PYTHON) -m campaigns.coverage

soak: install ## Have N small frames matched while link, memory, clocks, firmware and host fail; none may be lost
	@PYTHONPATH=tests $(PYTHON) -m campaigns.soak --frames $(N)

fuzz-firmware: install ## Have libFuzzer look for faults of the firmware, SECONDS of each target
	@PYTHONPATH=tests $(PYTHON) -m campaigns.fuzz.firmware --seconds $(SECONDS)

formal: install ## Prove what the streams, the DMA and the registers of the gateware promise, and refuse faulty ones
	@$(PYTHON) -m pytest -q tests/formal
	@PYTHONPATH=tests $(PYTHON) -m formal

mutation: install ## Break the gateware in 50 small ways, and see whether the tests of the broken core notice
	@PYTHONPATH=tests $(PYTHON) -m campaigns.mutation

lock: ## Write .ci/lock: the release of every Python package, with the hashes of its files (needs a network)
	@.ci/relock

lint: install ## Check style and types
	@$(PYTHON) -m ruff check .
	@$(PYTHON) -m mypy

clean: ## Remove everything that was built, but not .venv
	rm -rf build

.PHONY: help install demo test test-long sim example bench resources network thesis boards bitstream load flash boards-sim \
	boards-check boards-doc reproduce sbom sweep fuzz fuzz-firmware coverage soak formal mutation lock lint clean
