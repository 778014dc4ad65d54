#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Boards that a pair of cameras is calibrated with: a chessboard, or one with markers (ChArUco)."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np
from cv2.typing import MatLike
from numpy.typing import NDArray

from ..core.errors import UsageError

#: Kinds of boards by their names on the command line.
KINDS = ("chessboard", "charuco")

#: Largest side of a square in metres; a larger number is one in millimetres.
_MAX_SQUARE_M = 1.0

#: Least and largest half side of the window that refines a corner, in pixels, and when the refinement stops.
_LEAST_REACH_PX = 2
_MOST_REACH_PX  = 8
_CRITERIA       = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 40, 1e-3)

#: How a chessboard is searched, one after the other. Equalizing the histogram helps with dark pictures, and hides
#: boards before a bright background; the older search finds some boards that are small or have a narrow margin.
_SEARCHES = (
    (cv2.findChessboardCornersSB, cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY),
    (cv2.findChessboardCornersSB, cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY),
    (cv2.findChessboardCorners,   cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE),
    (cv2.findChessboardCorners,   cv2.CALIB_CB_ADAPTIVE_THRESH),
)

#: Least number of corners: with fewer the pose of a board with markers is uncertain.
_MIN_CORNERS = 6


@dataclass(frozen=True, eq=False)
class Corners:
    """Corners of a board in an image: their numbers (int32, N) and positions (float32, N x 2, in pixels)."""

    ids:    NDArray[np.int32]
    pixels: NDArray[np.float32]


class Board(Protocol):
    """A board whose corners lie in one plane."""

    @property
    def points_m(self) -> NDArray[np.float32]:
        """Positions of the corners on the board, by their numbers: float32, N x 3, in metres, z is 0."""

    @property
    def rotations(self) -> tuple[NDArray[np.int64], ...]:
        """Orders of the corners' numbers, N each, in which the board looks the same: as it is, and rotated."""

    @property
    def hint(self) -> str:
        """What to check if the board is found in no image."""

    def find(self, image: NDArray[np.uint8]) -> Corners | None:
        """Return the corners in a grey image (uint8, H x W); None if the board is not found."""


def _grid_m(columns: int, rows: int, square_m: float) -> NDArray[np.float32]:
    """Return the positions of the inner corners, row by row: float32, N x 3, in metres."""
    points = np.zeros((rows*columns, 3), np.float32)
    points[:, :2] = np.mgrid[0:columns, 0:rows].T.reshape(-1, 2)*square_m
    return points


class Chessboard:
    """A chessboard of `columns` x `rows` inner corners, `square_m` metres apart; all of it must be visible."""

    def __init__(self, columns: int, rows: int, square_m: float) -> None:
        self._size = (columns, rows)
        self._grid = _grid_m(columns, rows, square_m)

    @property
    def points_m(self) -> NDArray[np.float32]:
        """See `Board`."""
        return self._grid

    @property
    def rotations(self) -> tuple[NDArray[np.int64], ...]:
        """See `Board`. Those of squares by quarters: OpenCV begins at any corner of such a board."""
        columns, rows = self._size
        numbers       = np.arange(columns*rows).reshape(rows, columns)
        return tuple(np.rot90(numbers, quarters).reshape(-1)
                     for quarters in (range(4) if columns == rows else (0, 2)))

    @property
    def hint(self) -> str:
        """See `Board`."""
        return f"{self._size[0]}x{self._size[1]} counts inner corners, one less than squares each way"

    def find(self, image: NDArray[np.uint8]) -> Corners | None:
        """See `Board`."""
        for search, flags in _SEARCHES:
            found, pixels = search(image, self._size, flags=flags)
            if found:
                break
        else:
            return None
        return Corners(np.arange(len(self._grid), dtype=np.int32), self._refined(image, pixels))

    def _refined(self, image: NDArray[np.uint8], pixels: MatLike) -> NDArray[np.float32]:
        """Refine corners to a fraction of a pixel, in windows that extend a third of the way to the next corner."""
        rows    = np.asarray(pixels, np.float32).reshape(self._size[1], self._size[0], 2)
        spacing = min(float(np.linalg.norm(np.diff(rows, axis=axis), axis=2).min()) for axis in (0, 1))
        reach   = max(_LEAST_REACH_PX, min(_MOST_REACH_PX, int(spacing/3)))
        moved   = cv2.cornerSubPix(image, rows.reshape(-1, 1, 2), (reach, reach), (-1, -1), _CRITERIA)
        return np.asarray(moved, np.float32).reshape(-1, 2)


