# SPDX-License-Identifier: MIT
"""figures.py --write | --check SOURCE=PATH...: figures of bench/figures, from outputs of programs.

Sources are drill=FOLDER and temporal=FOLDER (what `examples/run` and `examples/run --phantom temporal --structures`
left there), guide=FILE (what examples/08_axis_guide printed), headers=ROOT, web=FILE (of `tests/web/run --figures`),
python=FILE (of tests/python/figures.py), devices=FILE (of devices_conformance --csv), measured=FOLDER (of
bench/cutting/compare.py), tests=FOLDER (where tests told theirs) and report=FOLDER (of `bench/run`). --write writes the CSVs
anew, with commit and machine, and takes the documents' pictures from the same outputs; documents take the figures by
tests/documents/figures.py. --check fails where a figure has moved by more than one in
its last digit, or is not told. Where --write finds no figure, the old one stays, and is named."""

import csv
import glob
import math
import os
import re
import shutil
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.join(HERE, "..", "..")
FIGURES = os.path.join(HERE, "..", "figures")
PICTURES = os.path.join(HERE, "pictures")
sys.path[:0] = [HERE, os.path.join(HERE, "..")]
import cutting_tables
import goals
import house
import plots
import tables
from tables import digits, places

COLUMNS = ["name", "value", "unit", "set", "commit", "machine"]


# --- examples/run ---------------------------------------------------------------------------------------------------
SKULL = "skull, 8 s, burr of 3 mm"


def drilled(folder):
    for name, file in (("Line", "line"), ("Surface", "surface"), ("Coupled tool", "coupled")):
        rows = tables.read(folder, file)
        if rows:
            peak = max(math.hypot(r["fx_N"], r["fy_N"], r["fz_N"]) for r in rows)
            yield f"{name} / Peak force", places(peak, 2), "N", SKULL
            yield f"{name} / Bone removed", digits(rows[-1]["removed_mm3"], 3), "mm³", SKULL


def pressed(folder):
    rows = tables.read(folder, "tools")
    for tool, law in tables.unique(rows, "tool", "law"):
        mine = tables.where(rows, tool=tool, law=law, presses=1.0)

        def mean(key):
            return sum(r[key] for r in mine) / len(mine)

        name = f"{tool}, {law} the law"
        yield f"{name} / Force in the hand", places(mean("force_N"), 2), "N", "skull, 2.8 s"
        yield f"{name} / True thrust", digits(mean("thrust_N")), "N", "skull, 2.8 s"
        yield f"{name} / Bone removed", digits(mine[-1]["removed_mm3"]), "mm³", "skull, 2.8 s"


def protected(folder, given):
    """Ways to all structures, by what protected them."""
    rows = tables.read(folder, "structures")
    for protection in tables.unique(rows, "protection"):
        mine = tables.where(rows, protection=protection)
        ways = [tables.where(mine, structure=s) for s in tables.unique(mine, "structure")]
        nearest = [1e3 * min(r["drawn_distance_m"] for r in way) for way in ways]
        yield f"{protection} / Nearest", f"{places(min(nearest), 2)} to {places(max(nearest), 2)}", "mm", given
        yield f"{protection} / Greatest push", places(max(r["guard_N"] for r in mine), 2), "N", given
        yield f"{protection} / Taken", digits(sum(r["tick_taken_mm3"] for r in mine)), "mm³", given
        yield f"{protection} / Refused", digits(sum(way[-1]["refused_mm3"] for way in ways)), "mm³", given


def spared(folder):
    return protected(folder, "skull, three made structures")


def temporal(folder):
    return protected(folder, "temporal bone, seven structures")


# --- Small outputs --------------------------------------------------------------------------------------------------
def guided(file):
    with open(file, encoding="utf-8") as text:
        found = re.findall(r"(\S+) mm deep: *(\S+) N sideways, *(\S+) N along, *(\S+) N mm", text.read())
    for deep, sideways, along, turn in found:
        if deep in ("2.0", "8.0", "14.0", "16.0"):
            for what, value, unit in (("Sideways", sideways, "N"), ("Along", along, "N"), ("Turn", turn, "N·mm")):
                yield f"{float(deep):g} mm deep / {what}", value.replace("-", "−"), unit, "hand 1 mm and 5° off the axis"


