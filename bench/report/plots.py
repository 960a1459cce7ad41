# SPDX-License-Identifier: MIT
"""Draws the report's plots with gnuplot, as SVG."""

import math
import os
import shutil
import subprocess

import tables

COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#8c510a", "#7f7f7f"]


def available():
    return shutil.which("gnuplot") is not None


def quoted(text):
    return '"' + str(text).replace('"', "'") + '"'


class Plot:
    """One SVG: series of points with a style each, then `draw`."""

    def __init__(self, folder, name, title, xlabel, ylabel, width=980, height=460):
        self.path = os.path.join(folder, name + ".svg")
        self.setup = [
            f"set terminal svg size {width},{height} enhanced font 'Helvetica,12' background '#ffffff'",
            f"set output {quoted(self.path)}",
            f"set title {quoted(title)} noenhanced",
            f"set xlabel {quoted(xlabel)} noenhanced",
            f"set ylabel {quoted(ylabel)} noenhanced",
            "set grid lc rgb '#dddddd'",
            "set key outside right top noenhanced samplen 2 spacing 0.95",
            "set border 3",
            "set tics nomirror",
        ]
        self.series = []

    def line(self, text):
        self.setup.append(text)

    def add(self, title, points, style):
        points = [p for p in points if all(isinstance(v, str) or math.isfinite(v) for v in p)]
        if points:
            self.series.append((title, points, style))

    def draw(self):
        if not self.series:
            return None
        plots, data = [], []
        for title, points, style in self.series:
            name = quoted(title) if title else '""'
            columns = ":".join(str(i + 1) for i in range(len(points[0])))
            plots.append(f"'-' using {columns} {'title ' + name if title else 'notitle'} with {style}")
            data.append("\n".join(" ".join(str(v) for v in p) for p in points) + "\ne")
        script = "\n".join(self.setup) + "\nplot " + ", ".join(plots) + "\n" + "\n".join(data) + "\n"
        run = subprocess.run(["gnuplot"], input=script, text=True, capture_output=True, check=False)
        if run.returncode != 0:
            raise RuntimeError(f"gnuplot failed on {self.path}:\n{run.stderr}")
        return self.path


def logarithmic(plot, both=True):
    plot.line("set logscale xy" if both else "set logscale y")
    plot.line("set format x '%g'")
    plot.line("set format y '%g'")


def error_against_time(folder, sweep, scenario, renderer):
    """Every setting of a scenario as a point, by law, and the front of those no other beats."""
    torque = scenario.startswith("shaft") or scenario == "hole"
    key = "torque_error_rel_p95" if torque else "force_error_rel_p95"
    what = "torque" if torque else "force"
    rows = [row for row in sweep.where(scenario=scenario, renderer=renderer, field=tables.DEFAULT_FIELD, voxel_mm=0.3,
                                       error_kind="discretisation")
            if row["tick_ns_median"] > 0 and row[key] > 0 and math.isfinite(row[key])]
    if not rows:
        return None
    plot = Plot(folder, f"error_vs_time_{scenario}_{renderer}",
                f"{renderer} on {scenario}: error of the {what} against time", "median tick [µs]",
                f"{what} error, p95 [% of the continuum's]")
    logarithmic(plot)
    groups = {}
    for row in rows:
        parts = row["variant"].split("-")
        group = parts[0] if renderer != "line" else (
            "thesis" if row["variant"] == tables.LINE_THESIS else parts[1] + (", refined" if "refined" in parts else "")
            + ("" if "spline" in parts else ", " + parts[3] + " normals"))
        groups.setdefault(group, []).append((row["tick_ns_median"] / 1000, 100 * row[key]))
    for (group, members), colour in zip(sorted(groups.items()), COLOURS * 2):
        plot.add(group, members, f"points pt 7 ps 0.45 lc rgb '{colour}'")
    plot.add("front", tables.front([p for group in groups.values() for p in group]), "steps lw 1.5 lc rgb '#444444'")
    thesis = sweep.at_defaults(scenario, tables.LINE_THESIS if renderer == "line" else tables.SURFACE_THESIS)
    ours = sweep.at_defaults(scenario, {"line": tables.LINE_DEFAULT, "surface": tables.SURFACE_DEFAULT}.get(renderer, tables.COUPLED))
    for name, row, mark in (("thesis, its counts", thesis, 8), ("default law, same counts", ours, 4)):
        if row is not None and row[key] > 0:
            plot.add(name, [(row["tick_ns_median"] / 1000, 100 * row[key])], f"points pt {mark} ps 1.5 lw 2 lc rgb '#000000'")
    return plot.draw()


