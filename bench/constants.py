# SPDX-License-Identifier: MIT
"""constants.py --build FOLDER --out FOLDER [--jobs N] [--only NAME ...] | --list: constants of the coupled tool and the cutting law.

Each is made a fifth less and more. Builds the program of their figures against a copy of the headers in which an environment
variable scales a real number, runs
its quick set for each, and writes constants.csv: each figure as it is and as it becomes. Whole numbers are compiled in."""

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

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "common"))
import results

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), ".."))
INCLUDE = os.path.join(ROOT, "include")
DECLARED = re.compile(r"(?:static|inline) constexpr (double|float|int) ([^;]*);")
ALIAS = re.compile(r"static constexpr (double|float) (\w+ = \w+::k\w+;)")
NUMBER = re.compile(r"\b(k\w+) = ([\d.][\d.eEF/* +-]*)(?=,|;|$)")
# Numbers of their own: mathematics, a bound of options, and a margin that must be above 1. A cut by pressure has its own figures.
LEFT_OUT = {"kPi", "kMaxGain", "kRoundedUp", "kDof", "kPressureBite"}
FACTORS = (0.8, 1.2)
# Elements fill lanes of 16, and a band has 4. A fifth of 4 around is no whole number, so those are left out.
MULTIPLES = {"kBands": 4}


class Set:
    """Constants judged by one program: its source in bench/, whose figures are in a CSV file of its name.

    `headers`: all declared numbers of these. `places`: further numbers by name, as (header, pattern) with the number in group 1."""

    def __init__(self, program, headers, places):
        self.program, self.headers, self.places = program, headers, places


RELEASE = ("render/coupled/coupled_options.hpp", r"double release = ([\d.]+);")
SETS = [
    Set("coupled_figures", ["render/coupled/*.hpp", "voxel/dual_element.hpp"], {"release": RELEASE}),
    Set("cutting_figures", [], {
        "kLead": ("stage/head_samples.hpp", r"double kLead = ([\d.]+);"),
        "kLead / 6, where bone is whole": ("stage/head_samples.hpp", r"\((kLead / 6) \* slope"),
        "kFilm": ("stage/head_samples.hpp", r"double kFilm = ([\d.]+);"),
        "distance of the voxels that strength is of": ("stage/head_samples.hpp", r"apart =\s*static_cast<float>\((bone_\.spacing\(\)\.norm\(\))"),
        "lag": ("stage/cutting_force_options.hpp", r"double lag = ([\d.]+);"),
        "least share of the elements": ("stage/cutting_force.hpp", r"share = (1\.0 / HeadElements::kCount);"),
        "release": RELEASE,
        "kPressureBite": ("render/coupled/coupled_options.hpp", r"double kPressureBite = ([\d.]+);"),
        "kGuide": ("tool/revolved_cutter.hpp", r"double kGuide = ([\d.]+);"),
        "kMaxRoom": ("tool/head_sweep.hpp", r"double kMaxRoom = ([\d.]+);"),
        "kSteepness": ("voxel/cut_slope.hpp", r"double kSteepness = ([\d.]+);"),
        "kMaxStartAhead": ("render/coupled/coupled_constants.hpp", r"double kMaxStartAhead = ([\d.]+);"),
        "kCatchUp": ("stage/cutting_force.hpp", r"double kCatchUp = ([\d.]+);"),
        "kSharpCorner": ("tool/rims_in_voxels.hpp", r"double kSharpCorner = ([\d.]+);"),
        "kBands": ("tool/head_elements.hpp", r"kBands = (\d+);"),
        "kSmallStep": ("tool/cutting_law.hpp", r"double kSmallStep = ([\d.e-]+);"),
    }),
]
SWEPT = """#pragma once
#include <cstdlib>
namespace trephine {
inline double swept(int number, double value) {
  static const char* const which = std::getenv("SWEPT_NUMBER");
  static const char* const factor = std::getenv("SWEPT_FACTOR");
  return which && std::atoi(which) == number ? value * std::atof(factor) : value;
}
}  // namespace trephine
"""


