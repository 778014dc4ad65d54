#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Where the checkout is."""

from pathlib import Path

CHECKOUT = Path(__file__).resolve().parents[2]
