# SPDX-License-Identifier: MIT
"""What the tables say: goals, settled questions, sentences with numbers."""

import math
from collections import namedtuple

import tables

Goal = namedtuple("Goal", "what goal found met")


def percent(value, digits=2):
    return "–" if value is None or math.isnan(value) else f"{100 * value:.{digits}g} %"


def degrees(value):
    return "–" if value is None or math.isnan(value) else f"{value:.2g}°"


def microseconds(value):
    return "–" if value is None or math.isnan(value) else f"{value / 1e3:.3g} µs"


def recommended(sweep, scenarios, renderer, variant, most_ns, voxel_mm=0.3, key="force_error_rel_p95"):
    """The setting of a variant with the least worst error over the scenarios among those within a time."""
    best = None
    rows = sweep.where(renderer=renderer, variant=variant, error_kind="discretisation", field=tables.DEFAULT_FIELD, voxel_mm=voxel_mm, scalar="float", steps="1/2vx")
    settings = {(r["vertices"], r["slices"], r["per_slice"]) for r in rows}
    for setting in settings:
        mine = [r for r in rows if (r["vertices"], r["slices"], r["per_slice"]) == setting and r["scenario"] in scenarios]
        if {r["scenario"] for r in mine} != set(scenarios) or tables.worst(mine, "tick_ns_median") > most_ns:
            continue
        error = tables.worst(mine, key)
        if best is None or error < best[0]:
            best = (error, setting, mine)
    return best


def goals(sweep, t):
    found = []
    tips = [s for s in tables.SMOOTH_TIPS if sweep.where(scenario=s)]

    coupled = [sweep.at_defaults(s, tables.COUPLED) for s in tips]
    if any(coupled):
        direction = tables.worst(coupled, "direction_error_deg_p99")
        found.append(Goal("Coupled, tip on smooth shapes: direction p99, force p95, median and p99.9 tick", "1.2°, –, 4 µs, 15 µs",
                          f"{degrees(direction)}, {percent(tables.worst(coupled, 'force_error_rel_p95'))}, {microseconds(tables.worst(coupled, 'tick_ns_median'))}, {microseconds(tables.worst(coupled, 'tick_ns_p999'))}",
                          direction <= 1.2 and tables.worst(coupled, "tick_ns_median") <= 4e3 and tables.worst(coupled, "tick_ns_p999") <= 15e3))

    # At the thesis' counts and no more time: the thesis' own formulas against ours.
    for law, variant in (("default law", tables.SURFACE_DEFAULT), ("AreaWeights", tables.SURFACE_AREA)):
        ratios, times = [], []
        for scenario in tips:
            thesis = sweep.at_defaults(scenario, tables.SURFACE_THESIS)
            ours = sweep.at_defaults(scenario, variant)
            if thesis and ours:
                ratios.append(thesis["force_error_rel_p95"] / ours["force_error_rel_p95"])
                times.append(ours["tick_ns_median"] / thesis["tick_ns_median"])
        if ratios:
            # A law that asks how bone lies takes a gradient for each vertex in bone, beside all that the thesis takes.
            least = [r["ratio"] for r in t["speed"] if r["measure"].startswith("the thesis' way and a gradient a hit") and r["march"] == "native"]
            bound = f"; with no more than a gradient a hit: {min(least):.3g} to {max(least):.3g}" if least and variant == tables.SURFACE_DEFAULT else ""
            found.append(Goal(f"Surface, {law}, tip on smooth shapes, the thesis' 207 vertices: times less force error (p95) than the thesis' formulas; time",
                              "at least 4; at most 1", f"{min(ratios):.2g} to {max(ratios):.2g}; {min(times):.2g} to {max(times):.2g}{bound}",
                              min(ratios) >= 4 and max(times) <= 1.05))
    # The same at equal time, whatever the counts.
    equal = []
    for scenario in tips:
        thesis = sweep.at_defaults(scenario, tables.SURFACE_THESIS)
        if not thesis:
            continue
        within = [r for r in sweep.where(scenario=scenario, renderer="surface", error_kind="discretisation", field=tables.DEFAULT_FIELD, voxel_mm=0.3)
                  if r["tick_ns_median"] <= thesis["tick_ns_median"] and r["variant"] not in (tables.SURFACE_THESIS, "ratio-extend-full-analytic")
                  and r["vertices"] + 1 + r["slices"] * (r["per_slice"] + 1) <= 207 + 60]
        if within:
            equal.append(thesis["force_error_rel_p95"] / min(r["force_error_rel_p95"] for r in within))
    if equal:
        found.append(Goal("Surface, within the thesis' time and about its number of vertices, laid out anew: times less force error (p95)", "at least 4",
                          f"{min(equal):.2g} to {max(equal):.2g}", min(equal) >= 4))
    ratios, times = [], []
    for scenario in tips:
        thesis, ours = sweep.at_defaults(scenario, tables.LINE_THESIS), sweep.at_defaults(scenario, tables.LINE_DEFAULT)
        if thesis and ours:
            ratios.append(thesis["force_error_rel_p95"] / ours["force_error_rel_p95"])
            times.append(ours["tick_ns_median"] / thesis["tick_ns_median"])
    if ratios:
        bounds = []
        for scenario in tips:
            floor = [r["force_error_rel_p95"] for r in t["image_floor"] if r["scenario"] == scenario and r["field"] == tables.DEFAULT_FIELD]
            thesis = sweep.at_defaults(scenario, tables.LINE_THESIS)
            if floor and thesis:
                bounds.append(thesis["force_error_rel_p95"] / floor[0])
        bound = f"; bound of the interpolant: {min(bounds):.2g} to {max(bounds):.2g}" if bounds else ""
        found.append(Goal("Line, tip on smooth shapes, 50 vertices: times less force error (p95) than the thesis' way; time", "at least 4; at most 1",
                          f"{min(ratios):.2g} to {max(ratios):.2g}; {min(times):.2g} to {max(times):.2g}{bound}", min(ratios) >= 4 and max(times) <= 1.05))

    found += default_goals(sweep)
    for law, variant in (("default law", tables.SURFACE_DEFAULT), ("AreaWeights", tables.SURFACE_AREA)):
        best = recommended(sweep, tips, "surface", variant, 20e3) if tips else None
        if not best:
            continue
        error, (sphere, slices, per_slice), rows = best
        direction, point = tables.worst(rows, "direction_error_deg_p99"), tables.worst(rows, "point_error_voxel_p95")
        found.append(Goal(f"Surface, {law}, {sphere:.0f} + {slices:.0f} x {per_slice:.0f} vertices, within 20 µs, smooth tips: force p95, direction p99, point p95",
                          "1 %, 2°, 0.05 voxel", f"{percent(error)}, {degrees(direction)}, {point:.2g} voxel in {microseconds(tables.worst(rows, 'tick_ns_median'))}",
                          error <= 0.01 and direction <= 2 and point <= 0.05))
    rows = [sweep.at_defaults(s, tables.LINE_DEFAULT) for s in tips]
    rows = [r for r in rows if r]
    if rows:
        error, direction, point = (tables.worst(rows, k) for k in ("force_error_rel_p95", "direction_error_deg_p99", "point_error_voxel_p95"))
        found.append(Goal("Line's tip, 50 vertices, smooth shapes: force p95, direction p99, point p95", "1 %, 2°, 0.05 voxel",
                          f"{percent(error)}, {degrees(direction)}, {point:.2g} voxel in {microseconds(tables.worst(rows, 'tick_ns_median'))}",
                          error <= 0.01 and direction <= 2 and point <= 0.05))
    shafts = [s for s in tables.SMOOTH_SHAFTS if sweep.where(scenario=s)]
    for voxel, radius in ((0.3, "2.7"), (0.15, "5.3")):
        for renderer, variant, most in (("line", tables.LINE_DEFAULT, 50e3), ("surface", tables.SURFACE_AREA, 20e3), ("surface", tables.SURFACE_DEFAULT, 20e3)):
            best = recommended(sweep, shafts, renderer, variant, most, voxel, "torque_error_rel_p95")
            if not best:
                continue
            error, (sphere, slices, per_slice), rows = best
            direction = tables.worst(rows, "direction_error_deg_p99")
            counts = f"{sphere:.0f} vertices" if renderer == "line" else f"{sphere:.0f} + {slices:.0f} x {per_slice:.0f}"
            name = renderer.capitalize() + (", AreaWeights" if variant == tables.SURFACE_AREA else "")
            found.append(Goal(f"{name}, shaft ({radius} voxels radius) on smooth shapes, {counts}: torque p95, direction p99", "2 %, 2°",
                              f"{percent(error)}, {degrees(direction)} in {microseconds(tables.worst(rows, 'tick_ns_median'))}",
                              error <= 0.02 and direction <= 2))
    line_model = tables.worst([r for r in (sweep.at_defaults(s, tables.LINE_DEFAULT, "model") for s in tips) if r], "direction_error_deg_p99")
    for what, value in ((f"Line, 50 vertices", line_model),
                        ("Surface, the thesis' 207", tables.worst([r for r in (sweep.at_defaults(s, tables.SURFACE_DEFAULT, "model") for s in tips) if r], "direction_error_deg_p99")),
                        ("Surface, AreaWeights, the thesis' 207", tables.worst([r for r in (sweep.at_defaults(s, tables.SURFACE_AREA, "model") for s in tips) if r], "direction_error_deg_p99"))):
        if not math.isnan(value):
            found.append(Goal(f"Direction against rigid contact, smooth tips (p99): {what}", "5°", degrees(value), value <= 5))
    if t["first_contact"]:
        for what, chosen in (("plane, ball, bar, wall of 2 voxels", lambda r: r["shape"] != "wall_1_voxel"),
                             ("wall of 1 voxel", lambda r: r["shape"] == "wall_1_voxel")):
            rows = [r for r in t["first_contact"] if "refined" in r["search"] and chosen(r)]
            trials, misses, passed = (sum(r[k] for r in rows) for k in ("trials", "misses", "passed"))
            found.append(Goal(f"First contacts missed by the swept searches at .01 to 1 m/s: {what}", "none (in 10⁵)",
                              f"{misses:.0f} in {trials:.0f}" + (f", {passed:.0f} never found on going on" if misses else ""), misses == 0))
    if t["ripple"]:
        for renderer in ("line", "surface patch 200", "surface patch 26", "surface area 26"):
            rows = [r for r in t["ripple"] if r["contrast"] >= 60 and r["noise"] == 0 and r["renderer"] == renderer]
            worst = max((r["ripple_N_rms_max"] for r in rows), default=math.nan)
            found.append(Goal(f"Ripple of a slide at 1 N over plane and ball, contrast 60 and more: {renderer}", "0.02 N rms",
                              f"{worst:.2g} N rms at most", worst < 0.02))
    if t["orders"]:
        bad = [r for r in t["orders"] if r["holds"] == 0]
        found.append(Goal("Orders of convergence at least .9 of the expected", "all", f"{len(t['orders']) - len(bad)} of {len(t['orders'])}", not bad))
    return found


