#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Drills holes in a skull's vault at several places and feed rates, over Dask's workers, and saves a table.

`examples/run` fetches the skull. Where it is not there, a block with two plates and soft bone between is drilled.
"""

# %% The bone
from __future__ import annotations

import argparse
import plistlib
from pathlib import Path
from typing import Any

import numpy as np
import trephine
from trephine import study

ISOVALUE = 300
SKULL = Path("build/data/cranium")  # from the project's root: an unpacked project of InVesalius


def skull(folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Voxels (z, y, x) and spacing [m]; z is up."""
    plist = plistlib.loads((folder / "main.plist").read_bytes())
    voxels = np.fromfile(folder / "matrix.dat", "<i2").reshape(plist["matrix"]["shape"])
    return voxels[:, ::-1], 1e-3 * np.array(plist["spacing"])


def block() -> tuple[np.ndarray, np.ndarray]:
    """Two plates and soft bone between them, thicker toward x."""
    voxels = np.full((40, 64, 64), -1000, np.int16)
    for x in range(64):
        voxels[12 - x // 16 : 30, :, x] = 1300
        voxels[15 - x // 16 : 27, :, x] = 500
    return voxels, np.full(3, 0.8e-3)


# %% One hole
def hole(x: int, y: int, feed: float, voxels: np.ndarray, spacing: np.ndarray) -> dict[str, Any]:
    """Drills straight down at a column of voxels, as far as the bone there goes. `feed` is in m/s."""
    around = voxels[:, y - 14 : y + 15, x - 14 : x + 15]  # the bone within reach
    column = np.flatnonzero(around[:, 14, 14] >= ISOVALUE)[::-1]
    thickness = np.argmax(np.diff(column, append=-2) != -1) + 1  # voxels from the outer face down
    scene = trephine.Scene(trephine.Bone(around, spacing), ISOVALUE, trephine.Burr(tip_radius=3e-3, shaft_length=80e-3),
                           cut=trephine.AdvancingCut(speed=3e-3, reference_force=2))  # fmt: skip
    top = column[0] * spacing[2] + 4e-3
    depth = np.arange(0, 5e-3 + thickness * spacing[2] + 4e-3, 1e-3 * feed)
    poses = np.tile(np.eye(4), (len(depth), 1, 1))
    poses[:, :2, 3] = 14 * spacing[:2]
    poses[:, 2, 3] = top - depth
    ticks = scene.run(poses)
    cutting = np.flatnonzero(ticks["removed_mm3"])
    return {
        "thickness_mm": 1e3 * thickness * spacing[2],
        "peak_N": np.linalg.norm(ticks["force"], axis=1).max(),
        "removed_mm3": ticks["removed_mm3"].sum(),
        "cutting_s": 1e-3 * (cutting[-1] - cutting[0]) if len(cutting) else 0.0,
    }


# %% All of them
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--skull", type=Path, default=SKULL, help="folder of main.plist and matrix.dat")
    parser.add_argument("--places", type=int, default=3, help="along each axis")
    parser.add_argument("--feeds", type=float, nargs="+", default=[2, 4, 8], help="[mm/s]")
    parser.add_argument("--workers", type=int, default=2, help="processes of Dask; 0: none")
    parser.add_argument("--out", default="skull_study.csv", help=".csv or .h5; holes that it has are not drilled again")
    options = parser.parse_args()

    voxels, spacing = skull(options.skull) if (options.skull / "main.plist").exists() else block()
    _, ny, nx = voxels.shape
    x, y = (np.linspace(0.4 * n, 0.6 * n, options.places).astype(int).tolist() for n in (nx, ny))
    cases = {"x": x, "y": y, "feed": [1e-3 * feed for feed in options.feeds]}
    client = None
    if options.workers:
        from distributed import Client

        client = Client(n_workers=options.workers, threads_per_worker=1, dashboard_address=None)
    table = study.run(hole, cases, client=client, out=options.out, voxels=voxels, spacing=spacing)
    if client:
        client.shutdown()

    print("  ".join(f"{name:>12}" for name in table))
    for row in zip(*table.values()):
        print("  ".join(f"{value:12.4g}" if isinstance(value, (int, float)) else f"{value:>12}" for value in row))
    for feed in cases["feed"]:
        print(f"{1e3 * feed:g} mm/s: mean peak force {table['peak_N'][table['feed'] == feed].mean():.2f} N")


if __name__ == "__main__":
    main()
