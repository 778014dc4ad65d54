#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

PYTHON := .venv/bin/python
# Where `make sim` listens, and the main memory of its SoC: integrated-ram or sdram.
PORT     ?= 2000
UDP_PORT ?= 19539
RAM      ?= integrated-ram
# What `make test` runs, and how many of the tests at once.
TESTS ?= tests
JOBS  ?= 2

export LITESTEREO_BUILD := $(CURDIR)/build

.DEFAULT_GOAL := help

help: ## Show the targets
	@awk -F ':.*## ' '/^[a-z]+:.*## / {printf "%-9s %s\n", $$1, $$2}' Makefile

install: ## Install what is missing: Debian packages, and Python packages in .venv
	@.ci/install

demo: install ## Match a real pair on the full system in simulation, and check every pixel
	@$(PYTHON) -m litestereo.sim.demo

test: install ## Run all tests, the linters first
	@$(PYTHON) -m ruff check .
	@$(PYTHON) -m mypy
	@$(PYTHON) -m pytest -n $(JOBS) --dist loadgroup $(TESTS)

sim: install ## Run the full system in simulation: udp://127.0.0.1:UDP_PORT, and its UART on tcp://127.0.0.1:PORT
	@$(PYTHON) -m litestereo.sim.serve --port $(PORT) --udp-port $(UDP_PORT) --ram $(RAM)

bench: install ## Measure clocks, print a table and write build/bench.json
	@$(PYTHON) -m litestereo.sim.bench

resources: ## Synthesize and place the matcher for several FPGAs, and write docs/resources.md
	@.ci/install fpga
	@$(PYTHON) -m litestereo.soc.resources

network: ## Synthesize and place the Ethernet part for an ECP5, check its clocks, and write docs/network.md
	@.ci/install fpga
	@$(PYTHON) -m litestereo.soc.network_timing

thesis: ## Measure a counterpart of every table and figure of the thesis, and write docs/thesis.md
	@.ci/install fpga
	@$(PYTHON) -m litestereo.sim.thesis

sweep: install ## Compare the matcher with cv2.StereoBM at 2000 settings instead of 200
	@LITESTEREO_SETTINGS=2000 $(PYTHON) -m pytest -n $(JOBS) --dist loadgroup tests/gateware/test_opencv.py

fuzz: install ## Ten million datagrams into the firmware, a hundred thousand into the gateware
	@$(MAKE) -s -f firmware/tests/Makefile OUT=$(LITESTEREO_BUILD)/fuzz fuzz_udp
	@$(LITESTEREO_BUILD)/fuzz/fuzz_udp 1 10000000
	@LITESTEREO_DATAGRAMS=100000 $(PYTHON) -m pytest -q -rP tests/gateware/test_frame_link_fuzz.py

lint: install ## Check style and types
	@$(PYTHON) -m ruff check .
	@$(PYTHON) -m mypy

clean: ## Remove everything that was built, but not .venv
	rm -rf build

.PHONY: help install demo test sim bench resources network thesis sweep fuzz lint clean
