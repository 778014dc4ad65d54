#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The commit from which figures were measured."""

import subprocess

from .paths import PACKAGE_DIR


def commit() -> str:
    """Return git's name of the checkout's state, or "unknown" without git."""
    git = subprocess.run(["git", "-C", str(PACKAGE_DIR), "describe", "--always", "--dirty"], capture_output=True,
                         text=True, check=False)
    return git.stdout.strip() or "unknown"
