#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Devices of which stages were left out."""

from __future__ import annotations

from litestereo.host_tools.core.features import ALL_STAGES, Feature
from litestereo.host_tools.devices.base import DeviceInfo
from litestereo.host_tools.devices.local import LocalDevice, ModelMatcher


def device_without(missing: Feature, disparities: int = 64, block_size: int = 21) -> LocalDevice:
    """The reference model that says that it lacks stages."""
    info = DeviceInfo("model:", "a part of the model", 2048, 2048, 1 << 22, disparities, 5, block_size,
                      features=int(ALL_STAGES & ~missing))
    return LocalDevice(info, ModelMatcher())
