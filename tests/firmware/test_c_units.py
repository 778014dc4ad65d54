#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Unit tests of the firmware, written in C: each program prints nothing and ends with 0 if all is well."""

import subprocess

import pytest

from support.firmware_build import UNITS
from support.paths import CHECKOUT


def run(*command):
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
    assert (done.returncode, done.stderr) == (0, ""), done.stdout
    return done.stdout


@pytest.mark.parametrize("unit", UNITS)
def test_unit(programs, unit):
    run(programs / unit)


@pytest.mark.parametrize("seed", range(2, 12))
def test_flood_of_bytes(programs, seed):
    """The whole firmware withstands noise from other seeds."""
    run(programs / "test_flood", str(seed))


@pytest.mark.parametrize("seed", range(1, 4))
def test_fuzz_of_datagrams(programs, seed):
    """Mailbox, link, session and frame pool withstand random and damaged datagrams; see `fuzz_udp.c` for more."""
    assert run(programs / "fuzz_udp", str(seed), "200000").startswith("200000 datagrams")


def test_vectors_of_the_host_tools(programs):
    """The firmware parses the host's messages and builds them again, byte for byte."""
    vectors = CHECKOUT / "tests" / "vectors" / "protocol.txt"
    command = [programs / "test_vectors", vectors]
    done    = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout == f"{len(vectors.read_text().splitlines())} vectors\n"


def test_a_wrong_vector_is_found(programs, tmp_path):
    name, message, framed = (CHECKOUT / "tests" / "vectors" / "protocol.txt").read_text().splitlines()[0].split()
    wrong = tmp_path / "wrong.txt"
    for line in (f"{name} {message[:-1]}0 {framed}", f"{name} {message} {framed[:-4]}0100", ""):
        wrong.write_text(line + "\n")
        done = subprocess.run([programs / "test_vectors", wrong], capture_output=True, text=True, check=False)
        assert done.returncode == 1