def pair(sweep, scenarios, first, second, key, kind="discretisation", form=percent, **more):
    a = tables.worst([r for r in (sweep.at_defaults(s, first, kind, **more) for s in scenarios) if r], key)
    b = tables.worst([r for r in (sweep.at_defaults(s, second, kind, **more) for s in scenarios) if r], key)
    return f"{form(a)} against {form(b)}"


def counts_pair(sweep, scenarios, key, form=percent):
    ours = tables.worst([sweep.at_defaults(s, tables.SURFACE_DEFAULT, **tables.SURFACE_COUNTS) for s in scenarios], key)
    return f"{form(ours)} against {form(tables.worst([sweep.at_defaults(s, tables.SURFACE_DEFAULT) for s in scenarios], key))}"


def default_goals(sweep):
    """What a Surface scene is off that names neither law nor counts, image by image, and what no number of vertices mends there."""
    found = []
    if sweep.where(renderer="surface") and not sweep.where(renderer="surface", field=tables.DEFAULT_FIELD, **tables.SURFACE_COUNTS):
        raise ValueError("the sweep has no rows of SurfaceCounts{}: tables.SURFACE_COUNTS says something else")
    for field, name in (("ct_blur_8bit", "CT blur, 8 bit"), ("ct_blur_16bit", "CT blur, 16 bit"), ("ct_blur_8bit_c60", "CT blur, contrast 60"),
                        ("partial_volume_8bit", "partial volume, 8 bit"), ("partial_volume_16bit", "partial volume, 16 bit")):
        def rows(scenarios, counts, kind="discretisation"):
            return [r for r in (sweep.at_defaults(s, tables.SURFACE_DEFAULT, kind, field=field, **counts) for s in scenarios) if r]
        tips, shafts = rows(tables.SMOOTH_TIPS, tables.SURFACE_COUNTS), rows(tables.SMOOTH_SHAFTS, tables.SURFACE_COUNTS)
        if not tips:
            continue
        model = rows(tables.SMOOTH_TIPS + tables.SMOOTH_SHAFTS, tables.SURFACE_COUNTS, "model")
        figures = [tables.worst(tips, "force_error_rel_p95"), tables.worst(tips + shafts, "direction_error_deg_p99"), tables.worst(shafts, "torque_error_rel_p95"),
                   tables.worst(model, "direction_error_deg_p99"), tables.worst(tips, "point_error_voxel_p95"), tables.worst(tips + shafts, "tick_ns_median")]
        met = all(math.isnan(v) or v <= most for v, most in zip(figures, (0.01, 2, 0.02, 5, 0.05, 20e3)))
        told = f"{percent(figures[0])}, {degrees(figures[1])}, {percent(figures[2])}, {degrees(figures[3])}, {figures[4]:.2g} voxel, {microseconds(figures[5])}"
        if not met:
            least = (tables.worst(rows(tables.SMOOTH_TIPS, tables.DENSEST), "force_error_rel_p95"), tables.worst(rows(tables.SMOOTH_SHAFTS, tables.DENSEST), "torque_error_rel_p95"))
            told += f"; with 1000 + 200 x 16 vertices, the image's own: {percent(least[0])}, torque {percent(least[1])}"
        found.append(Goal(f"Surface, default law and counts, {name}, smooth shapes: force p95, direction p99, torque p95, direction against rigid contact p99, the tip's contact p95, greatest median tick",
                          "1 %, 2°, 2 %, 5°, 0.05 voxel, 20 µs", told, met))
    return found


