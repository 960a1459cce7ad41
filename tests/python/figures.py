#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""What bench/figures/python.csv holds, measured here; the build's target python_figures calls it."""

import argparse
import csv
import os
import platform
import statistics
import struct
import subprocess
import sys
import tempfile
import time

import numpy as np
import trephine as t
from block import SPACING, TOP, block, path
from test_scene import scene_of
from trephine import env

rows = []


def seconds(work):
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def tell(name, values, text, unit, set_):
    rows.append([name, text.format(statistics.median(values)), unit, set_])
    print(f"{name}: {rows[-1][1]} {unit} ({min(values):.3g} to {max(values):.3g})", flush=True)


def drilling():
    return scene_of("coupled", t.Bone(block(), SPACING))


def run_over_cpp(ticks):
    """`run` over the same loop in C++, by turns: 100 % where Python costs nothing."""
    z, y, x = block().shape
    start = path(1200)  # comes down and slides; from then on to and fro, in contact
    poses = np.concatenate([start] + [start[:699:-1], start[700:]] * (ticks // 1000))[:ticks]
    spindle = np.zeros(len(poses), bool)
    ratios = []
    with tempfile.TemporaryDirectory() as folder:
        with open(folder + "/input", "wb") as file:
            file.write(struct.pack("<4i3d", x, y, z, len(poses), *SPACING) + block().tobytes())
            file.write(poses.tobytes() + spindle.tobytes())
        for _ in range(5):
            ours = seconds(lambda: drilling().run(poses, spindle))
            loop = subprocess.run([os.environ["TREPHINE_SCENE"], "coupled", folder + "/input"], check=True,
                                  stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)  # fmt: skip
            ratios.append(100 * float(loop.stderr) / ours)
    tell("Speed of `run` over the loop in C++", ratios, "{:.0f}", "%", f"{len(poses):,} poses in contact, by turns")


def batch_over_one():
    poses = path(1500)
    ratios = []
    for _ in range(5):
        batch, single = t.Batch([drilling() for _ in range(64)]), [drilling() for _ in range(8)]
        one = seconds(lambda: [s.run(poses, True) for s in single]) / 8
        ratios.append(64 * one / seconds(lambda: batch.run(np.stack([poses] * 64), True)))
    tell("`Batch` over a scene alone", ratios, "{:.2f}", "times", f"64 scenes drill on {os.cpu_count()} cores")


def ticks_in_air():
    X_WT = np.eye(4)
    X_WT[:3, 3] = 9e-3, 10.5e-3, TOP + 5e-3

    def loop(tick):
        for _ in range(100_000):
            tick(X_WT)

    bare = t.Scene(t.Bone(block(), SPACING), 300, t.Burr(tip_radius=1.6e-3))
    for set_, scene in (("coupled tool alone", bare), ("with a cut and six stages", drilling())):
        rates = [1e-3 * 100_000 / seconds(lambda: loop(scene.tick)) for _ in range(5)]
        tell("`tick` in air" + (", every stage" if scene is not bare else ""), rates, "{:.0f}", "thousand/s", set_)


def restore():
    for task in ("crown", "mastoid"):
        drill = env.DrillEnv(task)
        times = []
        for seed in range(3):
            env.play(drill, env.scripted(task), seed=seed)
            times.append(1e3 * seconds(lambda: drill.reset(seed=seed)))
        tell(f"`DrillEnv.reset`, {task}", times, "{:.1f}", "ms", "after an episode, median of 3")


def install():
    load = [seconds(lambda: subprocess.run([sys.executable, "-c", "import trephine"], check=True)) for _ in range(9)]
    tell("Import", load, "{:.2f}", "s", "a process of its own, NumPy included")
    package = os.path.dirname(t.__file__)
    size = sum(os.path.getsize(os.path.join(d, f)) for d, _, files in os.walk(package) for f in files)
    tell("Installed", [size / 1e6], "{:.1f}", "MB", "the package's files, without NumPy")


def machine():
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        name = next((line.split(":")[1].strip() for line in file if line.startswith("model name")), platform.machine())
    return f"{name}, {os.cpu_count()} cores"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file")
    parser.add_argument("--ticks", type=int, default=1_000_000)
    arguments = parser.parse_args()
    run_over_cpp(arguments.ticks)
    batch_over_one()
    ticks_in_air()
    restore()
    install()
    with open(arguments.file, "w", newline="", encoding="utf-8") as out:
        csv.writer(out).writerows([["name", "value", "unit", "set", "machine"], *[row + [machine()] for row in rows]])
