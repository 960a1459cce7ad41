# SPDX-License-Identifier: MIT
"""make_report.py FOLDER: plots and report.html from the tables that bench/run left in FOLDER."""

import html
import math
import os
import sys

import findings
import plots
import tables


def cell(value, digits=3):
    if isinstance(value, str):
        return html.escape(value)
    if value is None or math.isnan(value):
        return "–"
    return f"{value:.{digits}g}"


def table(header, rows, caption=""):
    text = ["<table>"]
    if caption:
        text.append(f"<caption>{html.escape(caption)}</caption>")
    text.append("<tr>" + "".join(f"<th>{html.escape(h)}</th>" for h in header) + "</tr>")
    for row in rows:
        text.append("<tr>" + "".join(f"<td>{cell(v)}</td>" for v in row) + "</tr>")
    text.append("</table>")
    return "\n".join(text)


def figure(path, caption):
    if path is None:
        return ""
    with open(path, encoding="utf-8") as file:
        svg = file.read()
    # Inline: what gnuplot writes before the element does not belong into a page, and its ids must differ.
    svg = svg[svg.index("<svg"):]
    name = os.path.splitext(os.path.basename(path))[0].replace(".", "_")
    svg = svg.replace("gnuplot_plot_", f"{name}_plot_").replace("id='gp", f"id='{name}_gp").replace("#gp", f"#{name}_gp")
    return f"<figure>{svg}<figcaption>{html.escape(caption)}</figcaption></figure>"


STYLE = """body{font:15px/1.5 system-ui,sans-serif;max-width:70em;margin:2em auto;padding:0 1em;color:#222}
table{border-collapse:collapse;margin:1em 0;font-size:13px}td,th{border:1px solid #ccc;padding:.2em .6em;text-align:left}
th{background:#f2f2f2}caption{text-align:left;font-weight:600;padding:.3em 0}figure{margin:1em 0}figure svg{max-width:100%;height:auto}
figcaption{color:#555;font-size:13px}.no{color:#b00020;font-weight:600}.yes{color:#00702a;font-weight:600}code{background:#f4f4f4}"""


def sweep_tables(sweep):
    """Ours beside the thesis', scenario by scenario, both kinds of error."""
    columns = ["scenario", "algorithm", "law", "median tick [µs]", "p99.9 [µs]", "samples a tick", "force p50 [%]", "force p95 [%]",
               "force p95 [N]", "direction p99 [°]", "torque p95 [%]", "torque p95 [mN·m]", "point p95 [voxel]", "misses"]
    text = []
    for kind in ("discretisation", "model"):
        rows = []
        for scenario in dict.fromkeys(row["scenario"] for row in sweep.rows):
            for renderer, names in (("surface", [("thesis", tables.SURFACE_THESIS), ("area weights", tables.SURFACE_AREA),
                                                 ("default", tables.SURFACE_DEFAULT)]),
                                    ("line", [("thesis", tables.LINE_THESIS), ("default", tables.LINE_DEFAULT)]),
                                    ("coupled", [("default", tables.COUPLED)])):
                for name, variant in names:
                    row = sweep.at_defaults(scenario, variant, kind)
                    if row is None:
                        continue
                    rows.append([scenario, renderer, name, row["tick_ns_median"] / 1e3, row["tick_ns_p999"] / 1e3,
                                 row["samples_per_tick"], 100 * row["force_error_rel_p50"], 100 * row["force_error_rel_p95"],
                                 row["force_error_N_p95"], row["direction_error_deg_p99"], 100 * row["torque_error_rel_p95"],
                                 1e3 * row["torque_error_Nm_p95"], row["point_error_voxel_p95"], row["misses"]])
        what = ("against infinitely many vertices of the same law, or the exact constrained tool" if kind == "discretisation"
                else "against rigid contact; magnitude only for laws that are linear")
        text.append(table(columns, rows, f"{kind} error: {what}; the thesis' counts, CT blur, 8 bit, 0.3 mm, burr of 5 voxels radius"))
    return "\n".join(text)