def settled(sweep, t):
    """Rows: question, thesis, ours, figures (ours first)."""
    tips = [s for s in tables.SMOOTH_TIPS if sweep.where(scenario=s)]
    shafts = [s for s in tables.SMOOTH_SHAFTS if sweep.where(scenario=s)]
    line = tables.LINE_DEFAULT
    rows = [
        ["sum of the vertex springs", "Eq. 16, CollisionRatio", "PatchWeights",
         "force p95, smooth tips, 26 vertices: " + pair(sweep, tips, tables.SURFACE_DEFAULT, tables.SURFACE_THESIS, "force_error_rel_p95")
         + "; direction p99 " + pair(sweep, tips, tables.SURFACE_DEFAULT, tables.SURFACE_THESIS, "direction_error_deg_p99", form=degrees)
         + "; time " + pair(sweep, tips, tables.SURFACE_DEFAULT, tables.SURFACE_THESIS, "tick_ns_median", form=microseconds)
         + ". At 200 vertices: " + pair(sweep, tips, tables.SURFACE_DEFAULT, tables.SURFACE_AREA, "force_error_rel_p95", vertices=200.0)
         + " of AreaWeights, for " + pair(sweep, tips, tables.SURFACE_DEFAULT, tables.SURFACE_AREA, "tick_ns_median", form=microseconds, vertices=200.0)],
        ["vertices", "26 + 20 x 8", "{vertices:.0f} + {slices:.0f} x {per_slice:.0f}".format(**tables.SURFACE_COUNTS),
         "force p95, smooth tips: " + counts_pair(sweep, tips, "force_error_rel_p95") + "; torque p95, smooth shafts: " + counts_pair(sweep, shafts, "torque_error_rel_p95")
         + "; time " + counts_pair(sweep, tips, "tick_ns_median", microseconds)],
        ["normals", "StoredGradient", "SplineGradient (Line)",
         "tip, force p95: " + pair(sweep, tips, line, line.replace("spline", "stored"), "force_error_rel_p95") + "; direction p99: "
         + pair(sweep, tips, line, line.replace("spline", "stored"), "direction_error_deg_p99", form=degrees)
         + "; AnalyticGradient " + percent(tables.worst([r for r in (sweep.at_defaults(s, line.replace("spline", "analytic")) for s in tips) if r], "force_error_rel_p95"))],
        ["tracking", "ProjectedTracking", "ConstrainedTracking",
         "shaft, torque p95: " + pair(sweep, shafts, line, line.replace("constrained", "projected"), "torque_error_rel_p95")
         + "; CentrelineTracking " + percent(tables.worst([r for r in (sweep.at_defaults(s, line.replace("constrained", "centreline")) for s in shafts) if r], "torque_error_rel_p95"))],
        ["between vertices", "vertices alone", "refine = true",
         "shaft, torque p95: " + pair(sweep, shafts, line, line.replace("-refined", ""), "torque_error_rel_p95") + "; time "
         + pair(sweep, shafts, line, line.replace("-refined", ""), "tick_ns_median", form=microseconds)],
        ["stepping", "TranslateRotate and RayCast alike", "TranslateRotate",
         "shaft, torque p95: " + pair(sweep, shafts, line, line.replace("translate_rotate", "ray_cast"), "torque_error_rel_p95") + "; time "
         + pair(sweep, shafts, line, line.replace("translate_rotate", "ray_cast"), "tick_ns_median", form=microseconds)
         + ": the thesis found no difference in speed; nor is there one in error"],
        ["torque from", "proxy (our reading)", "TorqueOrigin::kProxy",
         "shaft, torque p95: " + pair(sweep, shafts, line, line + "-probe_origin", "torque_error_rel_p95") + " (equal where the tip is free)"],
        ["the shaft's part", "TorqueOnly", "FullWrench",
         "shaft, force p95: " + pair(sweep, shafts, line, line.replace("-full-", "-torque-"), "force_error_rel_p95", kind="model")
         + " cannot tell: decided by energy, tests/render/energy.cpp (closed paths: 25 % of the work comes back with torque alone, 1 % with the full wrench)"],
        ["precision", "–", "float", "tip, force p95: " + pair(sweep, tips, line, line, "force_error_rel_p95")
         + "; double " + percent(tables.worst([r for r in (sweep.at_defaults(s, line, scalar="double") for s in tips) if r], "force_error_rel_p95"))],
    ]
    rows[-1][3] = rows[-1][3].replace(" against " + rows[-1][3].split(" against ")[1].split(";")[0], "", 1)
    first = t["first_contact"]
    if first:
        def missed(search):
            mine = [r for r in first if r["search"] == search and r["shape"].startswith("wall_1")]
            trials = sum(r["trials"] for r in mine)
            return sum(r["misses"] for r in mine) / trials if trials else math.nan
        rows.append(["when a contact is seen", "collision at t", "Trigger::kSwept",
                     f"walls of one voxel missed: {percent(missed('translate_rotate 1/2 voxel refined'))} against "
                     + percent(missed("translate_rotate 1/2 voxel, thesis' trigger"))])
    depth = t["force_depth"]
    if depth:
        def spread(law):
            mine = [r for r in depth if r["law"] == law and 1.2 <= r["depth_over_R"] <= 2]
            return max((r["direction_deg_max"] for r in mine if not math.isnan(r["direction_deg_max"])), default=math.nan), \
                (mine[-1]["force_N_mean"] / mine[0]["force_N_mean"] if mine else math.nan)
        hold, extend = spread("ratio hold (thesis)"), spread("ratio extend")
        rows.append(["deep contact", "HoldForce", "ExtendAlongSurface",
                     f"from 1.2 to 2 radii deep: direction off by {degrees(extend[0])} against {degrees(hold[0])}; force grows {extend[1]:.2g}-fold against {hold[1]:.2g}-fold"])
    return rows