class Constant:
    """A number in a header: its own number, name, file, place and whether it is whole."""

    def __init__(self, number, name, path, start, end, text, whole):
        self.number, self.name, self.path, self.start, self.end, self.text, self.whole = number, name, path, start, end, text, whole

    def scaled(self):
        """The text that an environment variable scales."""
        cast = "static_cast<float>" if self.text.strip().endswith("F") else ""
        return f"{cast}(swept({self.number}, {self.text.strip()}))"

    def changed(self, factor):
        of = MULTIPLES.get(self.name, 1)
        return str(max(of, of * round(factor * int(self.text) / of)))


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def constants(of):
    """All constants of a set. Raises where a place is not found once."""
    found = []
    for path in (path for pattern in of.headers for path in sorted(glob.glob(os.path.join(INCLUDE, "trephine", pattern)))):
        for declared in DECLARED.finditer(read(path)):
            whole = declared[1] == "int"
            for number in NUMBER.finditer(declared[2]):
                # Whole numbers that decide are limits; the others lay memory out.
                if number[1] in LEFT_OUT or (whole and not number[1].startswith("kMax")):
                    continue
                at = declared.start(2)
                found.append(Constant(len(found), number[1], path, at + number.start(2), at + number.end(2), number[2], whole))
    for name, (header, pattern) in of.places.items():
        path = os.path.join(INCLUDE, "trephine", header)
        matches = list(re.finditer(pattern, read(path)))
        if len(matches) != 1:
            raise LookupError(f"constants: {name} is {len(matches)} times in {header}")
        found.append(Constant(len(found), name, path, matches[0].start(1), matches[0].end(1), matches[0][1], name in MULTIPLES))
    return found


def compiler(build, program):
    """The command that builds a program of figures, but for its headers and its name."""
    cache = {}
    with open(os.path.join(build, "CMakeCache.txt"), encoding="utf-8") as file:
        for line in file:
            name, sign, value = line.strip().partition("=")
            if sign:
                cache[name.partition(":")[0]] = value
    with open(os.path.join(build, "bench", "include_dirs.txt"), encoding="utf-8") as file:
        eigen = [line.strip() for line in file if os.path.isdir(os.path.join(line.strip(), "Eigen"))]
    return ([cache["CMAKE_CXX_COMPILER"], "-std=c++20", "-pthread"] + cache["CMAKE_CXX_FLAGS_RELEASE"].split()
            + cache["TREPHINE_BENCH_FLAGS"].split() + [os.path.join(ROOT, "bench", program + ".cpp")]
            + ["-I" + os.path.join(ROOT, folder) for folder in ("bench", "tests")] + ["-isystem" + folder for folder in eigen])


def write(scratch, all_constants, changed=None, factor=1):
    """A copy of the headers whose real numbers are scaled at run time and one of whose whole numbers is another."""
    include = os.path.join(scratch, "include")
    shutil.copytree(INCLUDE, include)
    with open(os.path.join(include, "trephine", "swept.hpp"), "w", encoding="utf-8") as file:
        file.write(SWEPT)
    changed_files = {c.path for c in all_constants}
    for path in glob.glob(os.path.join(INCLUDE, "trephine", "**", "*.hpp"), recursive=True):
        text = read(path)
        if path not in changed_files and ALIAS.search(text):
            with open(os.path.join(include, os.path.relpath(path, INCLUDE)), "w", encoding="utf-8") as file:
                file.write(ALIAS.sub(r"static inline const \1 \2", text))
    for path in changed_files:
        copy = os.path.join(include, os.path.relpath(path, INCLUDE))
        text = read(path)
        for c in sorted((c for c in all_constants if c.path == path), key=lambda c: -c.start):
            if not c.whole:
                text = text[:c.start] + c.scaled() + text[c.end:]
            elif c is changed:
                text = text[:c.start] + c.changed(factor) + text[c.end:]
                text = re.sub(rf"static_assert\([^;]*\b{c.name}\b[^;]*\);", "", text)  # holds for the number as it stands
        # A number may stand on a scaled one, so none of them is known when compiling.
        text = DECLARED.sub(lambda m: m[0] if m[1] == "int" else f"static inline const {m[1]} {m[2]};", text)
        with open(copy, "w", encoding="utf-8") as file:
            file.write(text.replace("#pragma once\n", "#pragma once\n#include <trephine/swept.hpp>\n", 1))
    return include


