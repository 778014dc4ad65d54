#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""libFuzzer finds no fault in the firmware, and finds a planted one."""

import os
import shutil
import subprocess

import pytest

from campaigns.fuzz.firmware import CORPUS, LENGTHS, TARGETS, FuzzError, build, judged, run
from support.pairs import SEED

pytestmark = pytest.mark.skipif(not shutil.which("clang"), reason="no clang: .ci/install")

#: Seconds per target in the long test, and in the short one.
SECONDS, FEW_SECONDS = int(os.environ.get("LITESTEREO_FUZZ_SECONDS", "60")), 5

#: Least number of executions per second on a busy computer.
SLOWEST = {"calibration": 20, "cobs": 500, "message": 500, "pool": 500, "records": 20, "session": 50}

#: Edges that the corpus must reach, so that a target that stops early is noticed.
EDGES = {"calibration": 380, "cobs": 65, "message": 45, "pool": 200, "records": 215, "session": 900}


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("seconds", [FEW_SECONDS, pytest.param(SECONDS, marks=pytest.mark.long)])
def test_no_fault(target, seconds):
    result = run(target, seconds, SEED)
    assert result.crash is None, str(result)
    assert result.executions >= seconds*SLOWEST[target], str(result)
    assert result.edges >= EDGES[target], str(result)


@pytest.mark.parametrize("target", TARGETS)
def test_a_planted_fault_is_found(target):
    """The input that found the planted fault makes the target fail again, but not the target without the fault."""
    result = run(target, 60, planted=True)
    assert result.crash is not None, str(result)
    assert result.complaint
    assert f"FAULT: {result.complaint}: {result.crash}" in str(result)
    try:
        assert repeated(target, result.crash, planted=True) != 0
        assert repeated(target, result.crash, planted=False) == 0
    finally:
        result.crash.unlink()


def repeated(target, path, planted):
    command = [build(target, planted), path]
    return subprocess.run(command, capture_output=True, timeout=600, check=False).returncode


@pytest.mark.parametrize("target", TARGETS)
def test_the_corpus_is_small(target):
    files = list((CORPUS / target).iterdir())
    assert 0 < len(files) <= 50
    assert max(path.stat().st_size for path in files) <= LENGTHS[target]


def test_a_target_that_does_not_run_is_no_success():
    with pytest.raises(FuzzError, match="ended with status 1: no such folder"):
        judged("cobs", 1, "INFO: begun\nno such folder\n")