def words(sweep, t):
    """Sentences for a reader in a hurry."""
    said = []
    for scenario in ("plane", "sphere"):
        thesis, ours = sweep.at_defaults(scenario, tables.SURFACE_THESIS), sweep.at_defaults(scenario, tables.SURFACE_DEFAULT)
        if thesis and ours:
            said.append(f"Surface on a {scenario}, the thesis' 207 vertices: force error p95 {percent(ours['force_error_rel_p95'])} "
                        f"in {microseconds(ours['tick_ns_median'])} against {percent(thesis['force_error_rel_p95'])} in {microseconds(thesis['tick_ns_median'])} with the thesis' sum; "
                        f"direction p99 {degrees(ours['direction_error_deg_p99'])} against {degrees(thesis['direction_error_deg_p99'])}.")
        thesis, ours = sweep.at_defaults(scenario, tables.LINE_THESIS), sweep.at_defaults(scenario, tables.LINE_DEFAULT)
        if thesis and ours:
            said.append(f"Line on a {scenario}: force error p95 {percent(ours['force_error_rel_p95'])}, direction p99 {degrees(ours['direction_error_deg_p99'])} "
                        f"in {microseconds(ours['tick_ns_median'])} against {percent(thesis['force_error_rel_p95'])}, {degrees(thesis['direction_error_deg_p99'])} in {microseconds(thesis['tick_ns_median'])}.")
    for name, words_of in (("shaft_cylinder", "a round bar"), ("shaft_ridge", "a round ridge")):
        thesis, ours = sweep.at_defaults(name, tables.LINE_THESIS), sweep.at_defaults(name, tables.LINE_DEFAULT)
        if thesis and ours:
            said.append(f"Line's shaft on {words_of}: torque error p95 {percent(ours['torque_error_rel_p95'])} against {percent(thesis['torque_error_rel_p95'], 3)}; "
                        f"the price is time, {microseconds(ours['tick_ns_median'])} against {microseconds(thesis['tick_ns_median'])}.")
    said.append("Where the thesis was right: ray casting and translate-rotate differ in neither error nor misses, and its rates hold: computing is no longer what limits the counts.")
    ripple = {name: max((r["ripple_N_rms_max"] for r in t["ripple"] if r["contrast"] >= 60 and r["noise"] == 0 and r["renderer"] == name), default=math.nan)
              for name in ("line", "line (cell normals)", "surface patch 26", "surface patch 200")}
    said.append(f"Whether Surface's sum is smoother than Line's single point depends on the normals: slid at 1 N Line ripples by {ripple['line (cell normals)']:.2g} N rms with those of "
                f"single cells and by {ripple['line']:.2g} N with smoothed ones, Surface by {ripple['surface patch 26']:.2g} N with 26 vertices and by {ripple['surface patch 200']:.2g} N with 200.")
    binary = sweep.where(scenario="plane", field="binary_8bit", renderer="line", error_kind="discretisation", vertices=50.0, steps="1/2vx")
    if binary:
        said.append(f"Binary masks spoil what any counts can reach: Line on a plane errs by {percent(binary[0]['force_error_rel_p95'])} (p95) there. Keep the scanner's grey levels.")
    if t["holes"]:
        falls = sorted({r["width_over_diameter"] for r in t["holes"] if r["renderer"] == "surface patch" and r["place"] == "round hole" and r["falls_in"] == 1})
        if falls:
            said.append(f"Line's point tip falls into every hole; Surface holds over narrow ones and falls into holes from {falls[0]:g} burr diameters on, where only a thin ring of its vertices touches.")
    return said


def ranked_stability(rows):
    """Limits by scenario, renderer and options: how many were met and how far the worst is off; failures first."""
    groups = {}
    for row in rows:
        if row["pass"] in ("pass", "fail"):
            groups.setdefault((row["scenario"], row["renderer"], row["options"]), []).append(row)
    table = []
    for (scenario, renderer, options), mine in groups.items():
        worst = max(mine, key=lambda r: r["measured"])
        failed = sum(r["pass"] == "fail" for r in mine)
        table.append([scenario, renderer, options, f"{len(mine) - failed} of {len(mine)}", worst["measured"], worst["limit"],
                      "" if isinstance(worst["unit"], float) else worst["unit"], worst["case"], failed])
    table.sort(key=lambda row: (row[-1] == 0, str(row[0]), str(row[1]), str(row[2])))
    return table


def of(rows, scenario, **wanted):
    return [r for r in rows if (scenario is None or r["scenario"] == scenario) and all(r[k] == v for k, v in wanted.items())]


def stability_stages(rows):
    """One line a stack: what it does to the greatest stable stiffness, what it costs."""
    columns = [("greatest stable K", "b .5; hand none; delay 0"), ("greatest stable K", "b .5; hand none; delay 1"), ("greatest stable K", "b .5; hand firm; delay 0"),
               ("amplitude left at 1500 N/m", None), ("amplitude left at 5000 N/m", None), ("stiffness felt at 1 Hz of 800 N/m", None),
               ("stiffness felt at 20 Hz of 800 N/m", None), ("force error", None), ("greatest force step", None), ("ripple held with a quantum of .055 mm", None)]
    header = ["stages"] + [f"{name}{', ' + case if case else ''}" for name, case in columns]
    table = []
    for stack in dict.fromkeys(r["options"] for r in rows if str(r["scenario"]).startswith("stages:")):
        line = [stack]
        for name, case in columns:
            found = [r for r in of(rows, "stages: " + name, options=stack) if case is None or r["case"] == case]
            line.append(found[0]["measured"] if found else math.nan)
        table.append(line)
    return header, table