def headers(root):
    for what, count, _, number in house.counts(os.path.abspath(root), house.EIGEN):
        if what in house.PROGRAMS or what == "All headers":
            yield f"{what} / Thousand lines", places(count / 1000, 1), "", "trephine's own headers"
            yield f"{what} / Files", str(number), "", "trephine's own headers"


def told(table):
    """What tests told of a table, to as many digits as it has."""
    def figures(folder):
        found = {}
        for path in glob.glob(os.path.join(folder, "*.txt")):
            with open(path, encoding="utf-8") as file:
                lines = [line.rstrip("\n").split("\t") for line in file]
            found.update({row: float(value) for name, row, value in lines if name == table})
        for row in stored(table):
            value = found.get(row["name"])
            if value is not None and "e" in row["value"]:
                value = re.sub(r"e-0?", "e-", f"{value:.0e}")
            elif value is not None:
                value = places(value, len(row["value"].partition(".")[2]))
            yield row["name"], value, row["unit"], row["set"]
    return figures


# --- bench/run ------------------------------------------------------------------------------------------------------
def errors(folder):
    sweep = tables.Sweep(tables.read(folder, "error_vs_time"))
    asked = [("Coupled tool", tables.COUPLED, tables.SMOOTH_TIPS, {}),
             ("Line, tip", tables.LINE_DEFAULT, tables.SMOOTH_TIPS, {}),
             ("Line, shaft", tables.LINE_DEFAULT, tables.SMOOTH_SHAFTS, {}),
             ("Surface, ball", tables.SURFACE_DEFAULT, [s for s in tables.SMOOTH_TIPS if s != "plate"], tables.SURFACE_COUNTS),
             ("Surface, plate of four voxels", tables.SURFACE_DEFAULT, ["plate"], tables.SURFACE_COUNTS),
             ("Surface, shaft", tables.SURFACE_DEFAULT, tables.SMOOTH_SHAFTS, tables.SURFACE_COUNTS)]
    for name, variant, scenarios, more in asked:
        rows = [row for row in (sweep.at_defaults(s, variant, **more) for s in scenarios) if row]
        load = "torque" if "shaft" in name else "force"
        for key, title in ((load, "Force or torque, p95"), ("direction", "Direction, p99")):
            _, column, factor = goals.COLUMNS[key]
            yield (f"{name} / {title}", digits(factor * tables.worst(rows, column)), "°" if key == "direction" else "%",
                   "worst smooth shape, CT blur, 0.3 mm")


def results(folder):
    coupled = tables.read(folder, "coupled_figures")
    for name, start, given in (("Coupled tool: error of the stiffness felt", "stiffness felt on a", "plane, ball, socket, groove; worst"),
                               ("Coupled tool: net work of closed paths", "net work of closed paths", "plane, edge, ball, shaft; worst")):
        found = [100 * r["judged"] for r in coupled if str(r["figure"]).startswith(start)]
        yield name, digits(max(found, default=None)), "%", given
    walls = [r["measured"] for r in tables.where(tables.read(folder, "stability"), renderer="coupled")
             if str(r["scenario"]).startswith("17 falls through")]
    yield ("Coupled tool: thin walls passed", f"{sum(walls):.0f} of {len(walls)}" if walls else None, "",
           "plates of 1 to 4 voxels, up to 1 m/s")
    by_name = {row[0]: row[1] for row in errors(folder)}
    yield "Line: force error of the tip", by_name["Line, tip / Force or torque, p95"], "%", "six smooth shapes; p95, worst shape"
    yield "Surface: force error of the ball", by_name["Surface, ball / Force or torque, p95"], "%", "five smooth shapes; p95, worst shape"
    times = {row[0]: row[1] for row in speed(folder)}
    yield "Coupled tool: a tick, sliding on a plane", times["Coupled tool slides on a plane"], "µs", "burr of 10 voxels, 0.1 m/s, median"
    yield "Coupled tool: a tick, drilling", times["Coupled tool drills"], "ms", "burr of 10 voxels, 5 mm/s, median"
    yield "Coupled tool: drilling, 60 voxels over 15", times["– 60 voxels across over 15"], "", "6 mm burr, medians"
    yield "Sampling: OpenVDB's time over ours", times["Sampling: OpenVDB's time over ours"], "", "same points, one interleaved run"


