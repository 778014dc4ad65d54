#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The C tests run the firmware, and what they do not run is reported."""

import subprocess

import pytest

from campaigns.coverage import firmware
from support.firmware_build import build_for_coverage


@pytest.fixture(scope="module")
def measured():
    return firmware.measure()


@pytest.mark.long
def test_the_floors_hold(measured):
    lines, branches = firmware.totals(measured)
    page            = firmware.page(measured, missed=True)
    assert lines >= firmware.LINES_FLOOR, page
    assert branches >= firmware.BRANCHES_FLOOR, page


@pytest.mark.long
def test_every_source_is_measured(measured):
    """Every source is measured, or excluded with a reason; an excluded file exists and is not measured."""
    assert not firmware.unmeasured(measured)
    for name, reason in firmware.EXCLUDED.items():
        assert (firmware.FIRMWARE / name).is_file()
        assert name not in measured
        assert f"not measured: {name}: {reason}" in firmware.page(measured)


def test_what_is_not_run_is_seen():
    """The counts of two programs are below the floors, and without counts there is nothing to judge."""
    with build_for_coverage() as out:
        firmware.zero(out)
        with pytest.raises(firmware.CoverageError, match="nothing was counted"):
            firmware.read(out)
        subprocess.run([out / "test_cobs"], check=True)
        once = firmware.read(out)
        subprocess.run([out / "test_cobs"], check=True)
        twice = firmware.read(out)
        subprocess.run([out / "test_sectors"], check=True)
        more = firmware.read(out)
    assert set(once) == set(twice) == {"link/protocol/cobs.c"} < set(more)
    cobs = once["link/protocol/cobs.c"]
    assert cobs.lines_run == len(cobs.lines)
    assert twice["link/protocol/cobs.c"].lines == {line: 2*count for line, count in cobs.lines.items()}
    # The program calls one function of that file.
    missed = more["lib/stereo_settings.c"].missed_lines
    assert missed
    assert f"line {missed[0]} is not run" in firmware.page(more, missed=True)
    lines, branches = firmware.totals(more)
    assert lines < firmware.LINES_FLOOR
    assert branches < firmware.BRANCHES_FLOOR


@pytest.mark.long
def test_below_the_floor_is_a_failure(measured, monkeypatch, capsys):
    monkeypatch.setattr(firmware, "measure", lambda: measured)
    monkeypatch.setattr("sys.argv", ["coverage.firmware"])
    assert firmware.main() == 0
    monkeypatch.setattr(firmware, "LINES_FLOOR", 100.1)
    assert firmware.main() == 1
    assert "below the floor" in capsys.readouterr().err