def stability_choices(rows):
    """The thesis' choices one at a time: net work of closed paths, greatest stable stiffness by place."""
    places = list(dict.fromkeys(r["case"] for r in rows if str(r["scenario"]).startswith("choices:")))
    header = ["renderer", "choice", "closed paths: worst net work [%]", "mean [%]", "greatest force step [N]"] + [f"K: {p}" for p in places]
    table = []
    for renderer in ("line", "surface", "coupled"):
        names = list(dict.fromkeys(r["options"] for r in rows if r["renderer"] == renderer and str(r["scenario"]).startswith("choices:")))
        for name in names:
            pick = lambda s: next((r["measured"] for r in of(rows, s, renderer=renderer, options=name)), math.nan)
            table.append([renderer, name, pick("21 closed paths: worst net work"), pick("21 closed paths: mean net work"), pick("21 closed paths: greatest force step")]
                         + [next((r["measured"] for r in rows if str(r["scenario"]).startswith("choices:") and r["renderer"] == renderer and r["options"] == name and r["case"] == p), math.nan)
                            for p in places])
    return header, table


def places_words(rows):
    """The coupled tool's greatest stable stiffness by place, as felt and as stated, against theory."""
    said = []
    for scenario, title in (("13 stiffness felt by place at K_crit off theory's", "the stiffness felt at the border"),
                           ("13 K_crit by place off theory's", "the greatest stable stiffness as stated")):
        every = of(rows, scenario)
        for options in dict.fromkeys(r["options"] for r in every):
            mine = [r for r in every if r["options"] == options]
            bad = [r for r in mine if r["pass"] == "fail"]
            parts = [f"{place} {tables.worst([r for r in bad if r['case'].startswith(place + '; b ')], 'measured'):.2g} % (from {min(r['reference'] for r in bad if r['case'].startswith(place + '; b ')):.0f} N/m on)"
                     for place in dict.fromkeys(r["case"].split("; b ")[0] for r in bad)]
            said.append(f"coupled, {options}: {title} is theory's within {mine[0]['limit']:g} % in {len(mine) - len(bad)} of {len(mine)} cases over all places"
                        + ("; off by more: " + ", ".join(parts) if parts else "") + ".")
    return said


def finite(rows, key):
    return [r[key] for r in rows if not isinstance(r[key], str) and not math.isnan(r[key])]


def sweep_table(rows):
    """A line a renderer, a column a place."""
    places = list(dict.fromkeys(r["place"] for r in rows))
    table = []
    for tool in dict.fromkeys((r["renderer"], r["options"]) for r in rows):
        line = list(tool)
        for place in places:
            mine = [r for r in rows if (r["renderer"], r["options"]) == tool and r["place"] == place]
            usual = next((r["stable_N_per_m"] for r in mine if (r["damping"], r["delay"], r["hand"], r["friction"], r["quantum_mm"]) == (0.5, 0, "light", 0, 0)), math.nan)
            shares = [r["stable_N_per_m"] / r["theory_N_per_m"] for r in mine]
            line.append(f"{usual:.0f} ({min(shares):.2g} to {max(shares):.2g}); {max(0, *finite(mine, 'beyond_mJ')):.1g} mJ; {max(finite(mine, 'force_step_N')):.2g} N")
        table.append(line)
    return ["renderer", "options"] + places, table


def sweep_words(rows):
    """What the sweep over places and factors comes to."""
    said = []
    for renderer, options in dict.fromkeys((r["renderer"], r["options"]) for r in rows):
        mine = [r for r in rows if (r["renderer"], r["options"]) == (renderer, options)]
        tips = [r for r in mine if not r["place"].startswith(("shaft", "one bar"))]
        never = [r for r in mine if r["stable_N_per_m"] == 0]
        by_place = {}
        for r in never:
            by_place[r["place"]] = by_place.get(r["place"], 0) + 1
        shares = [r["stable_N_per_m"] / r["theory_N_per_m"] for r in tips if r["stable_N_per_m"] > 0 and r["friction"] == 0 and r["quantum_mm"] == 0]
        cycles = [r for r in mine if not math.isnan(r["frequency_Hz"]) and r["amplitude_mm"] > 0.1]
        beyond = [r for r in mine if r["beyond_mJ"] > 1e-3]
        text = f"{renderer}, {options}, swept over {len(mine)} cases of {len(set(r['place'] for r in mine))} places: "
        if shares:
            text += f"pressed by the tip, without friction and encoders, the greatest stable stiffness is {min(shares):.2g} to {max(shares):.2g} of theory's for a linear wall; "
        if never:
            text += "none of 10² to 10⁶ N/m rests in " + ", ".join(f"{n} of {sum(r['place'] == p for r in mine)} cases at {p}" for p, n in by_place.items()) + "; "
        if cycles:
            text += (f"twice as stiff it trembles at {min(r['frequency_Hz'] for r in cycles):.0f} to {max(r['frequency_Hz'] for r in cycles):.0f} Hz, "
                     f"by {sorted(r['amplitude_mm'] for r in cycles)[len(cycles) // 2]:.2g} mm on the median; ")
        text += f"beyond Rule E at the border: {len(beyond)} cases" + (f", most {max(r['beyond_mJ'] for r in beyond):.2g} mJ at {max(beyond, key=lambda r: r['beyond_mJ'])['place']}." if beyond else ".")
        said.append(text)
    return said


