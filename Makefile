#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

# `make help` is made from this file: `##@` begins a group, the text after `##` describes a target, the names in brackets
# are the variables that the target takes, and `#:` describes the variable of the next line.

PYTHON := .venv/bin/python

#: TCP port of the serial line
PORT ?= 2000
#: UDP port of the device
UDP_PORT ?= 19539
#: main memory: integrated-ram or sdram; or a board, for that board's SoC
RAM ?= integrated-ram
#: hello_disparity, obstacle, throughput or recovery
EXAMPLE ?= hello_disparity
#: a board that `make boards` lists
BOARD ?= colorlight_i5
#: boards to simulate
BOARDS ?= colorlight_i5 colorlight_i9 ulx3s ecpix5 tang_primer_20k arty atlys
#: files or folders of tests
TESTS ?= tests
#: tests to run at a time
JOBS ?= 2
#: 1 to count the lines that the tests run
COUNT ?=
#: seconds per fuzz target
FUZZ_SECONDS ?= 60
#: number of frames
SOAK_FRAMES ?= 100000
#: what to break, if not everything: host, firmware, pixel-path, rectification, cameras, memory, link, crossings or peripheral
AREA ?=
#: faults of each area
FAULTS ?= 50

# The tests of a file share a simulator, so one worker runs them all. (pytest 9.2 ignores xdist's groups.)
BY_FILE := --dist loadfile --no-loadscope-reorder
COUNTED     := --cov=host_tools --cov=soc --cov=sim --cov-report=
BEGIN_COUNT  = $(if $(COUNT),--count-gateware $(COUNTED))
END_COUNT    = $(if $(COUNT),--count-gateware-on $(COUNTED) --cov-append)

export LITESTEREO_BUILD := $(CURDIR)/build
export COVERAGE_FILE    := $(LITESTEREO_BUILD)/python.coverage
# Proofs and campaigns are modules of tests/.
export PYTHONPATH       := $(CURDIR)/tests$(if $(PYTHONPATH),:$(PYTHONPATH))

# Variables of the command line are for this file only: the tests call other makefiles, which have their own TESTS.
MAKEOVERRIDES :=

.DEFAULT_GOAL := help

##@ Use

help: ## Show targets, and variables with their defaults
	@awk ' \
	FNR == 1 { pass++ } \
	pass == 1 && /^#: /               { described = substr($$0, 4) } \
	pass == 1 && /^[A-Z_]+ +\?=/      { name = $$1; sub(/^[A-Z_]+ +\?= */, ""); text[name] = described; value[name] = $$0 } \
	pass == 2 && /^##@ /              { printf "\n%s\n", substr($$0, 5) } \
	pass == 2 && /^[a-z-]+:.*## /     { split($$0, target, ":"); sub(/.*:.*## /, ""); taken = ""; \
	    if (match($$0, / \[.*\]$$/)) { taken = substr($$0, RSTART + 2, RLENGTH - 3); $$0 = substr($$0, 1, RSTART - 1) } \
	    printf "  %-14s %s\n", target[1], $$0; count = split(taken, names, " "); \
	    for (i = 1; i <= count; i++) printf "%17s%s=\"%s\": %s\n", "", names[i], value[names[i]], text[names[i]] }' \
	    Makefile Makefile

install: ## Install what is missing: Debian packages, and Python packages in .venv
	@.ci/install

demo: install ## Match a real pair on the full system in simulation, and check every pixel
	@$(PYTHON) -m litestereo.sim.demo

sim: install ## Run the full system in simulation until Ctrl-C [PORT UDP_PORT RAM]
	@$(PYTHON) -m litestereo.sim.system.serve --port $(PORT) --udp-port $(UDP_PORT) --ram $(RAM)

example: install ## Run a program of firmware/examples in simulation [EXAMPLE]
	@$(PYTHON) -m litestereo.sim.system.example $(EXAMPLE)

# A board that is named on the command line: the default is for other targets.
bench: install ## Measure clocks in simulation, print a table and write build/bench.json [BOARD]
	@$(PYTHON) -m litestereo.sim.bench $(if $(filter command,$(origin BOARD)),--board $(BOARD))

wheel: install ## Build the wheels into dist: with OpenCV, and without
	@$(PYTHON) .ci/wheel.py

clean: ## Remove all builds, but not .venv
	rm -rf build

##@ Test

test: lint ## Run the linters, then the tests that a person waits for [TESTS JOBS COUNT]
	@mkdir -p $(LITESTEREO_BUILD)
	@$(PYTHON) -m pytest -n $(JOBS) $(BY_FILE) $(BEGIN_COUNT) -m "not long" $(TESTS)

test-long: install ## Run the tests that make test leaves out [TESTS JOBS COUNT]
	@mkdir -p $(LITESTEREO_BUILD)
	@$(PYTHON) -m pytest -n $(JOBS) $(BY_FILE) $(END_COUNT) -m long $(TESTS)
	@$(if $(COUNT),$(PYTHON) -m campaigns.coverage.python --quiet)

lint: install ## Run the linters
	@$(PYTHON) -m ruff check .
	@$(PYTHON) -m mypy

ends: install ## Test the wheel with the oldest and the newest releases that it allows (needs a network)
	@$(PYTHON) .ci/ends.py

arm-check: install ## Match a pair with the packages for 64-bit Arm in qemu (needs a network and qemu-user)
	@$(PYTHON) .ci/arm_check.py

##@ Boards

boards: install ## List the boards and their presets
	@$(PYTHON) -m litestereo.soc.reports.boards list

