#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""A made-up pair of cameras whose lenses distort, and the scene: boards, a plane, a box."""

from __future__ import annotations

import functools
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

WIDTH, HEIGHT = 480, 360
FOCAL_PX      = 420.0
BASELINE_M    = 0.1
SQUARE_M      = 0.025

#: Rays per pixel, in each direction.
_RAYS = 2

Vector = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Surface:
    """A rectangle: a corner and two sides as vectors, in metres, and the picture on it (uint8, H x W)."""

    corner:  Vector
    across:  Vector
    down:    Vector
    picture: NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Camera:
    """A camera at `place` (3, metres); the columns of `rotation`, 3 x 3, are its axes in world coordinates."""

    matrix:     Vector
    distortion: Vector
    rotation:   Vector
    place:      Vector
    rays:       Vector = field(init=False)

    def __post_init__(self) -> None:
        steps  = (np.arange(WIDTH*_RAYS) + 0.5)/_RAYS - 0.5, (np.arange(HEIGHT*_RAYS) + 0.5)/_RAYS - 0.5
        pixels = np.stack(np.meshgrid(*steps), -1).reshape(-1, 1, 2)
        plane  = cv2.undistortPoints(pixels, self.matrix, self.distortion).reshape(-1, 2)
        rays   = np.column_stack([plane, np.ones(len(plane))]) @ self.rotation.T
        object.__setattr__(self, "rays", rays)

    def image(self, surfaces: list[Surface]) -> NDArray[np.uint8]:
        """Return the camera's image, grey where there is nothing."""
        seen, _ = trace(self.place, self.rays, surfaces)
        fine    = seen.reshape(HEIGHT*_RAYS, WIDTH*_RAYS)
        return np.rint(cv2.resize(fine, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA)).astype(np.uint8)


def trace(place: Vector, rays: Vector, surfaces: list[Surface]) -> tuple[NDArray[np.float32], Vector]:
    """Trace `rays` (N x 3) from `place`; return grey values, and distances in lengths of a ray, inf for a miss.

    N is a multiple of WIDTH, as OpenCV requires.
    """
    seen, nearest = np.full(len(rays), 90, np.float32), np.full(len(rays), np.inf)
    for surface in surfaces:
        normal = np.cross(surface.across, surface.down)
        with np.errstate(divide="ignore"):
            times = normal @ (surface.corner - place)/(rays @ normal)
        there  = place + rays*times[:, None] - surface.corner
        across = there @ surface.across/(surface.across @ surface.across)
        down   = there @ surface.down/(surface.down @ surface.down)
        hit    = (times > 0) & (times < nearest) & (abs(across - 0.5) <= 0.5) & (abs(down - 0.5) <= 0.5)
        height, width = surface.picture.shape
        # Pixels of a picture are areas: the centre of the first one is half a pixel from the edge.
        maps   = [(values - 0.5).astype(np.float32).reshape(-1, WIDTH) for values in (across*width, down*height)]
        values = cv2.remap(surface.picture.astype(np.float32), *maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        seen[hit], nearest[hit] = values.reshape(-1)[hit], times[hit]
    return seen, nearest


@functools.cache
def cameras() -> tuple[Camera, Camera]:
    """Return the pair: the right camera is slightly rotated, and has a different lens."""
    rotation = cv2.Rodrigues(np.radians([0.4, -0.9, 0.3]))[0]
    left     = np.array([[FOCAL_PX, 0, 243.0], [0, FOCAL_PX + 1, 176.0], [0, 0, 1]])
    right    = np.array([[FOCAL_PX + 3, 0, 236.0], [0, FOCAL_PX + 2, 182.0], [0, 0, 1]])
    return (Camera(left, np.array([-0.18, 0.06, 0.0008, -0.0005, 0.0]), np.eye(3), np.zeros(3)),
            Camera(right, np.array([-0.15, 0.04, -0.0006, 0.0007, 0.0]), rotation,
                   np.array([BASELINE_M, 0.0, 0.0])))


def flat(picture: NDArray[np.uint8], width_m: float, middle: Vector, degrees: Vector) -> Surface:
    """Return a surface around `middle`, rotated by `degrees` about the three axes; its height is the picture's."""
    rotation = cv2.Rodrigues(np.radians(degrees))[0]
    across   = rotation @ np.array([width_m, 0, 0])
    down     = rotation @ np.array([0, width_m*picture.shape[0]/picture.shape[1], 0])
    return Surface(np.asarray(middle, np.float64) - across/2 - down/2, across, down, picture)


def chessboard(columns: int = 9, rows: int = 6, square_px: int = 24) -> NDArray[np.uint8]:
    """Return a chessboard of `columns` x `rows` inner corners with a white margin of a square."""
    squares = np.indices((rows + 1, columns + 1)).sum(axis=0) % 2
    picture = np.kron(np.pad(squares, 1, constant_values=1), np.ones((square_px, square_px)))
    return (20 + 215*picture).astype(np.uint8)


def board_places(rng: np.random.Generator, count: int) -> list[tuple[Vector, Vector]]:
    """Return centres (metres) and rotations (degrees) of a board that both cameras see whole, all over their images."""
    grid = [(x, y) for y in (-0.12, 0.0, 0.12) for x in (-0.12, -0.04, 0.04, 0.12)]
    return [(np.array([BASELINE_M/2 + x, y, rng.uniform(0.52, 0.68)]), rng.uniform((-28, -28, -12), (28, 28, 12)))
            for x, y in (grid*count)[:count]]


def take(folder: Path, name: str, surfaces: list[Surface]) -> tuple[Path, Path]:
    """Write the images of both cameras as left/NAME.png and right/NAME.png below `folder`."""
    paths = folder/"left"/f"{name}.png", folder/"right"/f"{name}.png"
    for path, camera in zip(paths, cameras(), strict=True):
        path.parent.mkdir(parents=True, exist_ok=True)
        cv2.imwrite(str(path), camera.image(surfaces))
    return paths