def thesis_rates(folder, rows):
    if not rows:
        return None
    plot = Plot(folder, "thesis_rates", "Figures 26 and 29 again: rate against vertices, tooth of 256 x 256 x 176",
                "vertices", "rate [kHz]")
    logarithmic(plot)
    for renderer, colour in (("line", COLOURS[0]), ("surface", COLOURS[1])):
        mine = [row for row in rows if row["renderer"] == renderer and row["stepping"] != "ray_cast"]
        plot.add(f"{renderer}: 1 / median tick", [(r["vertices"], r["rate_kHz"]) for r in mine], f"linespoints pt 7 ps 0.7 lc rgb '{colour}'")
        plot.add(f"{renderer}: servo loop at 1 kHz", [(r["vertices"], r["servo_rate_Hz"] / 1000) for r in mine],
                 f"linespoints pt 6 ps 0.7 dt 2 lc rgb '{colour}'")
        plot.add(f"{renderer}: thesis (Pentium 4, 2007)", [(r["vertices"], r["thesis_rate_Hz"] / 1000) for r in mine],
                 f"linespoints pt 4 ps 0.9 dt 3 lc rgb '{colour}'")
    return plot.draw()


def speed_by_voxel(folder, rows):
    """Ticks on 0.4, 0.2 and 0.1 mm voxels; flat is what one wants."""
    plot = Plot(folder, "speed_by_voxel", "The same tool on finer voxels", "voxel [mm]", "tick [ns]")
    plot.line("set logscale y")
    plot.line("set key top right")
    kinds = dict.fromkeys((row["compiler"], row["march"]) for row in rows)
    for compiler, march in kinds:
        for what in ("air", "light"):
            points = sorted((float(row["measure"].split()[1]), row["ns"]) for row in rows
                            if row["compiler"] == compiler and row["march"] == march and row["measure"].startswith("voxel")
                            and row["measure"].endswith("mm; " + what) and "/" not in row["measure"])
            if points:
                plot.add(f"{what}, {compiler} {march}", points, "linespoints")
    # Its voxel collision with one proxy, 256 x 256 x 176, slid 0.5 mm deep at 20 mm/s; on another machine: the growth counts.
    plot.add("CHAI3D, ball of 3 mm", [(0.1, 498664), (0.4, 15312)], "linespoints dt 2 lc rgb '#888888'")
    return plot.draw()


def stability_plane(folder, rows, renderer):
    """Damping against stiffness, by what a hit of .1 m/s comes to."""
    rows = [row for row in rows if row["renderer"] == renderer]
    if not rows:
        return None
    plot = Plot(folder, f"stability_plane_{renderer}", f"{renderer} on a flat wall, hit at 0.1 m/s and pressed: 45 g, no delay, no friction, nobody holds it",
                "damping of the device [N s/m]", "tangent stiffness where it is pressed [N/m]")
    logarithmic(plot)
    for outcome, style in (("stable", f"points pt 7 ps 0.8 lc rgb '{COLOURS[2]}'"), ("limit cycle", f"points pt 6 ps 0.9 lw 1.5 lc rgb '{COLOURS[4]}'"),
                           ("unstable", f"points pt 2 ps 0.8 lc rgb '{COLOURS[1]}'")):
        plot.add(outcome, [(r["damping"], r["stiffness"]) for r in rows if r["outcome"] == outcome], style)
    dampings = sorted({r["damping"] for r in rows})
    for delay, dash in ((0, 1), (1, 2), (2, 3)):
        line = [(b, b / (1e-3 * (0.5 + delay))) for b in dampings]
        plot.add(f"theory, {delay} ticks of delay", [p for p in line if p[1] >= 1], f"lines lw 1.5 dt {dash} lc rgb '#000000'")
    return plot.draw()


def sweep_factor(row):
    """The one factor in which a case of the sweep differs from the usual one."""
    usual = {"damping": 0.5, "delay": 0, "hand": "light", "friction": 0, "quantum_mm": 0}
    names = {"damping": "b {:g}", "delay": "delay {:g}", "hand": "{} hand", "friction": "friction", "quantum_mm": "encoders"}
    changed = [names[key].format({"none": "no"}.get(row[key], row[key])) for key in usual if row[key] != usual[key]]
    return changed[0] if len(changed) == 1 else "usual" if not changed else None


