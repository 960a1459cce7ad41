#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""A minute of drilling for everybody: poses, forces and removed bone in files of less than 1 MB, to compare with.

    one_minute.py [FOLDER]

writes one_minute.csv and, with h5py, one_minute.hdf5, and prints what each renderer makes of the same hand.

The bone, which a formula gives: 96 x 80 x 40 voxels of 0.4 mm, voxel (i, j, k) centred at 0.4 mm (i, j, k) in the world.
A plate of 5 mm lies between z = 4 mm and z = 9 mm. With d, the distance [mm] of a voxel's centre below the nearer face,
its density is 300 + 1500 d, cut off below -1000 and above 1500 and rounded to the nearest integer. Bone is at and above
300. The tool is a ball of 2 mm radius on a shaft, at its default measures.

The hand, at 1 kHz: each column of poses in the CSV is linear between its rows, which are 10 ms apart. The pose of tick
n is that at n ms: the ball's centre x, y, z [m] and a lean [rad] of the tool about the world's y axis. The spindle of a
tick is that of the row before it or at it. Columns of a renderer are its force on the tool [N] in the tick of the row,
in the world's axes, and the bone removed up to there [mm3]. The cut makes the surface recede by 1 mm/s at 1 N,
in proportion to the force, of at most 4 N.

The HDF5 file is in the tree of volumetric_drilling's recorder (trephine.hdf5), of the coupled tool, each tenth tick.
"""

from __future__ import annotations

import csv
import os
import sys
import tempfile
import time
from typing import Any, NamedTuple

import numpy as np
import trephine

SPACING, SIZE, ISOVALUE = 0.4e-3, (96, 80, 40), 300
BOTTOM, TOP, RADIUS = 4e-3, 9e-3, 2e-3  # of the plate and of the ball [m]
RENDERERS = ("coupled", "line", "surface")
EVERY = 10  # ticks between rows

# Each phase ends at a time [s], place x, y [m], depth of the ball below the plate's top [m], lean [rad], with the
# spindle as said; the hand goes there in a straight line.
PHASES: tuple[tuple[str, bool, tuple[tuple[float, float, float, float, float], ...]], ...] = (
    ("approach", False, ((4, 12e-3, 16e-3, -0.1e-3, 0),)),
    ("press", False, ((7, 12e-3, 16e-3, 3e-3, 0), (8, 12e-3, 16e-3, 2.5e-3, 0))),
    ("slide", False, ((11, 18e-3, 16e-3, 2.5e-3, 0.2), (14, 18e-3, 20e-3, 2.5e-3, 0.2), (17, 12e-3, 16e-3, 2.5e-3, 0))),
    ("drill", True, ((24, 12e-3, 16e-3, 4.5e-3, 0),)),
    ("lift", True, ((26, 12e-3, 16e-3, -2e-3, 0), (29, 22e-3, 12e-3, -0.5e-3, 0.1))),
    ("mill", True, tuple((29 + 1.5 * n, (22e-3, 30e-3)[n % 2], 12e-3 + 0.5e-3 * n, 0.25e-3 * n, 0.1) for n in range(1, 11))),
    ("return", True, ((46, 22e-3, 17e-3, -2e-3, 0), (48, 12e-3, 16e-3, -2e-3, 0), (50, 12e-3, 16e-3, 2.5e-3, 0))),
    ("break through", True, ((58, 12e-3, 16e-3, 9e-3, 0),)),
    ("leave", True, ((60, 12e-3, 16e-3, -6e-3, 0),)),
)  # fmt: skip
START = (0.0, 8e-3, 16e-3, -6e-3, 0.0)


class Hand(NamedTuple):
    """The rows of the poses' columns, 10 ms apart from 0 on, which the CSV holds."""

    place: np.ndarray  #: (R, 4) x, y, z [m], lean [rad]
    spindle: np.ndarray  #: (R,) bool


def bone() -> trephine.Bone:
    z = SPACING * np.arange(SIZE[2])
    density = np.clip(300 + 1.5e6 * np.minimum(z - BOTTOM, TOP - z), -1000, 1500)
    voxels = np.broadcast_to(np.rint(density)[:, None, None], SIZE[::-1])
    return trephine.Bone(voxels.astype(np.int16), SPACING)


def scene(renderer: str) -> trephine.Scene:
    return trephine.Scene(
        bone(), ISOVALUE, trephine.Burr(tip_radius=RADIUS), renderer, cut=trephine.AdvancingCut(speed=1e-3, reference_force=1)
    )


