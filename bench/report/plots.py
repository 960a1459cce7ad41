# SPDX-License-Identifier: MIT
"""Draws the report's plots with gnuplot, as SVG."""

import math
import os
import subprocess

import tables

COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#8c510a", "#7f7f7f"]


def quoted(text):
    return '"' + str(text).replace('"', "'") + '"'


class Plot:
    """One SVG: series of points with a style each, then `draw`."""

    def __init__(self, folder, name, title, xlabel, ylabel):
        self.path = os.path.join(folder, name + ".svg")
        self.setup = [
            f"set terminal svg size 980,460 enhanced font 'Helvetica,12' background '#ffffff'",
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
    plot.setup += ["set logscale xy", "set format xy '%g'"]
    groups = {}
    for row in rows:
        group = "thesis" if row["variant"] in (tables.LINE_THESIS, tables.SURFACE_THESIS) else row["variant"]
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


def cutting(folder, rows, quantity):
    """A drill's thrust or torque by the spindle's speed: measured with its spread, the law, and runs."""
    rows = [row for row in rows if row["quantity"] == quantity and row["case"].endswith(" rpm")]
    if not rows:
        return None
    plot = Plot(folder, f"cutting_{quantity}", f"3.2 mm drill fed 120 mm/min: {quantity} by the spindle's speed",
                "spindle [rpm]", f"{quantity} [{rows[0]['unit'].replace(' mm', '·mm')}]")
    plot.setup += ["set xrange [900:1600]", "set yrange [0:*]"]
    for part, colour in zip(tables.unique(rows, "part"), COLOURS):
        mine = [(float(row["case"].split()[0]), row) for row in rows if row["part"] == part]
        name = part.split(": ")[-1]
        plot.add(f"{name}, measured", [(rpm, r["measured"], r["spread"]) for rpm, r in mine],
                 f"yerrorbars pt 7 ps 0.7 lw 1.5 lc rgb '{colour}'")
        plot.add("law", [(rpm, r["law"]) for rpm, r in mine], f"lines lw 2 lc rgb '{colour}'")
        plot.add("run", [(rpm, r["simulated"]) for rpm, r in mine], f"points pt 4 ps 1.2 lc rgb '{colour}'")
        plot.add("fitted here", [(rpm, r["measured"]) for rpm, r in mine if r["fitted"] == "yes"],
                 f"points pt 6 ps 2 lw 2 lc rgb '{colour}'")
    return plot.draw()


def measured(folder, rows):
    """The law's figure over the measured one, for each published cut that has a size."""
    rows = [r for r in rows if r["holds"] in ("yes", "no") and r["unit"] not in ("sign", "yes")]
    if not rows:
        return None
    rows.sort(key=lambda r: (r["holds"] == "yes", r["kind"], r["law"] / r["value"]))  # misses first
    plot = Plot(folder, "cutting_measured", "Published cuts that have a size: the law over the measurement", "", "law / measured")
    names = ", ".join(f"{quoted(r['id'])} {i}" for i, r in enumerate(rows))
    plot.setup += ["set logscale y", "set yrange [0.03:6]", "set ytics (0.05, 0.1, 0.2, 0.5, 1, 2, 5)",
                   f"set xrange [-1:{len(rows)}]", f"set xtics ({names}) rotate by -60 noenhanced", "set bmargin 10"]
    for number, (role, words) in enumerate((("test", "tested"), ("fit", "fitted"))):
        for holds, mark, more in (("yes", 7 if role == "test" else 6, ""), ("no", 2, ", missed")):
            mine = [(i, r["law"] / r["value"]) for i, r in enumerate(rows) if (r["role"], r["holds"]) == (role, holds)]
            plot.add(words + more, mine, f"points pt {mark} ps 0.9 lw 1.5 lc rgb '{COLOURS[number]}'")
    for name, factor, dash in (("equal", 1, 1), ("twice, half", 2, 2), (None, 0.5, 2)):
        plot.add(name, [(-1, factor), (len(rows), factor)], f"lines lw 1 dt {dash} lc rgb '#808080'")
    return plot.draw()


def all_plots(folder, sweep, energy, forces, published):
    """Paths by section; None where a table has nothing to draw."""
    each = ("line", "surface", "coupled")
    return {"cutting": [*(cutting(folder, forces, quantity) for quantity in ("thrust", "torque")),
                        measured(folder, published)],
            "error": [error_against_time(folder, sweep, s, r) for s in tables.unique(sweep.rows, "scenario") for r in each],
            "stability": [stability_energy(folder, energy, r) for r in each]}
