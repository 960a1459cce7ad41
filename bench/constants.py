# SPDX-License-Identifier: MIT
"""constants.py --build FOLDER --out FOLDER [--jobs N] [--only NAME ...]: the coupled tool's constants, each a fifth less and more.

Builds bench_coupled_figures against a copy of the headers in which one number is another, runs its quick set, and writes
constants.csv: each figure as it is and as it becomes."""

import argparse
import csv
import glob
import os
import re
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), ".."))
INCLUDE = os.path.join(ROOT, "include")
HEADERS = ["render/coupled/*.hpp", "voxel/bone_surface.hpp"]
DECLARED = re.compile(r"static constexpr (double|float|int) ([^;]*);")
NUMBER = re.compile(r"\b(k\w+) = ([\d.][\d.eEF/* +-]*)(?=,|;|$)")
# Numbers of their own: mathematics, a bound of options, and a margin that must be above 1.
LEFT_OUT = {"kPi", "kMost", "kRoundedUp", "kDof"}
UNNAMED = [("share of the core's radius", re.compile(r"core_radius (/ 2)\b"))]
FACTORS = (0.8, 1.2)


class Constant:
    """A number in a header: its name, the file, where it stands, and whether it is whole."""

    def __init__(self, name, path, start, end, text, whole):
        self.name, self.path, self.start, self.end, self.text, self.whole = name, path, start, end, text, whole

    def changed(self, factor):
        if self.text.startswith("/"):
            return f"* ({factor} {self.text})"
        if self.whole:
            return str(max(1, round(factor * int(self.text))))
        suffix = "F" if self.text.strip().endswith("F") else ""
        return f"({self.text.strip()} * {factor}{suffix})"


def constants():
    found = []
    for pattern in HEADERS:
        for path in sorted(glob.glob(os.path.join(INCLUDE, "trephine", pattern))):
            with open(path, encoding="utf-8") as file:
                text = file.read()
            for declared in DECLARED.finditer(text):
                whole = declared[1] == "int"
                for number in NUMBER.finditer(declared[2]):
                    # Whole numbers that decide are limits; the others lay memory out.
                    if number[1] in LEFT_OUT or (whole and not number[1].startswith("kMost")):
                        continue
                    at = declared.start(2)
                    found.append(Constant(number[1], path, at + number.start(2), at + number.end(2), number[2], whole))
            for name, marked in UNNAMED:
                found += [Constant(name, path, m.start(1), m.end(1), m[1], False) for m in marked.finditer(text)]
    return found


def compiler(build):
    """The command that builds the figures' program, but for its headers and its name."""
    cache = {}
    with open(os.path.join(build, "CMakeCache.txt"), encoding="utf-8") as file:
        for line in file:
            name, sign, value = line.strip().partition("=")
            if sign:
                cache[name.partition(":")[0]] = value
    with open(os.path.join(build, "bench", "include_dirs.txt"), encoding="utf-8") as file:
        eigen = [line.strip() for line in file if os.path.isdir(os.path.join(line.strip(), "Eigen"))]
    return ([cache["CMAKE_CXX_COMPILER"], "-std=c++20", "-pthread"] + cache["CMAKE_CXX_FLAGS_RELEASE"].split()
            + cache["TREPHINE_BENCH_FLAGS"].split() + [os.path.join(ROOT, "bench", "coupled_figures.cpp")]
            + ["-I" + os.path.join(ROOT, folder) for folder in ("bench", "tests")] + ["-isystem" + folder for folder in eigen])


def figures(command, constant=None, factor=1):
    """The quick figures by name, blur and image; None where they cannot be built."""
    with tempfile.TemporaryDirectory() as scratch:
        include, program = os.path.join(scratch, "include"), os.path.join(scratch, "figures")
        shutil.copytree(INCLUDE, include)
        if constant:
            path = os.path.join(include, os.path.relpath(constant.path, INCLUDE))
            with open(path, encoding="utf-8") as file:
                text = file.read()
            with open(path, "w", encoding="utf-8") as file:
                file.write(text[:constant.start] + constant.changed(factor) + text[constant.end:])
        built = subprocess.run(command + ["-I" + include, "-o", program], capture_output=True, text=True)
        if built.returncode != 0:
            return None
        subprocess.run([program, "--quick", "--out", scratch], check=True, capture_output=True)
        with open(os.path.join(scratch, "coupled_figures.csv"), newline="", encoding="utf-8") as file:
            return {(r["figure"], r["blur_voxels"], r["image"]): r for r in csv.DictReader(file)}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--build", required=True)
    parser.add_argument("--out", required=True)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--only", nargs="*", default=[])
    arguments = parser.parse_args()
    command = compiler(arguments.build)
    before = figures(command)
    if before is None:
        print("constants: the figures' program does not build", file=sys.stderr)
        return 1

    def measure(job):
        constant, factor = job
        after = figures(command, constant, factor)
        where = os.path.relpath(constant.path, os.path.join(INCLUDE, "trephine"))
        print(f"constants: {constant.name} ({where}) × {factor}: " + ("does not build" if after is None else "done"), file=sys.stderr)
        if after is None:
            return [[constant.name, where, factor, "does not build"] + [""] * 7]
        return [[constant.name, where, factor, *key, b["judged"], after[key]["judged"], b["bound"], b["pass"], after[key]["pass"]]
                for key, b in before.items() if key in after]

    jobs = [(c, f) for c in constants() if not arguments.only or c.name in arguments.only for f in FACTORS]
    with open(os.path.join(arguments.out, "constants.csv"), "w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["constant", "header", "factor", "figure", "blur_voxels", "image", "before", "after", "bound", "pass_before", "pass_after"])
        with ThreadPoolExecutor(arguments.jobs) as pool:
            for rows in pool.map(measure, jobs):
                table.writerows(rows)
                file.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main())
