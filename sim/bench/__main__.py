#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The command `python -m litestereo.sim.bench`."""

import sys

from .clocks import main

if __name__ == "__main__":
    sys.exit(main())
