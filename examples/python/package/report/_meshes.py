# SPDX-License-Identifier: MIT
"""Bones and structures as small meshes for the page."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
from numpy.typing import NDArray

import trephine

_VERTICES = 40000  # of a mesh at most: its triangles have 16-bit indices
_MARGIN = 12e-3  # around the tool's path, of a bone that is too large as a whole [m]
_COLOURS = [(230, 159, 0), (86, 180, 233), (0, 158, 115), (204, 121, 167), (213, 94, 0), (0, 114, 178), (240, 228, 66)]


def meshes_of(
    bone: trephine.Bone | None,
    after: trephine.Bone | None,
    segmentations: list[trephine.Labels],
    isovalue: float,
    positions: NDArray[Any],
) -> tuple[list[dict[str, Any]], str]:
    """Meshes as the page's script reads them, and sentences about what is left out.

    `positions` are those of the tool in the world, (N, 3) [m].
    """
    made: list[dict[str, Any]] = []
    notes = []
    for kind, one in (("before", bone), ("after", after)):
        if one is None:
            continue
        voxels, X_WG = one.voxels(), one.X_WG
        mesh = _mesh(voxels, one.spacing, isovalue, one.outside)
        if len(mesh.vertices) > _VERTICES:
            box = _around(positions, one)
            X_WG = X_WG @ _shift(one.spacing * [axis.start for axis in box[::-1]])
            voxels = voxels[box]
            notes.append(f"The bone {kind} is cut out around the tool's path.")
        packed, step = _fitting(voxels, one.spacing, X_WG, isovalue, one.outside)
        if step > 1:
            notes.append(f"Its mesh joins {step} voxels along each axis.")
        made.append({"kind": kind, "name": kind, **packed})
    for number, (name, labels, s) in enumerate((name, l, s) for l in segmentations for s, name in enumerate(l.names)):
        inside = labels.voxels == s + 1
        if inside.any():
            packed, _ = _fitting(_smooth(inside), labels.spacing, labels.X_WS, 0.5, 0)
            made.append({"kind": "structure", "name": name, "colour": _COLOURS[number % len(_COLOURS)], **packed})
    return made, " ".join(notes)


def removed_bone(session: trephine.Session, isovalue: float) -> trephine.Labels | None:
    """What a session removed of the bone that its log followed, as a structure in the world."""
    changes, bone = session.changes, session.bone
    gone = changes["index"][changes["density"] < isovalue]
    if bone is None or not len(gone):
        return None
    low = gone.min(axis=0)
    voxels = np.zeros(gone.max(axis=0) - low + 1, np.uint8)
    voxels[tuple((gone - low).T)] = 1
    return trephine.Labels(voxels, bone.spacing, bone.X_WG @ _shift(bone.spacing * low[::-1]), ["bone removed"])


def _mesh(voxels: NDArray[Any], spacing: NDArray[Any], level: float, outside: float) -> trephine.Mesh:
    return trephine.Bone(voxels, spacing, outside=outside, keep_original=False).mesh(level)


def _around(positions: NDArray[Any], bone: trephine.Bone) -> tuple[slice, ...]:
    """The voxels around positions that are in or near the bone, as slices along z, y, x."""
    X_GW = np.linalg.inv(bone.X_WG)
    voxels = (positions[np.isfinite(positions).all(axis=1)] @ X_GW[:3, :3].T + X_GW[:3, 3]) / bone.spacing
    size, margin = np.array(bone.shape[::-1]), _MARGIN / bone.spacing
    near = voxels[((voxels > -margin) & (voxels < size + margin)).all(axis=1)]
    low, high = (near.min(axis=0) - margin, near.max(axis=0) + margin) if len(near) else (0 * size, size)
    low, high = np.clip(np.floor(low), 0, size - 1).astype(int), np.clip(np.ceil(high), 1, size).astype(int)
    return tuple(slice(a, b) for a, b in zip(low[::-1], high[::-1]))


def _shift(by: NDArray[Any]) -> NDArray[Any]:
    X = np.eye(4)
    X[:3, 3] = by
    return X


def _fitting(voxels: NDArray[Any], spacing: NDArray[Any], X_WG: NDArray[Any], level: float, outside: float) -> tuple[Any, int]:
    """The finest mesh that is small enough, packed in the world's frame, and how many voxels it joins along an axis."""
    for step in range(1, 65):
        mesh = _mesh(_joined(voxels, step), step * spacing, level, outside)
        if len(mesh.vertices) <= _VERTICES:
            break
    X = X_WG @ _shift((step - 1) / 2 * spacing)
    return _packed(mesh.vertices @ X[:3, :3].T + X[:3, 3], mesh.triangles), step


def _joined(voxels: NDArray[Any], step: int) -> NDArray[Any]:
    """Means of blocks of `step` voxels along each axis."""
    if step == 1:
        return voxels
    padded = np.pad(voxels, [(0, -n % step) for n in voxels.shape], mode="edge").astype(np.float32)
    z, y, x = (n // step for n in padded.shape)
    means: NDArray[Any] = padded.reshape(z, step, y, step, x, step).mean(axis=(1, 3, 5))
    return means


def _smooth(inside: NDArray[Any]) -> NDArray[Any]:
    """A mask as densities whose surface at 0.5 has few steps, and no less within, however thin the structure is."""
    soft = inside.astype(np.float32)
    for axis in range(3):
        wide = np.pad(soft, [(1, 1) if a == axis else (0, 0) for a in range(3)])
        first, middle, last = (np.take(wide, range(k, k + soft.shape[axis]), axis) for k in range(3))
        soft = (first + 2 * middle + last) / 4
    made: NDArray[Any] = np.maximum(soft, 0.75 * inside).astype(np.float32)
    return made


def _packed(points: NDArray[Any], triangles: NDArray[Any]) -> dict[str, Any]:
    """Vertices as 16-bit steps from their least coordinates."""
    low = points.min(axis=0) if len(points) else np.zeros(3)
    step = max(float(np.ptp(points, axis=0).max()) if len(points) else 0.0, 1e-9) / 65535
    return {
        "low": low.tolist(),
        "step": step,
        "vertices": base64.b64encode(np.rint((points - low) / step).astype("<u2").tobytes()).decode(),
        "triangles": base64.b64encode(np.ascontiguousarray(triangles, "<u2").tobytes()).decode(),
    }