def figures_table(rows):
    """A line a figure: its bound, the median of all, and the judged values by blur and image."""
    kinds = list(dict.fromkeys((r["blur_voxels"], r["image"]) for r in rows if not math.isnan(r["blur_voxels"])))
    table = []
    for name in dict.fromkeys(r["figure"] for r in rows):
        mine = [r for r in rows if r["figure"] == name]
        by_kind = {(r["blur_voxels"], r["image"]): r for r in mine}
        single = [r for r in mine if math.isnan(r["blur_voxels"])]
        cells = [by_kind.get(k) or (single[0] if single and k == kinds[0] else None) for k in kinds]
        medians = sorted(r["median"] for r in mine)
        table.append([name, f"{sum(r['cases'] for r in mine):.0f}", mine[0]["bound"], mine[0]["unit"] if isinstance(mine[0]["unit"], str) else "", medians[len(medians) // 2]]
                     + ["–" if r is None else f"{r['judged']:.2g}" + (" NOT" if r["pass"] == "fail" else "") for r in cells])
    return ["figure", "cases", "bound", "unit", "median"] + [f"σ {blur:g}, {image}" for blur, image in kinds], table


def figure_words(rows):
    """How many of the figures keep their bounds, those that do not, and the image's part in directions."""
    names = list(dict.fromkeys(r["figure"] for r in rows if r["pass"] in ("pass", "fail")))
    failed = [n for n in names if any(r["figure"] == n and r["pass"] == "fail" for r in rows)]
    said = [f"{len(names) - len(failed)} of {len(names)} figures keep their bounds at every place, orientation, blur and depth of grey."]
    if failed:
        parts = []
        for n in failed:
            mine = [r for r in rows if r["figure"] == n]
            parts.append(f"{n} {tables.worst(mine, 'judged'):.2g} for {mine[0]['bound']:g}")
        said.append("Beyond their bounds: " + "; ".join(parts) + ".")
    parts = []
    for r in of(rows, None, figure="direction on a plane: a rigid ball on the image's own surface"):
        ours = of(rows, None, figure="direction on a plane: the tool", blur_voxels=r["blur_voxels"], image=r["image"])
        if ours:
            parts.append(f"blurred by {r['blur_voxels']:g} voxel {degrees(ours[0]['judged'])} against {degrees(r['judged'])}")
    if parts:
        said.append("Direction on planes, p99, beside that of a rigid ball on the image's own surface: " + "; ".join(parts) + ". A foundation takes the mean of a surface that a rigid ball touches at one to three places.")
    return said


def constants_table(rows):
    """A line a constant and factor: limits lost and won, the greatest change."""
    table = []
    for key in dict.fromkeys((r["constant"], r["header"], r["factor"]) for r in rows):
        mine = [r for r in rows if (r["constant"], r["header"], r["factor"]) == key]
        if mine[0]["figure"] == "does not build":
            table.append([*key, "does not build", "", "", ""])
            continue
        lost = [r for r in mine if r["pass_before"] == "pass" and r["pass_after"] == "fail"]
        won = [r for r in mine if r["pass_before"] == "fail" and r["pass_after"] == "pass"]
        most = max((r for r in mine if not math.isnan(r["bound"])), key=lambda r: abs(r["after"] - r["before"]) / r["bound"])
        names = "; ".join(dict.fromkeys(f"{r['figure']} ({r['before']:.3g} → {r['after']:.3g})" for r in lost))
        table.append([*key, names or "none", f"{len(won)}", (most["after"] - most["before"]) / most["bound"], f"{most['figure']} ({most['before']:.3g} → {most['after']:.3g})"])
    return ["constant", "header", "times", "limits no longer met", "met anew", "greatest change / bound", "of"], table


def constant_words(rows):
    """Which constants decide whether a figure keeps its bound."""
    if not rows:
        return []
    names = list(dict.fromkeys((r["constant"], r["header"]) for r in rows))
    deciding = list(dict.fromkeys((r["constant"], r["header"]) for r in rows if r["pass_before"] == "pass" and r["pass_after"] == "fail"))
    return [f"{len(names) - len(deciding)} of {len(names)} constants of the coupled tool can be a fifth less or more without a figure passing its bound"
            + ("; not so: " + ", ".join(f"{c} ({h})" for c, h in deciding) if deciding else "") + "."]


# Why our options miss limits: scenario and renderers, and what does it. Derived in words; the figures are the tables'.
REASONS = [
    ("21 closed paths: most net work gained", ("line",), "the shaft, never the tip: Eq. 8 to 12 give k r² to rotation at a lever r that moves along the shaft as it turns and slides, and leave out what that does "
     "(2 k r (1 − cos θ) ∂r/∂x, about θ/2 of the force); and friction holds the line's far end, not the place that touches. With a constant rotational stiffness the net work falls to a sixth"),
    ("21 closed paths", ("line",), "tip: the spring points along smoothed normals, the proxy slides on the interpolant, a degree apart, and loses; shaft: its lever moves (k r² to rotation, without the part of ∂r/∂x)"),
    ("21 closed paths", ("surface",), "springs toward a centre are no gradient: pressed sideways, few vertices push by depth; where a centre enters bone, the way out is another"),
    ("20 greatest force step", ("line",), "a cut by rate wears all that the ball covers at once, and it lets go at once; an advancing cut does not. What is left then: the shaft, which cuts nothing, "
     "slips off the hole's rim, and under 10 N the drill breaks through skull and block"),
    ("20 greatest force step", ("coupled",), "under 10 N a cut by rate leaves a last layer of bone that gives way at once; an advancing cut takes the drill through the block, and the bone that held it ends in a tick"),
    ("13 K_crit by place", ("coupled",), "edges and corners yield more, hollows less, than the plane that the coupling makes up for; the stiffer the coupling, the more that counts"),
    ("20 greatest force step", ("surface",), "pressed beyond what its springs hold it sinks in by more than the ball's radius, where vertices find another way out at once; a rate limit makes it a slope"),
    ("20 energy beyond Rule E", ("surface",), "where it falls through, the rate limit takes back late what the springs let go at once"),
    ("13 K_crit off the analytic wall", ("surface",), "on a tilted wall the interpolant's normals are off by a degree, so that depths along rays change by 2 % more or less than the tool moves"),
    ("14 stiffness felt", ("surface",), "the stated stiffness is the secant at half a radius; at 0.6 mm the tangent is 1.6 times that, and springs of a shaft add up; `budget` bounds both"),
    ("14 rotational stiffness felt", ("surface",), "springs of a shaft add up by their levers; `budget` bounds it"),
    ("amplitude left", ("surface",), "one tick late: pressed with 1 N the tangent is 2.6 times the stated stiffness, 2070 N/m, beyond theory's 1667; a shaft's springs add up. Rests with a `budget`, or at a stated stiffness below some 500 N/m"),
    ("16 ripple at rest", ("surface",), "with encoders of 0.055 mm the quantum times the tangent stiffness of all that touches, 0.1 N and more a step; one tick late as the amplitude"),
    ("16 side flips", ("surface",), "one tick late, as the amplitude"),
    ("15 force step", ("line",), "a point that slides off an edge lets go of stiffness times depth, as an exact point does"),
    ("15 force step", ("surface",), "vertices that turn from one face to another find another way out at once"),
    ("energy beyond Rule E", ("surface",), "springs that jump to another way out, at edges and where a centre enters bone"),
    ("energy beyond Rule E", ("line",), "at edges the point lets go of its spring at once and takes hold again"),
    ("17 falls through", ("surface",), "a vertex looks for its surface toward the centre, and on its way out takes the nearer side"),
    ("presets", ("surface",), "400 N/m and 1.7 N on a ball of 1.5 mm: it sinks through"),
]
THESIS_OPTIONS = ("thesis", "Eq. 16", "held force", "torque without force", "projected tracking", "stored gradient", "thesis' trigger", "most active vertex", "renderer alone")


def failures(rows):
    """By scenario and options of ours: limits not met, the worst, why."""
    groups = {}
    for row in rows:
        if row["pass"] == "fail" and not row["options"].startswith(THESIS_OPTIONS):
            groups.setdefault((row["scenario"], row["renderer"], row["options"]), []).append(row)
    judged = {}
    for row in rows:
        if row["pass"] in ("pass", "fail"):
            key = (row["scenario"], row["renderer"], row["options"])
            judged[key] = judged.get(key, 0) + 1
    table = []
    for (scenario, renderer, options), mine in groups.items():
        worst = max(mine, key=lambda r: r["measured"])
        why = next((reason for start, renderers, reason in REASONS if start in scenario and renderer in renderers), "not known")
        table.append([scenario, renderer, options, f"{len(mine)} of {judged[(scenario, renderer, options)]}", worst["measured"], worst["limit"],
                      "" if isinstance(worst["unit"], float) else worst["unit"], worst["case"], why])
    return ["what", "renderer", "options", "not met", "worst", "limit", "unit", "worst case", "why"], table


# What each of the thesis' choices does, in words; its figures follow.
MECHANISMS = [
    ("line", "torque without force", "the hand is turned but not pushed back: turning in and moving out does work that nothing takes back; without its force nothing holds the shaft"),
    ("line", "projected tracking", "the touching place follows the line of the tick before, which hardly depends on how the tool turns: the force stays where the contact was"),
    ("line", "most active vertex", "the touching place jumps from vertex to vertex, by their spacing, and the lever with it"),
    ("line", "stored gradient", "the normal is that of a single voxel and changes at once at cells' faces"),
    ("line", "thesis' trigger", "contact is seen at the tick's end alone, so thin bone goes unseen"),
    ("surface", "Eq. 16", "the sum is divided by how many touch: the force falls by steps when one more vertex does"),
    ("surface", "held force", "a centre in bone keeps its last force: it does not grow with depth nor turn, so that in and out differ"),
    ("surface", "torque without force", "as Line's: rotations do work that translations do not take back"),
    ("surface", "thesis' counts", "26 vertices on the ball: each stands for much, so that edges pass between them and one more that touches tells"),
]


def choice_words(rows):
    """The thesis' choices one at a time: why each makes energy, how much, and what it costs in stiffness."""
    said = []
    pick = lambda start, renderer, choice: {r["case"]: r["measured"] for r in rows if str(r["scenario"]).startswith(start) and r["renderer"] == renderer and r["options"] == choice}
    for renderer, choice, why in MECHANISMS:
        net, net_default = (pick("21 closed paths: mean net work", renderer, o) for o in (choice, "default"))
        stiff, stiff_default = (pick("choices: greatest stable stiffness", renderer, o) for o in (choice, "default"))
        beyond, beyond_default = (pick("choices: energy beyond", renderer, o) for o in (choice, "default"))
        if not net or not stiff:
            continue
        shares = {place: stiff[place] / stiff_default[place] for place in stiff if stiff_default.get(place, 0) > 0}
        low, high = min(shares, key=shares.get), max(shares, key=shares.get)
        most = max(beyond, key=beyond.get) if beyond else None
        text = (f"{renderer}, {choice}: {why}. Net work of closed paths {max(net.values()):.2g} % on the mean (default {max(net_default.values()):.2g} %); "
                f"greatest stable stiffness " + ("the default's everywhere" if 0.93 < shares[low] and shares[high] < 1.07 else
                                                f"{shares[low]:.2g} of the default's at worst ({low.split(';')[0]}), {shares[high]:.2g} at best ({high.split(';')[0]})"))
        if most is not None:
            text += f"; pressed with 3 N at 800 N/m it gives the hand " + (f"up to {beyond[most]:.2g} mJ beyond Rule E ({most.split(';')[0]}; default {max(0, beyond_default.get(most, 0)):.2g} mJ)" if beyond[most] > 1e-3 else "nothing beyond Rule E")
        said.append(text + ".")
    return said


def stability_words(rows):
    """What the closed loops say, failures first."""
    if not rows:
        return []
    said = []
    judged = [r for r in rows if r["pass"] in ("pass", "fail")]
    failed = [r for r in judged if r["pass"] == "fail"]
    ours = [r for r in failed if not r["options"].startswith(THESIS_OPTIONS)]
    said.append(f"{len(failed)} of {len(judged)} limits are not met, {len(ours)} of them by our options; the tables name each.")

    def worst_of(scenario, renderer, options):
        return tables.worst(of(rows, scenario, renderer=renderer, options=options), "measured")

    for renderer in ("line", "surface"):
        net, thesis = worst_of("21 closed paths: worst net work", renderer, "default"), worst_of("21 closed paths: worst net work", renderer, "thesis")
        mean, mean_thesis = worst_of("21 closed paths: mean net work", renderer, "default"), worst_of("21 closed paths: mean net work", renderer, "thesis")
        if not math.isnan(net):
            said.append(f"NOT an energy: {renderer}'s forces do {net:.2g} % of net work on the worst closed path, {mean:.2g} % on the mean one (thesis: {thesis:.2g} %, {mean_thesis:.2g} %); "
                        "the goal is 0.01 %. Springs toward a centre and a point that snaps between places are no gradient.")
    for row in of(rows, "21 closed paths: worst net work", renderer="coupled"):
        mean = tables.worst(of(rows, "21 closed paths: mean net work", renderer="coupled", options=row["options"]), "measured")
        said.append(f"coupled, {row['options']}: {row['measured']:.2g} % of net work on the worst closed path, {mean:.2g} % on the mean one; the goal of {row['limit']:g} % is "
                    + ("met." if row["pass"] == "pass" else "not met."))
    for row in of(rows, "21 closed paths: most net work gained"):
        if row["options"].startswith("default"):
            said.append(f"{row['renderer']}, {row['options']}: a closed path with friction gives the hand at most {row['measured']:.2g} % of its work, {row['reference']:.2g} % on the mean; "
                        f"the limit of {row['limit']:g} % is {'met' if row['pass'] == 'pass' else 'not met'}.")
    through = of(rows, "17 falls through a thin wall (1: yes)")
    for renderer, options in (("surface", "default"), ("surface", "thesis"), ("line", "thesis"), ("line", "default"),
                              ("coupled", "default"), ("coupled", "default + friction 0.3")):
        mine = [r for r in through if (r["renderer"], r["options"]) == (renderer, options)]
        fell = [r for r in mine if r["measured"] > 0]
        if mine and fell:
            hardest = max(fell, key=lambda r: r["case"])
            said.append(f"{renderer}, {options}: falls through {len(fell)} of {len(mine)} thin walls, up to {hardest['case']} (held {hardest['reference']:.2g} N before).")
        elif mine:
            said.append(f"{renderer}, {options}: falls through no wall of 1 to 4 voxels at .01 to 1 m/s.")
    for renderer in ("line", "surface", "coupled"):
        step = worst_of("15 force step beyond 1.5 K |Δx|; slid at 30 mm/s", renderer, "default")
        if step > 0.02:
            why = {"surface": "; vertices that turn from one face to another find another way out at once",
                   "line": "; a proxy that slides off the end of a face lets go of its whole spring at once"}.get(renderer, "")
            said.append(f"{renderer} slid over edges and into corners: the force steps by {step:.2g} N more than 1.5 K |Δx| in a tick{why}. A rate limit makes it a slope.")
    for renderer in ("line", "surface"):
        without, thesis, budget = (worst_of("14 stiffness felt", renderer, o) for o in ("default", "thesis", "default + budget"))
        turn, turn_budget = worst_of("14 rotational stiffness felt", renderer, "default"), worst_of("14 rotational stiffness felt", renderer, "default + budget")
        if not math.isnan(budget):
            said.append(f"Stiffness felt at the tip, {renderer}, from one contact to the whole shaft: up to {without:.0f} N/m and {turn:.2g} N·m/rad; with a budget of 800 N/m and 0.3 N·m/rad "
                        f"{budget:.0f} N/m and {turn_budget:.2g} N·m/rad.")
    felt, turn = worst_of("14 stiffness felt", "coupled", "default"), worst_of("14 rotational stiffness felt", "coupled", "default")
    if not math.isnan(felt):
        said.append(f"Stiffness felt, coupled, from one contact to the whole shaft: up to {felt:.0f} N/m and {turn:.2g} N·m/rad at 800 N/m stated.")
    said += places_words(rows)
    off = of(rows, "13 K_crit off the analytic wall's")
    mine = [r for r in off if r["renderer"] == "coupled" and r["options"] == "default"]
    if mine:
        said.append(f"coupled on a flat wall: the greatest stable stiffness is within {tables.worst(mine, 'measured'):.2g} % of an analytic wall's of the same law in {len(mine)} cases (goal 2 %).")
    for renderer in ("line", "surface"):
        ours, thesis = ([r for r in off if r["renderer"] == renderer and r["options"] == o] for o in ("default", "thesis"))
        if ours and thesis:
            said.append(f"{renderer} on a flat wall: the greatest stable stiffness is within {tables.worst(ours, 'measured'):.2g} % of an analytic wall's of the same law in {len(ours)} cases (goal 2 %); "
                        f"thesis: within {tables.worst(thesis, 'measured'):.2g} %" + (", where Eq. 16 jumps near 1 N." if tables.worst(thesis, "measured") > 5 else "."))
    energy = [r for r in judged if "energy beyond Rule E" in r["scenario"]]
    for options in ("thesis", "default"):
        mine = [r for r in energy if r["options"] == options]
        if mine:
            bad = [r for r in mine if r["pass"] == "fail"]
            most = max(mine, key=lambda r: r["measured"])
            said.append(f"Energy in the hand beyond what a hold may leak, {options}: {len(bad)} of {len(mine)} runs, at most {most['measured']:.2g} mJ ({most['renderer']}, {most['case']}).")
    for renderer in ("line", "surface", "coupled"):
        steps = of(rows, "20 greatest force step a tick", renderer=renderer, options="default")
        if not steps:
            continue
        bad = [r for r in steps if r["pass"] == "fail"]
        most = max(steps, key=lambda r: r["measured"])
        why = ": bone that falls below the isovalue lets long springs go at once" if renderer in ("line", "surface") and bad else ""
        said.append(f"Milling and sliding under 1 to 10 N, {renderer}: the force steps by more than {steps[0]['limit']:g} N a tick in {len(bad)} of {len(steps)} runs, at most by {most['measured']:.2g} N "
                    f"({most['case']}){why}.")
    for way in ("advancing cut", "rate limit 190 N/s"):
        parts = []
        for renderer in ("line", "surface", "coupled"):
            steps = of(rows, "20 greatest force step a tick", renderer=renderer, options="default + " + way)
            if steps:
                light = [r["measured"] for r in steps if "; 10 N;" not in r["case"]]
                parts.append(f"{renderer} {max(light):.2g} N under 1 and 3 N ({max(r['measured'] for r in steps):.2g} N under 10 N)")
        if parts:
            said.append(f"Milling with {'an' if way[0] == 'a' else 'a'} {way}, greatest step a tick: " + "; ".join(parts) + ". Under 10 N the drill goes through skull and block.")
    said += choice_words(rows)
    header, stages = stability_stages(rows)
    by_name = {line[0]: line for line in stages}
    if "none" in by_name:
        parts = []
        for name in ("Hunt-Crossley 5 s/m", "damping 5 N·s/m", "passivity controller; 20 N·s/m", "filter 200 Hz"):
            if name in by_name:
                parts.append(f"{name} {by_name[name][1]:.0f} N/m at {by_name[name][8]:.2g} % of force error")
        said.append(f"Greatest stable stiffness of a free device with 0.5 N·s/m: {by_name['none'][1]:.0f} N/m alone; " + "; ".join(parts) + ".")
    return said
