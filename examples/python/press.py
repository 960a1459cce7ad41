#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Presses a tool onto bone and saves force over depth as CSV, with a picture where gnuplot or matplotlib is there."""

import argparse
import shutil
import subprocess
import sys

import numpy as np
import trephine


def picture(csv, png, depth, force):
    """Whether one was drawn."""
    if shutil.which("gnuplot"):
        draw = f"set terminal png; set output '{png}'; set datafile separator ','; set xlabel 'depth [mm]'; set ylabel 'force [N]'; "
        return subprocess.run(["gnuplot", "-e", draw + f"plot '{csv}' skip 1 with lines notitle"]).returncode == 0
    try:
        import matplotlib.pyplot as plot
    except ImportError:
        return False
    plot.plot(depth, force)
    plot.xlabel("depth [mm]")
    plot.ylabel("force [N]")
    plot.savefig(png)
    return True


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--renderer", default="coupled", help="coupled, line or surface")
    parser.add_argument("--radius", type=float, default=1.5, help="of the burr [mm]")
    parser.add_argument("--depth", type=float, default=1, help="to press to [mm]")
    parser.add_argument("--csv", default="press.csv")
    parser.add_argument("--png", help="a picture of the curve")
    options = parser.parse_args()

    spacing = 0.4e-3
    voxels = np.full((48, 48, 48), -1000, np.int16)
    voxels[:24] = 1200
    surface = (23 + 900 / 2200) * spacing  # where the density is 300
    bone = trephine.Bone(voxels, spacing)
    scene = trephine.Scene(bone, 300, trephine.Burr(tip_radius=options.radius * 1e-3), options.renderer)

    depth = np.linspace(-0.2, options.depth, 1001)  # mm
    poses = np.tile([0, 0, 0, 0, 0, 0, 1.0], (len(depth), 1))
    poses[:, :2] = 24 * spacing
    # Line's tip is the ball's centre, and the others' the ball's surface.
    poses[:, 2] = surface + (0 if options.renderer == "line" else options.radius * 1e-3) - 1e-3 * depth
    force = scene.run(poses, spindle=False)["force"][:, 2]

    np.savetxt(options.csv, np.stack([depth, force], axis=1), "%.6g", ",", header="depth_mm,force_N", comments="")
    print(f"{force[-1]:.3f} N at {depth[-1]:.2f} mm, {1e3 * force[-1] / depth[-1]:.0f} N/m; the curve is in {options.csv}")
    if options.png and not picture(options.csv, options.png, depth, force):
        sys.exit("press.py: a picture takes gnuplot or matplotlib")


if __name__ == "__main__":
    try:
        main()
    except (ValueError, OSError) as error:
        sys.exit(f"press.py: {error}")