bitstream: ## Build bitstream and firmware image into build/BOARD [BOARD]
	@.ci/install fpga
	@$(PYTHON) -m litestereo.soc.flow.target $(BOARD) --build

load: ## Load the bitstream into the FPGA until power-off [BOARD]
	@.ci/install fpga
	@$(PYTHON) -m litestereo.soc.flow.target $(BOARD) --load

flash: ## Write bitstream and firmware to the flash [BOARD]
	@.ci/install fpga
	@$(PYTHON) -m litestereo.soc.flow.target $(BOARD) --flash

boards-sim: install ## Boot the SoCs of boards in simulation, and match a real pair on each [BOARDS]
	@LITESTEREO_BOARDS="$(BOARDS)" $(PYTHON) -m pytest -q --timeout 0 tests/sim/system/test_boards.py

boards-check: ## Check that every bitstream is built from these sources, meets its clocks and fits before the firmware
	@.ci/install fpga
	@$(PYTHON) -m litestereo.soc.flow.check

##@ Documents

docs: ## Write the pages that are not made from this tree (hours)
	@.ci/install fpga
	@$(PYTHON) -m litestereo.sim.docs write

docs-check: ## Name the pages that are not made from this tree
	@.ci/install fpga
	@$(PYTHON) -m litestereo.sim.docs check

registers: install ## Write the register maps in docs, and the tables of settings and features
	@$(PYTHON) -m litestereo.soc.reports.registers
	@$(PYTHON) -m litestereo.soc.reports.tables

boards-doc: ## Write docs/boards.md from the bitstreams in build
	@.ci/install fpga
	@$(PYTHON) -m litestereo.soc.reports.boards

accuracy: install ## Match five Middlebury pairs with the presets of the boards, and write docs/accuracy.md
	@$(PYTHON) -m litestereo.sim.accuracy

filters: install ## Filter the maps of five Middlebury pairs, and write docs/filters.md
	@$(PYTHON) -m litestereo.sim.filters

resources: ## Synthesize and place the matcher, and write docs/resources.md
	@.ci/install fpga
	@$(PYTHON) -m litestereo.soc.reports.resources

network: ## Synthesize and place the Ethernet part, check its clocks, and write docs/network.md
	@.ci/install fpga
	@$(PYTHON) -m litestereo.soc.reports.network

thesis: ## Measure the tables and figures of the thesis, and write docs/thesis.md
	@.ci/install fpga
	@$(PYTHON) -m litestereo.sim.thesis

sbom: install ## Write the list of components: docs/sbom.cdx.json and docs/licences.md
	@$(PYTHON) -m litestereo.soc.release.sbom

coverage: ## Run all tests, and write docs/coverage.md: what they run of gateware, firmware and Python [JOBS]
	@$(MAKE) -s test COUNT=1 JOBS=$(JOBS)
	@$(MAKE) -s test-long COUNT=1 JOBS=$(JOBS)
	@$(PYTHON) -m campaigns.coverage

lock: ## Write .ci/lock: release and hashes of every Python package (needs a network)
	@.ci/relock

##@ Campaigns

sweep: install ## Compare with OpenCV: the matcher at 2000 settings instead of 200, the rectifier with 200 rigs instead of 12 [JOBS]
	@LITESTEREO_SETTINGS=2000 LITESTEREO_RIGS=200 $(PYTHON) -m pytest -n $(JOBS) tests/gateware/matcher/test_opencv.py \
		tests/sim/cores/test_drawn_rigs.py

formal: install ## Prove the promises of the gateware, and check that faulty cores fail the proofs
	@$(PYTHON) -m pytest -q tests/formal
	@$(PYTHON) -m formal

fuzz: install ## Send random datagrams: ten million to the firmware, a hundred thousand to the gateware
	@$(MAKE) -s -f firmware/tests/Makefile OUT=$(LITESTEREO_BUILD)/fuzz fuzz_udp
	@$(LITESTEREO_BUILD)/fuzz/fuzz_udp 1 10000000
	@LITESTEREO_DATAGRAMS=100000 $(PYTHON) -m pytest -q -rP tests/gateware/link/test_frame_link_fuzz.py

fuzz-firmware: install ## Fuzz the firmware with libFuzzer [FUZZ_SECONDS]
	@$(PYTHON) -m campaigns.fuzz.firmware --seconds $(FUZZ_SECONDS)

fuzz-host: install ## Fuzz the host tools' readers of files [FUZZ_SECONDS]
	@$(PYTHON) -m campaigns.fuzz.host --seconds $(FUZZ_SECONDS)

soak: install ## Match small frames while link, memory, clocks, firmware and host fail [SOAK_FRAMES]
	@$(PYTHON) -m campaigns.soak --frames $(SOAK_FRAMES)

mutation: install ## Put small faults into gateware, firmware and host tools, and check that the tests notice [AREA FAULTS JOBS]
	@$(PYTHON) -m campaigns.mutation $(if $(AREA),--areas $(AREA)) --count $(FAULTS) --jobs $(JOBS)

reproduce: install ## Build the firmware twice, in two folders, and compare the binaries
	@$(PYTHON) -m litestereo.soc.release.reproduce

.PHONY: help install demo sim example bench wheel clean test test-long lint ends arm-check boards bitstream load flash \
	boards-sim boards-check docs docs-check registers boards-doc accuracy filters resources network thesis sbom coverage lock sweep formal \
	fuzz fuzz-firmware fuzz-host soak mutation reproduce