def coupled(folder):
    """Median and worst of the coupled tool's figures, by the image's blur."""
    rows = tables.read(folder, "coupled_figures")
    asked = [("Stiffness felt, plane", "stiffness felt on a plane; force over way", "%", 100),
             ("Stiffness felt, socket", "stiffness felt on a socket; force over way", "%", 100),
             ("Direction, plane, 0.1 to 1 N", "direction; slid with .1 to 1 N: plane", "°", 1),
             ("Direction, ball, 3 N", "direction; slid with 3 N: ball", "°", 1),
             ("Plunged, cut at once, at rest", "plunged; cut at once: force at rest", "N", 1),
             ("– removed too much or too little", "plunged; cut at once: removed against swept", "%", 100),
             ("Net work on closed paths, plane", "net work of closed paths: plane", "%", 100),
             ("– edge", "net work of closed paths: edge", "%", 100)]
    for name, figure, unit, factor in asked:
        for sigma in (0.5, 0.7, 1.0):
            mine = tables.where(rows, figure=figure, blur_voxels=sigma)
            two = [digits(factor * tables.first(mine, key)) for key in ("median", "worst")]
            yield f"{name} / σ = {sigma:g}", " / ".join(two) if None not in two else None, unit, "24 places at each of 7 orientations"


def net_work(folder):
    rows = tables.read(folder, "stability")
    for name, renderer in (("Line", "line"), ("Surface", "surface"), ("Coupled tool", "coupled")):
        for title, scenario in (("Mean", "21 closed paths: mean net work"), ("Worst", "21 closed paths: worst net work")):
            mine = tables.where(rows, scenario=scenario, renderer=renderer, options="default")
            yield f"{name} / {title}", digits(tables.first(mine, "measured")), "%", "1000 closed paths, share of ∮|F||dx|"


def stages(folder):
    rows = tables.read(folder, "stability")
    stacks = ["none", "filter 200 Hz", "damping 5 N·s/m in contact", "Hunt-Crossley 1 s/m", "release limit 60 N/s", "passivity controller"]
    asked = (("Stable stiffness", "stages: greatest stable K", "delay 0", "N/m", 3), ("One tick late", "stages: greatest stable K", "delay 1", "N/m", 3),
             ("Force error", "stages: force error", "", "%", 2))
    for stack in stacks:
        for title, scenario, case, unit, count in asked:
            found = [r["measured"] for r in tables.where(rows, scenario=scenario, options=stack) if case in str(r["case"])]
            yield f"{stack} / {title}", digits(found[0], count) if found else None, unit, "Line, free device of 45 g, 1 kHz"


