#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Rectification by SoC, firmware and host tools in litex_sim: the calibration is in flash, the maps are OpenCV's."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from litestereo.host_tools.cameras.record import CalibrationRecord
from litestereo.host_tools.cameras.rectify import Rectifier
from litestereo.host_tools.core.errors import DeviceRefused
from litestereo.host_tools.core.grid import Grid
from litestereo.host_tools.core.settings import MatcherSettings
from litestereo.host_tools.devices.connect import connect
from litestereo.sim.system.simulation import start_simulation
from support.opencv import same_as_opencv
from support.pairs import generator, textured_pair
from support.rectification_maps import maps_of, opencv_remap, shifted
from support.rigs import lens_cameras

pytestmark = [pytest.mark.system, pytest.mark.long]

WIDTH, HEIGHT = 112, 120
SETTINGS      = MatcherSettings(16, 9)


def test_calibration_in_flash():
    """A calibration written over the link outlives a restart; stored and streamed frames are rectified by it."""
    rng    = generator(370)
    record = CalibrationRecord.of(Rectifier(*lens_cameras(rng, 44, 1, WIDTH, HEIGHT)))
    grids  = record.grids
    maps   = maps_of([grid.nodes for grid in grids], WIDTH, HEIGHT)
    lower  = Grid(WIDTH, HEIGHT, shifted(WIDTH, HEIGHT, 0, 100))
    apart  = dataclasses.replace(record, grids=(Grid(WIDTH, HEIGHT, shifted(WIDTH, HEIGHT, 0, 0)), lower))
    with start_simulation("rectifying") as simulation:
        url = f"udp://127.0.0.1:{simulation.udp_port}"
        with connect(url) as device:
            assert device.info().capabilities["rectification_rows"] == 96
            assert device.calibration() is None
            assert "no calibration" in device.rectification_gap(grids)
            device.write_calibration(record.encode())
            with pytest.raises(DeviceRefused, match="it needs 1[01]. rows of the images at once, the device keeps 96"):
                device.write_calibration(apart.encode())
            assert device.rectification_gap(grids) == ""
        with connect(f"tcp://127.0.0.1:{simulation.port}") as device:
            assert "requested" in device.console("reset", 200)
        with connect(url) as device:
            assert device.calibration() == record.encode()
            for streamed in (False, True):
                device.streamed = streamed
                pairs           = [textured_pair(WIDTH, HEIGHT, rng, shift) for shift in (3, 9)]
                results         = device.stream(pairs, SETTINGS, grids=grids, images=("left", "right"))
                for pair, result in zip(pairs, results, strict=True):
                    left, right = (opencv_remap(*one) for one in zip(pair, maps, strict=True))
                    assert np.array_equal(result.left, left) and np.array_equal(result.right, right)
                    same_as_opencv(result.disparity, left, right, SETTINGS)
                same_as_opencv(device.compute(*pairs[0], SETTINGS).disparity, *pairs[0], SETTINGS)
            device.erase_calibration()
            assert device.calibration() is None
