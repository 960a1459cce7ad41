#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Drills the same hole with each renderer, together on all cores, and prints forces and volumes beside each other.

Line's tip is the ball's centre, which feels nothing where the ball has cut the bone before it.
"""

import numpy as np
import trephine

spacing = 0.4e-3
voxels = np.full((60, 48, 48), -1000, np.int16)
voxels[:36] = 1200
top = (35 + 900 / 2200) * spacing
renderers = ["coupled", "line", "surface"]
radius = 1.5e-3
scenes = [
    trephine.Scene(trephine.Bone(voxels, spacing), 300, trephine.Burr(tip_radius=radius), renderer,
                   cut=trephine.AdvancingCut(speed=2e-3))
    for renderer in renderers
]  # fmt: skip

ticks = 3000  # down for two thirds of it, then out
depth = np.interp(np.arange(ticks), [0, 2000, 3000], [-0.3e-3, 3e-3, -3e-3])
poses = np.tile(np.eye(4), (len(scenes), ticks, 1, 1))
poses[..., :2, 3] = 24 * spacing
poses[..., 2, 3] = top + radius - depth
result = trephine.Batch(scenes).run(poses, spindle=True)

print(f"{'renderer':10}{'peak force':>12}{'bone removed':>16}{'ticks that are ok':>20}")
for renderer, force, removed, status in zip(renderers, result["force"], result["removed_mm3"], result["status"]):
    peak = np.linalg.norm(force, axis=1).max()
    ok = np.mean(status == trephine.Status.OK)
    print(f"{renderer:10}{peak:10.2f} N{removed.sum():12.1f} mm3{ok:20.1%}")
