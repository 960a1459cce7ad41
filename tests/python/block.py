# SPDX-License-Identifier: MIT
"""A block of bone and paths into it, for the tests."""

import numpy as np

SPACING = (0.5e-3, 0.6e-3, 0.4e-3)  # x, y, z
SHAPE = (50, 36, 40)  # z, y, x
TOP = (29 + 900 / 2200) * SPACING[2]  # of the bone, where density is 300


def block(dtype=np.int16):
    """Bone up to a plane, with air above."""
    low, high = (-1000, 1200) if np.dtype(dtype) in (np.int16, np.float32) else (0, 120)
    voxels = np.full(SHAPE, low, dtype)
    voxels[:30] = high
    return voxels


def tilted(x, y):
    """A rotation whose z leans by these angles."""
    cx, sx, cy, sy = np.cos(x), np.sin(x), np.cos(y), np.sin(y)
    return np.array([[cy, sx * sy, cx * sy], [0, cx, -sx], [-sy, sx * cy, cx * cy]])


def path(ticks=1500, radius=1.6e-3, to=-1e-3, lean=0.1):
    """Poses that come down to `to` below the surface and then move sideways, with the tool at a slant."""
    poses = np.tile(np.eye(4), (ticks, 1, 1))
    part = np.linspace(0, 1, ticks)
    poses[:, 0, 3] = 9e-3 + 1.5e-3 * np.clip(part - 0.7, 0, 1)
    poses[:, 1, 3] = 10.5e-3
    poses[:, 2, 3] = TOP + radius + 0.2e-3 - (0.2e-3 - to) * np.clip(part / 0.7, 0, 1)
    poses[:, :3, :3] = tilted(lean, -0.5 * lean)
    return poses


def quaternions(poses):
    """x y z qx qy qz qw of poses that turn by less than a right angle."""
    w = np.sqrt(1 + np.trace(poses[:, :3, :3], axis1=1, axis2=2)) / 2
    R = poses[:, :3, :3]
    q = np.stack([R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1) / (4 * w[:, None])
    return np.concatenate([poses[:, :3, 3], q, w[:, None]], axis=1)
