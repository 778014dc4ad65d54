#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A frame as one still image: left and right image, map, and depth."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from ..core.images import color_image
from ..live.matching import MatchedShot

#: Height of a caption in pixels.
_CAPTION_PX = 24

#: Share of the depths at either end that the colours do not distinguish, in percent.
_OUTLIERS = 2

Picture = NDArray[np.uint8]


def montage(matched: MatchedShot) -> Picture:
    """Build a still of a frame: left and right image above the map and, if there is one, the depth, with captions.

    Returns
    -------
    uint8, BGR: twice the width of the images, twice their height with a caption, 3 channels.
    """
    height, width = matched.shot.left.shape
    settings = matched.map.settings
    tiles    = [("left", _colour(matched.shot.left)), ("right", _colour(matched.shot.right)),
                (f"disparity, {settings.min_disparity} to {settings.min_disparity + settings.disparities - 1} pixels",
                 _grown(color_image(matched.map.disparity, settings), matched))]
    if matched.depth_m is not None:
        caption, colours = depth_tile(matched.depth_m)
        tiles.append((caption, _grown(colours, matched)))
    tiles        += [("", np.zeros((height, width, 3), np.uint8))]*(4 - len(tiles))
    captioned     = [np.vstack([_caption(name, width), picture]) for name, picture in tiles]
    return np.vstack([np.hstack(captioned[:2]), np.hstack(captioned[2:])])


def depth_tile(depth_m: NDArray[np.float32]) -> tuple[str, Picture]:
    """Return caption and colours of a depth (float32, H x W, metres): red is near, blue far, black where none is."""
    known = np.isfinite(depth_m)
    if not known.any():
        return "depth: none", np.zeros((*depth_m.shape, 3), np.uint8)
    near, far = np.percentile(depth_m[known], (_OUTLIERS, 100 - _OUTLIERS))
    nearness  = (far - np.nan_to_num(depth_m))/max(far - near, 1e-9)
    colour    = np.array(cv2.applyColorMap(np.clip(255*nearness, 0, 255).astype(np.uint8), cv2.COLORMAP_TURBO),
                         np.uint8)
    colour[~known] = 0
    return f"depth, {near:.2f} to {far:.2f} m", colour


def _grown(colours: Picture, matched: MatchedShot) -> Picture:
    """Return the colours of a map in the size of the images, black where the map has no pixel."""
    factor = matched.map.factor
    if factor == 1:
        return colours
    grown   = colours.repeat(factor, axis=0).repeat(factor, axis=1)
    picture = np.zeros((*matched.shot.left.shape, 3), np.uint8)
    picture[:grown.shape[0], :grown.shape[1]] = grown
    return picture


def _colour(image: NDArray[np.uint8]) -> Picture:
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR), np.uint8)


def _caption(text: str, width: int) -> Picture:
    strip = np.zeros((_CAPTION_PX, width, 3), np.uint8)
    cv2.putText(strip, text, (6, _CAPTION_PX - 8), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (255, 255, 255), 1, cv2.LINE_AA)
    return strip
