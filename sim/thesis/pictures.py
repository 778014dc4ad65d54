#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Plots and disparity maps as small PNG files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

#: Pixels per inch of all pictures.
DPI = 100

#: Width and height of a plot, and width of a map in a row of maps; inches.
PLOT_SIZE = (7.0, 4.0)
MAP_WIDTH = 2.4

#: From blue (far) to red (near); black where there is no disparity.
COLOURS = colormaps["turbo"].with_extremes(bad="black")


@dataclass(frozen=True)
class Curve:
    """A line of a plot: its name, its points, and whether they are values from a publication."""
    name:      str
    x:         Sequence[float]
    y:         Sequence[float]
    published: bool = False


def plot(path: Path, curves: Sequence[Curve], x_label: str, y_label: str, logarithmic: bool = False) -> None:
    """Plot curves in one pair of axes; published values are points without a line."""
    figure = Figure(PLOT_SIZE, dpi=DPI, layout="constrained")
    axes   = figure.add_subplot()
    for curve in curves:
        style = {"linestyle": "none", "marker": "x", "color": "black"} if curve.published else {"marker": ".", "lw": 1}
        axes.plot(curve.x, curve.y, label=curve.name, **style)
    if logarithmic:
        axes.set_xscale("log")
        axes.set_yscale("log")
    else:
        axes.set_xticks(sorted({x for curve in curves for x in curve.x}))
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    axes.grid(True, which="both", alpha=0.3)
    axes.legend(fontsize="small")
    _save(figure, path)


def maps(path: Path, images: Sequence[tuple[str, NDArray[np.float32]]], largest: float, columns: int) -> None:
    """Draw disparity maps with their names, `columns` in a row.

    Parameters
    ----------
    path
        PNG file.
    images
        Name, and disparities in pixels (float32, H x W), nan where there is none, which becomes black.
    largest
        Disparity of the brightest colour, pixels.
    columns
        Maps in a row.
    """
    rows          = -(-len(images)//columns)
    height, width = images[0][1].shape
    figure        = Figure((MAP_WIDTH*columns, rows*(MAP_WIDTH*height/width + 0.3)), dpi=DPI, layout="constrained")
    for place, axes in enumerate(np.atleast_1d(figure.subplots(rows, columns)).ravel()):
        axes.set_axis_off()
        if place < len(images):
            name, pixels = images[place]
            axes.imshow(np.ma.masked_invalid(pixels), cmap=COLOURS, vmin=0, vmax=largest, interpolation="nearest")
            axes.set_title(name, fontsize=8)
    _save(figure, path)


def _save(figure: Figure, path: Path) -> None:
    """Save a picture without the version of matplotlib, so that equal pictures are equal files."""
    FigureCanvasAgg(figure)
    figure.savefig(path, metadata={"Software": None})