def stability_sweep(folder, rows, renderer, options):
    """Greatest stable stiffness by place, one factor at a time, against theory."""
    rows = [row for row in rows if (row["renderer"], row["options"]) == (renderer, options) and row["drawn"] == 0]
    if not rows:
        return None
    factors = list(dict.fromkeys(sweep_factor(row) for row in rows))
    places = list(dict.fromkeys(row["place"] for row in rows))
    name = "".join(c if c.isalnum() else "_" for c in f"stability_sweep_{renderer}_{options}")
    plot = Plot(folder, name, f"{renderer}, {options}: greatest stable stiffness by place (usual: 45 g, 0.5 N s/m, light hand); at the bottom: none rests", "",
                "stiffness, as the option means it [N/m]", 980, 480)
    plot.line("set logscale y")
    plot.line("set format y '%g'")
    plot.line("set yrange [60:1500000]")
    plot.line(f"set xrange [-0.6:{len(factors) - 0.4}]")
    plot.line("set xtics (" + ", ".join(f"{quoted(f)} {i}" for i, f in enumerate(factors)) + ") noenhanced")
    for i, place in enumerate(places):
        at = 0.07 * (i - 0.5 * (len(places) - 1))
        plot.add(place, [(factors.index(sweep_factor(r)) + at, max(r["stable_N_per_m"], 80)) for r in rows if r["place"] == place],
                 f"points pt {(7, 5, 9, 11, 13, 4, 6, 8, 10, 12)[i % 10]} ps 0.8 lc rgb '{(COLOURS + ['#882255'])[i % 10]}'")
    theory = []
    for i, factor in enumerate(factors):
        K = next(r["theory_N_per_m"] for r in rows if sweep_factor(r) == factor)
        theory.append((i, K, i - 0.42, i + 0.42))
    plot.add("theory: (b + b_h) / (T/2 + dT)", theory, "xerrorbars pt 0 lw 1.5 lc rgb '#000000'")
    return plot.draw()


def stability_energy(folder, rows, renderer):
    rows = [row for row in rows if row["renderer"] == renderer]
    if not rows:
        return None
    plot = Plot(folder, f"stability_energy_{renderer}", f"{renderer}, the shaft pressed flush on bone and held: energy given to the hand", "time [s]", "energy [mJ]")
    for options, colour in (("default", COLOURS[0]), ("thesis", COLOURS[1])):
        mine = [r for r in rows if r["options"] == options]
        plot.add(options, [(r["time"], r["energy_mJ"]) for r in mine], f"lines lw 2 lc rgb '{colour}'")
        plot.add(f"{options}: a hold may leak", [(r["time"], r["allowed_mJ"]) for r in mine], f"lines lw 1 dt 2 lc rgb '{colour}'")
    return plot.draw()


def thin_walls(folder, rows, stiffness):
    """Who falls through which wall at which speed; renderers stand beside each other."""
    rows = [row for row in rows if row["stiffness"] == stiffness]
    if not rows:
        return None
    plot = Plot(folder, f"stability_thin_walls_{stiffness:g}", f"Walls pushed until 3.3 N at {stiffness:g} N/m: held (disc) or fallen through (cross)",
                "speed [m/s]", "thickness [voxels]")
    plot.line("set logscale x")
    plot.line("set format x '%g'")
    plot.line("set xrange [0.008:1.3]")
    plot.line("set yrange [0.5:4.8]")
    kinds = list(dict.fromkeys((r["renderer"], r["options"]) for r in rows))
    for i, ((renderer, options), colour) in enumerate(zip(kinds, COLOURS)):
        mine = [r for r in rows if (r["renderer"], r["options"]) == (renderer, options)]
        at = lambda r: (r["speed"], r["voxels"] + 0.8 / len(kinds) * (i - 0.5 * (len(kinds) - 1)))
        held = [at(r) for r in mine if r["through"] == 0]
        plot.add(f"{renderer}, {options}", held, f"points pt 7 ps 0.7 lc rgb '{colour}'")
        plot.add("" if held else f"{renderer}, {options}", [at(r) for r in mine if r["through"] != 0], f"points pt 2 ps 0.9 lw 1.5 lc rgb '{colour}'")
    return plot.draw()


def all_plots(folder, sweep, t):
    """Paths by section; None where a table has nothing to draw."""
    each = ("line", "surface", "coupled")
    loops = [stability_plane(folder, t["stability_plane"], r) for r in each]
    loops += [stability_sweep(folder, t["stability_sweep"], *who) for who in tables.unique(t["stability_sweep"], "renderer", "options")]
    loops += [stability_energy(folder, t["stability_energy"], r) for r in each]
    loops += [thin_walls(folder, t["stability_thin_walls"], k) for k in tables.unique(t["stability_thin_walls"], "stiffness")]
    return {"error": [error_against_time(folder, sweep, s, r) for s in tables.unique(sweep.rows, "scenario") for r in each],
            "stability": loops, "speed": [thesis_rates(folder, t["thesis_rates"]), speed_by_voxel(folder, t["speed"])]}
