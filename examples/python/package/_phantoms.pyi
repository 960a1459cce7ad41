# SPDX-License-Identifier: MIT
from typing import Any

from numpy import float64, uint8
from numpy.typing import ArrayLike, NDArray

TOOTH_ISOVALUE: float
TEMPORAL_STRUCTURES: dict[str, int]  # numbers of the columns of temporal_distances

def tooth_voxels(shape: tuple[int, int, int], spacing: float) -> NDArray[uint8]:
    """A molar in the middle of (z, y, x) voxels, its crown up."""

def tooth_distances(points: ArrayLike) -> NDArray[float64]:
    """Signed distances [m] of points (N, 3) from its outside, dentine and pulp; the origin is the middle of its neck."""

def temporal_bone() -> tuple[NDArray[Any], NDArray[float64], NDArray[float64], float]:
    """Voxels, spacing, X_WG and isovalue. W: z outward from the flat outer face, x forward, y up."""

def temporal_distances(points: ArrayLike) -> NDArray[float64]:
    """Signed distances [m] of points (N, 3) in W from each structure."""
