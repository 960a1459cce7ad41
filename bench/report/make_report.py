# SPDX-License-Identifier: MIT
"""make_report.py FOLDER: plots and report.html from the tables that bench/run left in FOLDER."""

import html
import math
import os
import shutil
import sys

import goals
import loops
import plots
import tables

STYLE = """body{font:15px/1.5 system-ui,sans-serif;max-width:70em;margin:2em auto;padding:0 1em;color:#222}
table{border-collapse:collapse;margin:1em 0;font-size:13px}td,th{border:1px solid #ccc;padding:.2em .6em;text-align:left}
th{background:#f2f2f2}caption{text-align:left;font-weight:600;padding:.3em 0}figure{margin:1em 0}figure img{max-width:100%}
.no,.fail{color:#b00020;font-weight:600}.yes,.pass{color:#00702a;font-weight:600}"""
# Tables shown as they are: file, title.
RATES = [("speed", "Kernels, each beside its reference in one interleaved run"),
         ("speed_spread", "Worst ticks"),
         ("speed_servo", "Servo loop"),
         ("speed_memory", "Memory"),
         ("structures", "15 structures in 256 x 256 x 256 voxels: build, memory, tick with guard and veto"),
         ("compile_cost", "Compiling")]


def cell(value):
    if isinstance(value, str):
        kind = f" class='{value}'" if value in ("yes", "no", "pass", "fail") else ""
        return f"<td{kind}>{html.escape(value)}</td>"
    return "<td>" + ("–" if value is None or math.isnan(value) else f"{value:.3g}") + "</td>"


def table(header, rows, title):
    if not rows:
        return ""
    lines = ["<table>", f"<caption>{html.escape(title)}</caption>", "<tr>" + "".join(f"<th>{html.escape(h)}</th>" for h in header) + "</tr>"]
    lines += ["<tr>" + "".join(cell(v) for v in row) + "</tr>" for row in rows]
    return "\n".join(lines + ["</table>"])


def plain(rows, title):
    return table(list(rows[0]), [list(row.values()) for row in rows], title) if rows else ""


def figure(path):
    return f"<figure><img src='{os.path.basename(path)}' alt=''></figure>" if path else ""


def beside_the_thesis(sweep, kind):
    laws = {"thesis": (tables.SURFACE_THESIS, tables.LINE_THESIS),
            "default": (tables.SURFACE_DEFAULT, tables.LINE_DEFAULT, tables.COUPLED)}
    rows = []
    for scenario in tables.unique(sweep.rows, "scenario"):
        for name, variants in laws.items():
            for row in filter(None, (sweep.at_defaults(scenario, v, kind) for v in variants)):
                rows.append([scenario, row["renderer"], name, row["samples_per_tick"]]
                            + [factor * row[column] for _, column, factor in goals.COLUMNS.values()] + [row["misses"]])
    return table(["scenario", "renderer", "law", "samples a tick"] + goals.HEADER[1:-1] + ["misses"], rows, f"{kind} error")


def images(sweep):
    rows = []
    for variant in (tables.SURFACE_DEFAULT, tables.LINE_DEFAULT, tables.COUPLED):
        wanted = dict(variant=variant, error_kind="discretisation", scenario=["plane", "sphere", "shaft_cylinder"], steps="1/2vx")
        renderer = tables.renderer_of(variant)
        for row in sweep.where(**wanted, **tables.THESIS_COUNTS[renderer]):
            rows.append([row["scenario"], renderer, row["field"], row["voxel_mm"]]
                        + [factor * row[column] for _, column, factor in goals.COLUMNS.values()] + [row["misses"]])
    return table(["scenario", "renderer", "image", "voxel [mm]"] + goals.HEADER[1:-1] + ["misses"], rows, "The defaults in other images")


def main():
    folder = sys.argv[1]
    sweep = tables.Sweep(tables.read(folder, "error_vs_time"))
    t = {name: tables.read(folder, name) for name in
         ["stability", "stability_energy", "stability_sweep", "coupled_figures", "constants", "cutting", "cutting_figures", "measured"]
         + [name for name, _ in RATES]}
    with open(os.path.join(folder, "conditions.txt"), encoding="utf-8") as file:
        conditions = file.read().strip().splitlines()
    found = goals.goals(sweep)
    drawn = {"error": [], "stability": [], "cutting": []}
    if shutil.which("gnuplot"):
        drawn = plots.all_plots(folder, sweep, t["stability_energy"], t["cutting"], t["measured"])
    else:
        print("make_report: no gnuplot, so no plots", file=sys.stderr)
    sections = {
        "Conditions": ["<ul>" + "".join(f"<li>{html.escape(c)}</li>" for c in conditions) + "</ul>"],
        "Goals": [table(goals.HEADER, found, "Smooth shapes: worst found (goal)"), table(goals.GAIN_HEADER, goals.gains(sweep), "Against the thesis' formulas"),
                  table(["choice: ours, the other", "contact", "figure", "ours", "the other"], goals.choices(sweep), "Choices that the thesis leaves open")],
        "Stability": [*map(figure, drawn["stability"])] + [table(*part) for part in loops.all_tables(t["stability"], t["stability_sweep"])],
        "Coupled tool": [table(*part) for part in (loops.figures(t["coupled_figures"]), loops.constants(t["constants"]))],
        "Cutting": [*map(figure, drawn["cutting"]), plain(t["cutting"], "The cutting law: measured, by formula, simulated"),
                    plain(t["measured"], "Published cuts and the law"),
                    plain(t["cutting_figures"], "The cutting law in steady cuts: judged by bounds")],
        "Error against time": [*map(figure, drawn["error"])] + [beside_the_thesis(sweep, kind) for kind in ("discretisation", "model")] + [images(sweep)],
        "Speed, memory, compiling": [plain(t[name], title) for name, title in RATES],
    }
    body = "".join(f"<h2>{title}</h2>" + "".join(parts) for title, parts in sections.items() if any(parts))
    path = os.path.join(folder, "report.html")
    with open(path, "w", encoding="utf-8") as file:
        file.write(f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>trephine: benchmarks</title><style>{STYLE}</style></head>'
                   f"<body><h1>Benchmarks</h1>{body}</body></html>\n")
    print(f"make_report: wrote {path}")
    for row in found:
        print(f"  [{'met' if row[-1] == 'yes' else 'NOT'}] {row[0]}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
