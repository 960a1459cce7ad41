# SPDX-License-Identifier: MIT
"""house.py [--root CHECKOUT] [--eigen FOLDER] [--no-compile]: how large the library is, as a table.

Counts lines of headers, of the headers that a few one-line programs include (by g++ -M), and of the benchmarks; and
measures processor seconds and memory that g++ -O2 takes for a minimal scene of the coupled tool."""

import argparse
import glob
import os
import re
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "speed"))
import compile_cost

# What a program includes, and the lines that it may bring.
PROGRAMS = {
    "Line scene": ([compile_cost.SCENES["line"][0], "stage/haptic_scene.hpp"], 4500),
    "Surface scene": ([compile_cost.SCENES["surface"][0], "stage/haptic_scene.hpp"], 5000),
    "Coupled scene": ([compile_cost.SCENES["coupled"][0], "stage/haptic_scene.hpp"], 6500),
    "A cut": (["stage/cutting.hpp"], 3200),
    "trephine.hpp": (["trephine.hpp"], 10000),
}
RUNS = 3  # of the compiler, of which the quickest counts
EIGEN = os.environ.get("EIGEN3_INCLUDE_DIR", "/usr/include/eigen3")


def lines(paths):
    count = 0
    for path in paths:
        with open(path, "rb") as file:
            count += file.read().count(b"\n")
    return count


def files(folder, endings):
    return [path for path in glob.glob(os.path.join(folder, "**"), recursive=True)
            if os.path.isfile(path) and path.endswith(endings)]


def headers_of(root, eigen, headers):
    """The library's headers that a program of these includes has, by the compiler's own account."""
    include = os.path.join(root, "include")
    text = compile_cost.includes(*("trephine/" + header for header in headers))
    run = subprocess.run(["g++", "-std=c++20", "-M", "-I", include, "-isystem", eigen, "-x", "c++", "-"], input=text,
                         capture_output=True, text=True, check=True)
    return sorted({path for path in re.split(r"[\s\\]+", run.stdout) if path.startswith(include + os.sep)})


def counts(root, eigen):
    """(what, lines, at most, files or none)"""
    include = os.path.join(root, "include")
    yield "All headers", lines(files(include, ".hpp")), 22000, len(files(include, ".hpp"))
    yield "haptic_scene.hpp", lines([os.path.join(include, "trephine", "stage", "haptic_scene.hpp")]), 250, 1
    for name, (headers, most) in PROGRAMS.items():
        included = headers_of(root, eigen, headers)
        yield name, lines(included), most, len(included)
    bench = files(os.path.join(root, "bench"), (".hpp", ".cpp", ".py", ".txt", ".cmake", "run", "recommend"))
    yield "bench, all code", lines(bench), 7000, len(bench)


def compiling(root, eigen):
    """Processor seconds and peak memory [MB] of the coupled tool's minimal program against its own headers."""
    header, renderer = compile_cost.SCENES["coupled"]
    text = (compile_cost.includes("trephine/" + header, "trephine/stage/haptic_scene.hpp")
            + compile_cost.PROGRAM.replace("@renderer@", renderer))
    with tempfile.TemporaryDirectory() as scratch:
        source = os.path.join(scratch, "program.cpp")
        with open(source, "w", encoding="utf-8") as file:
            file.write(text)
        command = ["g++", "-std=c++20", "-O2", "-I", os.path.join(root, "include"), "-isystem", eigen, "-c", "-o", source + ".o", source]
        return min(compile_cost.cost(command) for _ in range(RUNS))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", default=os.path.dirname(HERE))
    parser.add_argument("--eigen", default=EIGEN)
    parser.add_argument("--no-compile", action="store_true")
    arguments = parser.parse_args()
    root = os.path.abspath(arguments.root)
    print("| | Now | At most | Files |\n|---|---|---|---|")
    for what, count, most, number in counts(root, arguments.eigen):
        print(f"| {what} [lines] | {count:,} | {most:,} | {number} |")
    if not arguments.no_compile:
        seconds, memory = compiling(root, arguments.eigen)
        print(f"| Coupled program, g++ -O2 [s] | {seconds:.1f} | 6 | |")
        print(f"| Coupled program, g++ -O2 [MB] | {memory:.0f} | 400 | |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