def hand() -> Hand:
    """The minute of PHASES, rounded as the CSV has it."""
    ends = np.array([START, *(end for _, _, ends in PHASES for end in ends)])
    moments = 1e-3 * EVERY * np.arange(round(1e3 * ends[-1, 0]) // EVERY + 1)
    place = np.stack([np.interp(moments, ends[:, 0], column) for column in ends[:, 1:].T], axis=1)
    place[:, 2] = TOP + RADIUS - place[:, 2]
    spindle = np.zeros(len(moments), bool)
    for (_, turns, _), (first, last) in zip(PHASES, spans()):
        spindle[(moments >= first) & (moments < last)] = turns
    return Hand(np.round(place, 7), spindle)


def spans() -> list[tuple[float, float]]:
    """First and last moment of each phase [s]."""
    lasts = [ends[-1][0] for _, _, ends in PHASES]
    return list(zip([0.0, *lasts], lasts))


def inputs(given: Hand) -> tuple[np.ndarray, np.ndarray]:
    """Poses (N, 7) and spindle (N,) of the ticks 1, 2, ... at 1 kHz."""
    ticks = np.arange(1, EVERY * (len(given.place) - 1) + 1) / EVERY
    place = np.stack([np.interp(ticks, np.arange(len(given.place)), column) for column in given.place.T], axis=1)
    half = place[:, 3] / 2
    poses = np.zeros((len(ticks), 7))
    poses[:, :3], poses[:, 4], poses[:, 6] = place[:, :3], np.sin(half), np.cos(half)
    return poses, given.spindle[ticks.astype(int)]


def write_csv(path: str, given: Hand, results: dict[str, dict[str, np.ndarray]]) -> None:
    """The rows of poses, each with the results of its tick; the first has none."""
    columns: dict[str, Any] = {"t": [f"{1e-3 * EVERY * row:.2f}" for row in range(len(given.place))]}
    for axis, name in enumerate(("x", "y", "z", "lean")):
        columns[name] = [f"{value:.7f}" for value in given.place[:, axis]]
    columns["spindle"] = given.spindle.astype(int)
    for renderer, result in results.items():
        for axis, name in enumerate("xyz"):
            columns[f"{renderer}_f{name}"] = ["0", *(f"{v:.4g}" for v in result["force"][EVERY - 1 :: EVERY, axis])]
        removed = np.cumsum(result["removed_mm3"])[EVERY - 1 :: EVERY]
        columns[f"{renderer}_mm3"] = ["0", *(f"{v:.5g}" for v in removed)]
    with open(path, "w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(columns)
        rows.writerows(zip(*columns.values()))


def read_csv(path: str) -> tuple[Hand, dict[str, np.ndarray]]:
    """The hand of a file, and all its columns."""
    table = np.genfromtxt(path, delimiter=",", names=True)
    columns = {name: np.asarray(table[name]) for name in table.dtype.names or ()}
    place = np.stack([columns[name] for name in ("x", "y", "z", "lean")], axis=1)
    return Hand(place, columns["spindle"] > 0), columns


def write_hdf5(path: str, given: Hand) -> None:
    from trephine import hdf5

    poses, spindle = inputs(given)
    with tempfile.TemporaryDirectory() as folder:
        file = os.path.join(folder, "session")
        drilled = scene("coupled")
        start = drilled.bone.voxels()
        with trephine.SessionLog(file) as log:
            log.follow(drilled.bone, ISOVALUE)
            for part in np.array_split(np.arange(len(poses)), 600):  # so that the log sees the bone now and then
                drilled.run(poses[part], spindle[part], log=log)
        hdf5.export(trephine.load_session(file), path, burrs={0: 2 * RADIUS}, voxels=start, every=EVERY)


def table(results: dict[str, dict[str, np.ndarray]], times: dict[str, float]) -> str:
    """Means and peaks of each phase."""
    lines = [f"{'':24}" + "".join(f"{name:>12}" for name in results)]

    def row(name: str, values: list[float], digits: int) -> None:
        lines.append(f"{name:24}" + "".join(f"{value:12.{digits}f}" for value in values))

    for (name, turns, _), (first, last) in zip(PHASES, spans()):
        part = slice(round(1e3 * first), round(1e3 * last))
        sizes = [np.linalg.norm(result["force"][part], axis=1) for result in results.values()]
        if max(size.max() for size in sizes) > 0:
            row(f"{name}: mean force [N]", [size.mean() for size in sizes], 2)
            row("  peak [N]", [size.max() for size in sizes], 2)
        if turns:
            row("  bone removed [mm3]", [result["removed_mm3"][part].sum() for result in results.values()], 1)
    steps = [np.linalg.norm(np.diff(result["force"], axis=0), axis=1).max() for result in results.values()]
    row("largest step [N]", steps, 2)
    row("bone removed [mm3]", [result["removed_mm3"].sum() for result in results.values()], 1)
    row("mean tick [us]", [times[name] for name in results], 1)
    return "\n".join(lines)


def main(folder: str) -> None:
    os.makedirs(folder, exist_ok=True)
    given = hand()
    results, times = {}, {}
    for renderer in RENDERERS:
        poses, spindle = inputs(given)
        made = scene(renderer)
        begin = time.perf_counter()
        results[renderer] = made.run(poses, spindle)
        times[renderer] = 1e6 * (time.perf_counter() - begin) / len(poses)
    names = [os.path.join(folder, "one_minute.csv")]
    write_csv(names[0], given, results)
    try:
        write_hdf5(os.path.join(folder, "one_minute.hdf5"), given)
        names.append(os.path.join(folder, "one_minute.hdf5"))
    except ImportError as error:
        print(error)
    print(table(results, times))
    for name in names:
        print(f"{name}: {os.path.getsize(name) / 1e6:.2f} MB")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else ".")