def speed(folder):
    spread = [r for r in tables.read(folder, "speed_spread") if r["march"] == "native" and "g++" in str(r["compiler"])]
    kernels = [r for r in tables.read(folder, "speed") if r["march"] == "native" and "g++" in str(r["compiler"])]

    def time_of(case, key="p50_ns"):
        case = case.replace(",", ";")  # a table's cells have none
        return tables.first(tables.where(spread, case=case), key)

    def spread_of(case, factor):
        return digits(factor * time_of(case))

    plane = "slid over a plane, .1 m/s"
    yield "Coupled tool slides on a plane", spread_of("Coupled, " + plane, 1e-3), "µs", "burr of 10 voxels, 0.1 m/s, median"
    yield "– with friction", spread_of("Coupled, " + plane + ", friction .3", 1e-3), "µs", "the same"
    yield "Coupled tool drills", spread_of("Coupled, drills at 5 mm/s, voxels of 0.3 mm", 1e-6), "ms", "burr of 10 voxels, 5 mm/s, median"
    yield "– in finer voxels", spread_of("Coupled, drills at 5 mm/s, voxels of 0.1 mm", 1e-6), "ms", "burr of 30 voxels, 5 mm/s, median"
    # The same burr in voxels of 0.1 and of 0.4 mm: what finer voxels cost, in one run.
    fine, coarse = (f"Coupled, a 6 mm burr drills at 5 mm/s, voxels of {voxel} mm" for voxel in ("0.1", "0.4"))
    yield "– 60 voxels across over 15", digits(time_of(fine) / time_of(coarse)), "", "6 mm burr, medians"
    yield "– likewise, slowest tick in 1000", digits(time_of(fine, "p999_ns") / time_of(coarse, "p999_ns")), "", "the same"
    yield "– by the cutting law", spread_of("Coupled, match-head-3 by the law at 2 mm/s, voxels of 0.3 mm", 1e-6), "ms", "match-head of 3 mm, median"
    yield "A cut at once", spread_of("carving a burr of 10 voxels diameter", 1e-3), "µs", "burr of 10 voxels, 0.04 voxel a tick"
    for name, sampler in (("OpenVDB", "OpenVDB GridSampler"), ("NanoVDB", "NanoVDB"), ("ITK", "ITK's linear interpolator")):
        ratio = tables.first(tables.where(kernels, measure=sampler + " / ours"), "ratio")
        yield f"Sampling: {name}'s time over ours", digits(ratio, 3), "", "g++, native, one interleaved run"


def structures(folder):
    rows = tables.read(folder, "structures")

    def value(measure):
        return digits(tables.first(tables.where(rows, measure=measure), "figure"))

    yield "Distances built, two threads", value("build: 2 threads"), "s", "15 structures, 256³ voxels"
    yield "Memory of the distances", value("field"), "MB", "the same"
    for name, measure in (("in a margin, sliding", "tick; sliding in a margin"), ("touching one, drilling", "tick; drilling touching a structure")):
        yield f"Guard and veto {name}", value(measure + ": more; median of differences"), "µs", "more for a tick, median"


def compiling(folder):
    rows = tables.read(folder, "compile_cost")
    for name, what, header in (("Line", "line scene", "its own headers"), ("Surface", "surface scene", "its own headers"),
                               ("Coupled tool", "coupled scene", "its own headers"), ("Compiled library", "compiled scene", "compiled/scene.hpp")):
        for compiler in ("g++", "clang++"):
            mine = tables.where(rows, compiler=compiler, what=what, header=header)
            yield f"{name} / {compiler}", digits(tables.first(mine, "cpu_s")), "s", "minimal program, -O2"
            if compiler == "g++":
                yield f"{name} / Memory, g++", digits(tables.first(mine, "peak_MB"), 3), "MB", "minimal program, -O2"


def listed(file):
    """Rows as a program of figures wrote them."""
    with open(file, newline="", encoding="utf-8") as rows:
        for row in csv.DictReader(rows):
            yield row["name"], row["value"], row["unit"], row["set"]


# By source: CSV, function, and whether its figures depend on the machine.
SOURCES = {
    "drill": [("drill", drilled, False), ("tools", pressed, False)],
    "structures": [("spared", spared, False)],
    "temporal": [("temporal", temporal, False)],
    "guide": [("guide", guided, False)],
    "headers": [("headers", headers, False)],
    "web": [("web", listed, True)],
    "python": [("python", listed, True)],
    "devices": [("devices", listed, True)],
    "measured": [("cutting_measured", cutting_tables.measured, False), ("cutting_missed", cutting_tables.missed, False)],
    "tests": [(table, told(table), False)
              for table in ("cutting_runs", "guarded_tools", "labels", "overshoot", "ripple", "surface_tools", "tool_quality", "tubes")],
    "report": [("results", results, True), ("errors", errors, False), ("coupled", coupled, False), ("net_work", net_work, False), ("stages", stages, False),
               ("speed", speed, True), ("structures", structures, True), ("compiling", compiling, True), ("cutting_drills", cutting_tables.drills, False), ("cutting_others", cutting_tables.others, False),
               ("cutting_hands", cutting_tables.hands, False), ("cutting_beside", cutting_tables.cuts, False),
               ("cutting_plunges", cutting_tables.plunges, False), ("cutting_loops", cutting_tables.loops, False),
               ("cutting_constants", cutting_tables.constants, False), ("cutting_time", cutting_tables.time, True)],
}


