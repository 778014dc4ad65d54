#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

import pytest

from support.firmware_build import build_tests


@pytest.fixture(scope="session")
def programs():
    """Return the folder of the firmware's test programs, compiled for this computer."""
    return build_tests()
