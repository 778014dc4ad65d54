#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What the tests of the links share."""

import pytest

from litestereo.host_tools.link import timing


@pytest.fixture
def patient(monkeypatch):
    """No reply over UDP counts as late because this computer is busy."""
    monkeypatch.setattr(timing, "_FLOOR_S", 0.5)
