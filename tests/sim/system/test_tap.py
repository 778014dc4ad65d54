#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The SoC's Ethernet against an independent implementation, the kernel's network stack, over LiteX's own TAP module."""

import json
import sys

import pytest

from support.namespace import run_in_namespace
from support.paths import CHECKOUT

TAP_HOST = CHECKOUT / "tests" / "support" / "tap_host.py"


@pytest.mark.long
@pytest.mark.system
def test_kernel_talks_to_the_soc():
    """The kernel resolves the address, pings, and exchanges a hello over UDP."""
    seen = json.loads(run_in_namespace([sys.executable, TAP_HOST, "integrated-ram"], timeout_s=600).splitlines()[-1])
    assert seen == {"pings": [True, True, True], "hello": True, "hardware_address": "10:e2:d5:00:00:02"}