def image_table(sweep):
    rows = []
    for row in sweep.rows:
        if row["error_kind"] != "discretisation" or row["scenario"] not in ("plane", "sphere", "shaft_cylinder"):
            continue
        if row["variant"] not in (tables.SURFACE_DEFAULT, tables.LINE_DEFAULT) or row["steps"] != "1/2vx" or row["scalar"] != "float":
            continue
        if row["vertices"] != (26 if row["renderer"] == "surface" else 50) or (row["renderer"] == "surface" and (row["slices"], row["per_slice"]) != (20, 8)):
            continue
        rows.append([row["scenario"], row["renderer"], row["field"], row["voxel_mm"], 100 * row["force_error_rel_p95"],
                     row["direction_error_deg_p99"], 100 * row["torque_error_rel_p95"], row["point_error_voxel_p95"], row["misses"]])
    return table(["scenario", "algorithm", "image", "voxel [mm]", "force p95 [%]", "direction p99 [°]", "torque p95 [%]",
                  "point p95 [voxel]", "misses"], rows, "The defaults in other images (bits, contrast c, noise n, voxels of 1 : 1 : 3)")


def plain(rows, columns, caption):
    return table(columns, [[row[c] for c in columns] for row in rows], caption) if rows else ""


def stability_section(rows, sweep, loops):
    if not rows:
        return ""
    words = "".join(f"<li>{html.escape(w)}</li>" for w in findings.stability_words(rows) + findings.sweep_words(sweep))
    ranked = [row[:-1] for row in findings.ranked_stability(rows)]
    presets = [r for r in rows if str(r["scenario"]).startswith("presets:")]
    return (f"<h2>Stability</h2><ul>{words}</ul>{''.join(loops)}"
            + table(["what", "renderer", "options", "limits met", "worst", "limit", "unit", "worst case"], ranked, "Limits by scenario, failures first; every row is in stability.csv")
            + table(*findings.failures(rows), "Limits that our options do not meet, and why")
            + table(*findings.sweep_table(sweep), "Stiffness swept from 10² to 10⁶ N/m: greatest that comes to rest in the usual case (45 g, 0.5 N s/m, light hand) [N/m]; least and greatest share of theory's over all cases; most energy beyond Rule E there [mJ]; most force step a tick there [N]")
            + table(*findings.stability_stages(rows), "What each stage does, Line on a flat wall (K in N/m, amplitudes in mm, forces in N, error in %)")
            + table(*findings.stability_choices(rows), "The thesis' choices one at a time: energy, and greatest stable stiffness in a light hand [N/m]")
            + plain(presets, ["scenario", "case", "renderer", "options", "measured", "unit", "limit", "pass"], "Presets on devices whose damping bears just the stated stiffness"))


def coupled_section(figures, constants):
    if not figures:
        return ""
    words = "".join(f"<li>{html.escape(w)}</li>" for w in findings.figure_words(figures) + findings.constant_words(constants))
    return (f"<h2>The coupled tool, figure by figure</h2><ul>{words}</ul>"
            + table(*findings.figures_table(figures), "Shapes whose truth is known, at seeded places between the voxels, along the axes and turned at random; blur of the image in voxels. "
                    "Greatest of all cases (p99 of directions); NOT: beyond the bound")
            + (table(*findings.constants_table(constants), "Each constant a fifth less and more, on a smaller set: limits no longer met and met anew, and the figure that changes most, in shares of its bound") if constants else ""))