def stored(name):
    path = os.path.join(FIGURES, name + ".csv")
    if not os.path.exists(path):
        return []
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def machine_of(source, path, commit):
    """Where a source's figures were measured, and at which commit."""
    if source in ("web", "python", "devices"):
        with open(path, newline="", encoding="utf-8") as file:
            return next(csv.DictReader(file))["machine"], commit
    if source != "report":
        return "any", commit
    with open(os.path.join(path, "conditions.txt"), encoding="utf-8") as file:
        said = dict(line.strip().split(": ", 1) for line in file if ": " in line)
    return f"{said['CPU']}, {said['compiler'].split(',')[0]}", said["commit"]


def moved(before, after):
    """Whether numbers in two texts differ by more than one in the last digit of the first."""
    numbers = [re.findall(r"[-−]?[\d.]+", text) for text in (before, after)]
    if len(numbers[0]) != len(numbers[1]):
        return True
    for old, new in zip(*numbers):
        step = 10.0 ** -len(old.partition(".")[2])
        a, b = (float(text.replace("−", "-")) for text in (old, new))
        if abs(a - b) > 1.01 * step:
            return True
    return False


# Pictures of bench/run that documents show, by the names that they have there.
SHOWN = {"cutting_thrust": "cutting_thrust", "cutting_torque": "cutting_torque", "stability_energy_line": "stability_energy_line",
         "error_vs_time_plane_line": "line_on_plane", "error_vs_time_sphere_surface": "surface_on_sphere"}


def draw(source, path):
    """Takes the documents' pictures from the same outputs as their figures, so that neither is older."""
    if source == "measured" and shutil.which("gnuplot"):
        plots.measured(PICTURES, tables.read(path, "measured"))
    if source == "report":
        for there, here in SHOWN.items():
            drawn = os.path.join(path, there + ".svg")
            if os.path.exists(drawn):
                shutil.copyfile(drawn, os.path.join(PICTURES, here + ".svg"))
            else:
                print(f"{here}.svg: no new {drawn}", file=sys.stderr)


def main():
    if len(sys.argv) < 3 or sys.argv[1] not in ("--write", "--check"):
        print(__doc__, file=sys.stderr)
        return 2
    commit = subprocess.run(["git", "-C", ROOT, "rev-parse", "--short", "HEAD"], capture_output=True, text=True).stdout.strip()
    faults = 0
    for argument in sys.argv[2:]:
        source, _, path = argument.partition("=")
        for name, function, timed in SOURCES[source]:
            machine, at = machine_of(source, path, commit)
            machine = machine if timed else "any"
            before = {row["name"]: row for row in stored(name)}
            rows = []
            for figure, value, unit, given in function(path):
                old = before.pop(figure, None)
                if value is None:
                    print(f"{name}.csv: no new '{figure}' in {path}", file=sys.stderr)
                    rows += [old] if old else []
                    faults += 1
                    continue
                if old is None or moved(old["value"], value):
                    faults += 1
                    print(f"{name}.csv: '{figure}' is {value} {unit}, was {old['value'] if old else 'not there'}", file=sys.stderr)
                elif not timed:
                    rows.append(old)  # an equal figure keeps the commit that it was found at
                    continue
                rows.append(dict(zip(COLUMNS, (figure, value, unit, given, at, machine))))
            if sys.argv[1] == "--write" and rows:
                with open(os.path.join(FIGURES, name + ".csv"), "w", newline="", encoding="utf-8") as file:
                    out = csv.DictWriter(file, COLUMNS, lineterminator="\n")
                    out.writeheader()
                    out.writerows(rows)
            elif before:
                faults += 1
                print(f"{name}.csv: {path} says nothing of {sorted(before)}", file=sys.stderr)
        if sys.argv[1] == "--write":
            draw(source, path)
    if sys.argv[1] == "--write":
        return 0
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
