#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Drills strokes over a nerve in a block of bone, and writes the session, its scores and a page that shows them."""

import sys

import numpy as np
import trephine
from trephine.report import write


def strokes(count, ticks, top):
    """Poses that stroke along x, each time a little deeper, and lift off between strokes."""
    whole = np.arange(0, count - 0.1, 1 / ticks)  # ends lifted
    part = whole % 1
    poses = np.tile(np.eye(4), (len(part), 1, 1))
    poses[:, :3, :3] = [[0.8, 0, 0.6], [0, 1, 0], [-0.6, 0, 0.8]]  # the hand holds the drill at a slant
    poses[:, 0, 3] = 10e-3 + 12e-3 * np.clip(np.minimum(part / 0.8, (0.95 - part) / 0.1), 0, 1)
    poses[:, 1, 3] = 16e-3 + 1e-3 * np.sin(0.8 * whole)
    lift = np.clip(np.minimum(part - 0.8, 1 - part) / 0.05, 0, 1)
    poses[:, 2, 3] = top + 1e-3 - 0.4e-3 * np.floor(whole + 0.1) + 7e-3 * lift
    return poses


def main():
    voxels = np.full((48, 64, 64), -1000, np.int16)  # z, y, x: air above,
    voxels[:24] = 1200  # bone below
    nerve = np.zeros(voxels.shape, np.uint8)
    nerve[10:14, 28:36, 8:56] = 1
    bone = trephine.Bone(voxels, spacing=0.5e-3)
    tool = trephine.Burr(tip_radius=2e-3)
    scene = trephine.Scene(bone, 300, tool, cut=trephine.AdvancingCut(speed=2e-3))
    warn = trephine.GuardedStructure(mode=trephine.GuardMode.WARN)
    watch = trephine.ProtectedStructure(guard=warn, veto=trephine.StructureVeto(mode=trephine.VetoMode.WATCH))
    scene.set_structures(trephine.Structures(nerve, bone.spacing), [watch])
    before = bone.copy()

    scores = trephine.Scores(force_limit=1.5)
    with trephine.SessionLog("session.log") as log:
        log.follow(bone, isovalue=300)
        scene.run(strokes(12, 1500, top=24 * 0.5e-3), log=log, scores=scores)
    scores.finish()
    totals, around = scores.totals, scores.around_structures
    print(f"{totals['strokes']} strokes with a mean of {totals['mean_force']:.2f} N, {totals['removed_mm3']:.0f} mm3 gone")
    print(f"{1e3 * around['distance'][0]:.1f} mm from the nerve, {around['breaches'][0]} breaches")

    labels = trephine.Labels(nerve, bone.spacing, bone.X_WG, ["nerve"])
    write("session.log", "session.html", before, structures=labels, tool=tool, force_limit=1.5)
    print("session.html shows it")


if __name__ == "__main__":
    try:
        main()
    except (ValueError, OSError) as error:
        sys.exit(f"drill_session.py: {error}")