def main():
    if len(sys.argv) != 2 or not os.path.isdir(sys.argv[1]):
        print("usage: make_report.py FOLDER", file=sys.stderr)
        return 2
    folder = sys.argv[1]
    sweep = tables.Sweep(tables.read(folder, "error_vs_time"))
    t = {name: tables.read(folder, name) for name in ("thesis_rates", "convergence", "orders", "first_contact", "ridge_spacing",
                                                      "ripple", "holes", "force_depth", "image_floor", "stability", "stability_plane", "stability_energy", "stability_sweep",
                                                      "stability_thin_walls", "speed", "speed_spread", "speed_servo", "speed_memory",
                                                      "features", "features_spread", "compile_cost", "coupled_figures", "constants")}
    with open(os.path.join(folder, "conditions.txt"), encoding="utf-8") as file:
        conditions = file.read().strip().splitlines()

    drawn = []
    if plots.available():
        for scenario in dict.fromkeys(row["scenario"] for row in sweep.rows):
            for renderer in ("surface", "line", "coupled"):
                path = plots.error_against_time(folder, sweep, scenario, renderer)
                drawn.append(figure(path, f"{renderer} on {scenario}. Every point is a setting of the sweep; the step line joins those that "
                                          "no other beats in both error and time."))
        others = [figure(plots.convergence(folder, t["convergence"], t["orders"]), "Orders of convergence; every one expected to be at least 1."),
                  figure(plots.thesis_rates(folder, t["thesis_rates"]), "The thesis' Figures 26 and 29, its rates beside ours."),
                  figure(plots.speed_by_voxel(folder, t["speed"]), "A tick's cost on finer voxels, the tool the same in metres, beside how CHAI3D's grows (measured on another machine)."),
                  figure(plots.feature_cost(folder, t["features"], t["features_spread"]),
                         "A bar from 1: what listing a neutral feature costs. Between the dashed lines a scene differs from itself."),
                  figure(plots.force_depth(folder, t["force_depth"]), "What the stated stiffness means: every law passes K R/2 at half its radius.")]
        ridges = [figure(plots.ridge_spacing(folder, t["ridge_spacing"], r), "Rings mark settings that did not see every ridge.")
                  for r in sorted({row["ridge_radius_mm"] for row in t["ridge_spacing"]})]
        loops = [figure(plots.stability_plane(folder, t["stability_plane"], r), "What a hit comes to, by the device's damping and the wall's stiffness; theory: b / (T/2 + dT).")
                 for r in ("line", "surface", "coupled")]
        loops += [figure(plots.stability_sweep(folder, t["stability_sweep"], r, o), "Theory is a linear wall's; Surface is stiffer than it is told where it is pressed, and tools held by their shaft softer by their lever.")
                  for r, o in dict.fromkeys((row["renderer"], row["options"]) for row in t["stability_sweep"])]
        loops += [figure(plots.stability_energy(folder, t["stability_energy"], r), "A passive law stays below the dashed line, which is what a held spring leaks (Rule E).")
                  for r in ("line", "surface", "coupled")]
        loops += [figure(plots.thin_walls(folder, t["stability_thin_walls"], k), "Walls of 0.3 mm voxels.")
                  for k in sorted({row["stiffness"] for row in t["stability_thin_walls"]})]
    else:
        print("make_report: no gnuplot, so no plots", file=sys.stderr)
        others, ridges, loops = [], [], []

    goals = findings.goals(sweep, t)
    goal_rows = "".join(f"<tr><td>{html.escape(g.what)}</td><td>{html.escape(g.goal)}</td><td>{html.escape(g.found)}</td>"
                        f"<td class='{'yes' if g.met else 'no'}'>{'met' if g.met else 'not met'}</td></tr>" for g in goals)
    words = "".join(f"<li>{html.escape(w)}</li>" for w in findings.words(sweep, t))
    settled = table(["question", "the thesis' reading", "ours (default)", "figures"], findings.settled(sweep, t), "What the thesis leaves open")
    page = f"""<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>trephine: error against run time</title><style>{STYLE}</style></head><body>
<h1>Error against run time</h1>
<h2>Conditions</h2><ul>{''.join(f'<li>{html.escape(c)}</li>' for c in conditions)}
<li>errors: a case is a tool led along a path of 17 ticks into contact; judged at its end; percentiles over the cases of a scenario.
Relative to max(|F|, 0.05 N) and max(|T|, 1 mN·m); directions only where |F| is at least 0.05 N.</li>
<li>times: the renderer alone, clock included (some 25 ns), over the second half of each path, bone in the cache.</li></ul>
<h2>Findings</h2><ul>{words}</ul>
{stability_section(t['stability'], t['stability_sweep'], loops)}
{coupled_section(t['coupled_figures'], t['constants'])}
<h2>Goals</h2><table><tr><th>what</th><th>goal</th><th>found</th><th></th></tr>{goal_rows}</table>
<h2>Questions settled</h2>{settled}
<h2>Ours beside the thesis'</h2>{sweep_tables(sweep)}
<h2>Error against time</h2>{''.join(drawn)}
<h2>Convergence, rates, laws</h2>{''.join(others)}
{plain(t['orders'], ['what', 'law', 'fitted_order', 'expected_order', 'holds'], 'Orders of convergence')}
{plain(t['thesis_rates'], ['renderer', 'stepping', 'vertices', 'slices', 'tick_ns_median', 'rate_kHz', 'servo_rate_Hz', 'thesis_rate_Hz'], 'Rates')}
<h2>Speed</h2>
{plain(t['speed'], ['measure', 'compiler', 'march', 'ns', 'reference_ns', 'ratio', 'target', 'met'], 'Each beside its reference in one interleaved run; medians. A group whose centre is in bone takes samples one by one, each where the one before tells: its own samples, taken so, bound what its tick can reach')}
{plain(t['speed_spread'], ['case', 'compiler', 'march', 'p50_ns', 'p99_ns', 'p999_ns', 'max_ns', 'samples_bound'], 'Worst cases, tick by tick; the longest are the operating system')}
{plain(t['speed_servo'], ['renderer', 'rate_Hz', 'voxel_mm', 'compiler', 'march', 'share_within_period', 'p50_ns', 'p999_ns', 'missed_periods', 'lateness_p50_ns', 'lateness_p999_ns'], 'A servo loop that spins, on a simulated device: share of ticks, carving included, whose own work fits the period; apart, periods missed and how late ticks began')}
{plain(t['speed_memory'], ['voxels', 'density', 'grid_MB', 'bytes_per_voxel', 'without_original_MB', 'air_map_MB'], 'Memory of a cube of so many voxels a side')}
<h2>Leaving out</h2>
{plain(t['features'], ['renderer', 'feature', 'tick_ns_without', 'tick_ns_with', 'ratio', 'bytes_without', 'bytes_with', 'text_bytes_without', 'text_bytes_with', 'outputs_identical'], 'Scenes without a feature, and with it listed and neutral; the ratio is the median over pairs that ran one after the other')}
{plain(t['features_spread'], ['renderer', 'pairs', 'tick_ns', 'least_ratio', 'greatest_ratio'], 'The same scene twice')}
{plain(t['compile_cost'], ['compiler', 'what', 'header', 'cpu_s', 'peak_MB'], 'Compiling: minimal programs (-O2 -c), headers alone (-fsyntax-only)')}
<h2>Ridges between vertices</h2>{''.join(ridges)}
<h2>Images</h2>{image_table(sweep)}
<h2>What the image leaves</h2>{plain(t['image_floor'], ['scenario', 'field', 'cases', 'surface_error_voxel_rms', 'surface_error_voxel_p95', 'force_error_rel_p95', 'direction_error_deg_p99_cells', 'direction_error_deg_p99_smoothed'], "Where the interpolant's own surface lies off the true one, along the true normal, at the sweep's contacts of Line's tip: no search on it errs less. Normals there: those of single cells, and of the densities smoothed")}
<h2>First contacts</h2>{plain(t['first_contact'], ['shape', 'motion', 'search', 'trials', 'misses', 'passed', 'place_error_voxel_p95', 'place_error_voxel_max', 'tick_ns_median'], 'First contacts at 0.01 to 1 m/s; passed: never found on going on; place error: distance of the point found from the surface')}
<h2>Ripple of a slide at 1 N</h2>{plain(t['ripple'], ['shape', 'renderer', 'contrast', 'noise', 'frequency_Hz', 'mean_N', 'ripple_N_rms_mean', 'ripple_N_rms_max'], 'rms of the force about its trend')}
<h2>Holes and slots</h2>{plain(t['holes'], ['place', 'width_over_diameter', 'renderer', 'rest_depth_mm', 'ideal_mm', 'falls_in'], 'Pressed with 0.5 N; ideal: where a rigid tool would rest')}
<h2>Not measured here</h2><ul>
<li>cold caches and other threads' traffic; a real device and a real hand</li>
<li>magnitudes against rigid contact of laws that are not linear: a rigid bone has no force; see the force–depth curves</li>
<li>deep contact is in the force–depth curves alone: the sweep's cases keep the ball's and slices' centres out of bone</li></ul>
<h2>Again</h2><p><code>bench/run</code> (or <code>bench/run --quick</code>) makes this page and every table beside it.</p>
</body></html>
"""
    path = os.path.join(folder, "report.html")
    with open(path, "w", encoding="utf-8") as file:
        file.write(page)
    print(f"make_report: wrote {path}")
    for g in goals:
        print(f"  [{'met' if g.met else 'NOT'}] {g.what}: {g.found} (goal {g.goal})")
    return 0


if __name__ == "__main__":
    sys.exit(main())
