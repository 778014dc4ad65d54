#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The folder of the checkout."""

from pathlib import Path

CHECKOUT = Path(__file__).resolve().parents[2]