def build(command, scratch, all_constants, changed=None, factor=1):
    """The figures' program, or None where it does not build."""
    program = os.path.join(scratch, "figures")
    include = write(scratch, all_constants, changed, factor)
    built = subprocess.run(command + ["-I" + include, "-o", program], capture_output=True, text=True)
    if built.returncode != 0:
        print("\n".join(line for line in built.stderr.splitlines() if "error" in line), file=sys.stderr)
        return None
    return program


def figures(program, name, constant=None, factor=1):
    """The quick figures of a program, by their names and blur."""
    environment = dict(os.environ)
    if constant:
        environment.update(SWEPT_NUMBER=str(constant.number), SWEPT_FACTOR=str(factor))
    with tempfile.TemporaryDirectory() as out:
        subprocess.run([program, "--quick", "--out", out], check=True, capture_output=True, env=environment)
        with open(os.path.join(out, name + ".csv"), newline="", encoding="utf-8") as file:
            return {(r["figure"], r["blur_voxels"]): r for r in csv.DictReader(file)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--list", action="store_true", help="the constants and where they stand, alone")
    parser.add_argument("--build")
    parser.add_argument("--out")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--only", nargs="*", default=[])
    arguments = parser.parse_args()
    if arguments.list:
        for constant in (c for of in SETS for c in constants(of)):
            print(f"{os.path.relpath(constant.path, INCLUDE)}: {constant.name} = {constant.text.strip()}")
        return 0
    if not (arguments.build and arguments.out):
        parser.error("give --build and --out")
    with results.opened(parser, arguments.out, "constants.csv") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["constant", "header", "factor", "figure", "blur_voxels", "before", "after", "bound", "pass_before", "pass_after"])
        for of in SETS:
            every = constants(of)
            jobs = [(c, f) for c in every if not arguments.only or c.name in arguments.only for f in FACTORS]
            if not jobs:
                continue
            with tempfile.TemporaryDirectory() as scratch:
                command = compiler(arguments.build, of.program)
                program = build(command, scratch, every)
                if program is None:
                    print(f"constants: {of.program} does not build", file=sys.stderr)
                    return 1
                for rows in measure(of.program, program, command, every, jobs, arguments.jobs):
                    table.writerows(rows)
                    file.flush()
    return 0


def measure(name, program, command, every, jobs, at_once):
    """Rows of each job, a constant and a factor."""
    before = figures(program, name)

    def rows_of(job):
        constant, factor = job
        after = None
        if constant.whole:
            with tempfile.TemporaryDirectory() as scratch:
                other = build(command, scratch, every, constant, factor)
                after = other and figures(other, name)
        else:
            after = figures(program, name, constant, factor)
        where = os.path.relpath(constant.path, os.path.join(INCLUDE, "trephine"))
        print(f"constants: {constant.name} ({where}) × {factor}: " + ("does not build" if after is None else "done"), file=sys.stderr)
        if after is None:
            return [[constant.name, where, factor, "does not build"] + [""] * 6]
        return [[constant.name, where, factor, *key, b["judged"], after[key]["judged"], b["bound"], b["pass"], after[key]["pass"]]
                for key, b in before.items() if key in after]

    with ThreadPoolExecutor(at_once) as pool:
        yield from pool.map(rows_of, jobs)


if __name__ == "__main__":
    sys.exit(main())