class Charuco:
    """A ChArUco board of `columns` x `rows` squares with markers in them; a visible part is enough.

    `square_m` and `marker_m` are sides in metres. `dictionary` is OpenCV's number of the markers. `legacy` is for
    boards whose first square has a marker although the number of rows is even.
    """

    def __init__(self, columns: int, rows: int, square_m: float, marker_m: float, dictionary: int,
                 legacy: bool = False) -> None:
        markers        = cv2.aruco.getPredefinedDictionary(dictionary)
        self._board    = cv2.aruco.CharucoBoard((columns, rows), square_m, marker_m, markers)
        self._board.setLegacyPattern(legacy)
        self._legacy   = legacy
        self._detector = cv2.aruco.CharucoDetector(self._board)
        self._name     = f"{columns}x{rows}"

    @property
    def points_m(self) -> NDArray[np.float32]:
        """See `Board`."""
        return np.asarray(self._board.getChessboardCorners(), np.float32)

    @property
    def rotations(self) -> tuple[NDArray[np.int64], ...]:
        """See `Board`. None: markers tell which corner is which."""
        return ()

    @property
    def hint(self) -> str:
        """See `Board`."""
        legacy = "leave out" if self._legacy else "try"
        return (f"{self._name} counts squares, --dictionary must be that of the printed markers; {legacy} --legacy, "
                "for boards of calib.io and of OpenCV before 4.6")

    def find(self, image: NDArray[np.uint8]) -> Corners | None:
        """See `Board`."""
        pixels, ids, _, _ = self._detector.detectBoard(image)
        if ids is None or len(ids) < _MIN_CORNERS:
            return None
        return Corners(np.asarray(ids, np.int32).reshape(-1), np.asarray(pixels, np.float32).reshape(-1, 2))


def make_board(kind: str, size: str, square_m: float, marker_m: float | None = None,
               dictionary: str = "4X4_50", legacy: bool = False) -> Board:
    """Build a board from its description.

    Parameters
    ----------
    kind
        "chessboard" or "charuco".
    size
        "9x6": inner corners of a chessboard, squares of a ChArUco board.
    square_m, marker_m
        Sides of a square, above 0 and at most 1, and of a marker, below that of a square, in metres; a marker is 0.75
        of a square by default.
    dictionary
        Markers of a ChArUco board, as OpenCV names them, with or without its "DICT_".
    legacy
        Whether a ChArUco board is one of OpenCV before 4.6 or of calib.io: its first square has a marker even if the
        number of rows is even.

    Raises
    ------
    UsageError
        The kind, the size, a side or the dictionary is invalid, or the board has more markers than the dictionary.
    """
    if kind not in KINDS:
        raise UsageError(f"the pattern must be one of {', '.join(KINDS)}, not '{kind}'")
    numbers = re.fullmatch(r"(\d{1,3})x(\d{1,3})", size)
    if numbers is None or min(map(int, numbers.groups())) < 3:
        raise UsageError(f"the size of the pattern must be like 9x6, at least 3 each way, not '{size}'")
    columns, rows = map(int, numbers.groups())
    if not 0 < square_m <= _MAX_SQUARE_M:
        raise UsageError(f"a square must be above 0 and at most {_MAX_SQUARE_M:g} metres, not {square_m:g}: "
                         "25 mm are 0.025")
    if kind == "chessboard":
        if legacy:
            raise UsageError("--legacy goes with the pattern charuco: a chessboard has no markers")
        return Chessboard(columns, rows, square_m)
    marker_m = 0.75*square_m if marker_m is None else marker_m
    if not 0 < marker_m < square_m:
        raise UsageError(f"a marker must be smaller than its square of {square_m:g} metres, not {marker_m:g}")
    known  = {name.upper(): int(getattr(cv2.aruco, name)) for name in dir(cv2.aruco) if name.startswith("DICT_")}
    number = known.get(f"DICT_{dictionary.upper().removeprefix('DICT_')}")
    if number is None:
        raise UsageError(f"there are no markers named '{dictionary}': 4X4_50, 5X5_100 and 6X6_250 are usual")
    markers, needed = len(cv2.aruco.getPredefinedDictionary(number).bytesList), columns*rows//2
    if needed > markers:
        raise UsageError(f"a board of {size} squares has {needed} markers, {dictionary} only {markers}: see the print "
                         "for its dictionary")
    return Charuco(columns, rows, square_m, marker_m, number, legacy)
