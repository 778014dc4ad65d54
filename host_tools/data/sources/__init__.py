#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Sources of pairs of images: folders, video files and cameras."""

from .base import Shortfall, Shot, Source
from .opening import EXAMPLES, open_source

__all__ = ["EXAMPLES", "Shortfall", "Shot", "Source", "open_source"]
