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


def recommended(sweep, scenarios, renderer, variant, most_ns):
    """The setting of a variant with the least worst force error over the scenarios among those within a time."""
    best = None
    rows = sweep.where(renderer=renderer, variant=variant, error_kind="discretisation", field=tables.DEFAULT_FIELD, voxel_mm=0.3, scalar="float", steps="1/2vx")
    settings = {(r["vertices"], r["slices"], r["per_slice"]) for r in rows}
    for setting in settings:
        mine = [r for r in rows if (r["vertices"], r["slices"], r["per_slice"]) == setting and r["scenario"] in scenarios]
        if {r["scenario"] for r in mine} != set(scenarios) or tables.worst(mine, "tick_ns_median") > most_ns:
            continue
        error = tables.worst(mine, "force_error_rel_p95")
        if best is None or error < best[0]:
            best = (error, setting, mine)
    return best


def goals(sweep, t):
    found = []
    tips = [s for s in tables.SMOOTH_TIPS if sweep.where(scenario=s)]

    coupled = [sweep.at_defaults(s, tables.COUPLED) for s in tips]
    if any(coupled):
        direction = tables.worst(coupled, "direction_error_deg_p99")
        found.append(Goal("Coupled, the thesis' counts, tip on smooth shapes: direction p99, force p95, median and p99.9 tick", "1°, –, 4 µs, 15 µs",
                          f"{degrees(direction)}, {percent(tables.worst(coupled, 'force_error_rel_p95'))}, {microseconds(tables.worst(coupled, 'tick_ns_median'))}, {microseconds(tables.worst(coupled, 'tick_ns_p999'))}",
                          direction <= 1))
        finest = [sweep.at_defaults(s, tables.COUPLED, vertices=200.0) for s in tips]
        finest = [r for r in finest if r is not None]
        if finest:
            direction = tables.worst(finest, "direction_error_deg_p99")
            found.append(Goal("Coupled with 200 vertices on the ball: direction p99, force p95, median tick", "1°",
                              f"{degrees(direction)}, {percent(tables.worst(finest, 'force_error_rel_p95'))}, {microseconds(tables.worst(finest, 'tick_ns_median'))}", direction <= 1))

    # At the thesis' counts and no more time: the thesis' own formulas against ours.
    for law, variant in (("default law", tables.SURFACE_DEFAULT), ("patches", tables.SURFACE_PATCH)):
        ratios, times = [], []
        for scenario in tips:
            thesis = sweep.at_defaults(scenario, tables.SURFACE_THESIS)
            ours = sweep.at_defaults(scenario, variant)
            if thesis and ours:
                ratios.append(thesis["force_error_rel_p95"] / ours["force_error_rel_p95"])
                times.append(ours["tick_ns_median"] / thesis["tick_ns_median"])
        if ratios:
            found.append(Goal(f"Surface, {law}, tip on smooth shapes, the thesis' 207 vertices: times less force error (p95) than the thesis' formulas; time",
                              "at least 4; at most 1", f"{min(ratios):.2g} to {max(ratios):.2g}; {min(times):.2g} to {max(times):.2g}",
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

    for law, variant in (("default law", tables.SURFACE_DEFAULT), ("patches", tables.SURFACE_PATCH)):
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
        for renderer, variant, most in (("line", tables.LINE_DEFAULT, 50e3), ("surface", tables.SURFACE_DEFAULT, 20e3), ("surface", tables.SURFACE_PATCH, 20e3)):
            rows_all = sweep.where(renderer=renderer, variant=variant, error_kind="discretisation", field=tables.DEFAULT_FIELD, voxel_mm=voxel, scalar="float", steps="1/2vx")
            best = None
            for setting in {(r["vertices"], r["slices"], r["per_slice"]) for r in rows_all}:
                mine = [r for r in rows_all if (r["vertices"], r["slices"], r["per_slice"]) == setting and r["scenario"] in shafts]
                if {r["scenario"] for r in mine} != set(shafts) or tables.worst(mine, "tick_ns_median") > most:
                    continue
                error = tables.worst(mine, "torque_error_rel_p95")
                if best is None or error < best[0]:
                    best = (error, setting, mine)
            if best:
                counts = f"{best[1][0]:.0f} vertices" if renderer == "line" else f"{best[1][0]:.0f} + {best[1][1]:.0f} x {best[1][2]:.0f}"
                name = renderer.capitalize() + (", patches" if variant == tables.SURFACE_PATCH else "")
                found.append(Goal(f"{name}, shaft ({radius} voxels radius) on smooth shapes, {counts}: torque p95, direction p99", "2 %, 2°",
                                  f"{percent(best[0])}, {degrees(tables.worst(best[2], 'direction_error_deg_p99'))} in {microseconds(tables.worst(best[2], 'tick_ns_median'))}",
                                  best[0] <= 0.02 and tables.worst(best[2], "direction_error_deg_p99") <= 2))
    line_model = tables.worst([r for r in (sweep.at_defaults(s, tables.LINE_DEFAULT, "model") for s in tips) if r], "direction_error_deg_p99")
    for what, value in ((f"Line, 50 vertices", line_model),
                        ("Surface, the thesis' 207", tables.worst([r for r in (sweep.at_defaults(s, tables.SURFACE_DEFAULT, "model") for s in tips) if r], "direction_error_deg_p99")),
                        ("Surface, 200 + 20 x 8", tables.worst([r for r in (sweep.at_defaults(s, tables.SURFACE_DEFAULT, "model", vertices=200.0) for s in tips) if r], "direction_error_deg_p99"))):
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
    if t["energy_laws"]:
        chosen = [r for r in t["energy_laws"] if r["law"] == "depth" and r["field"] == "depths"]
        off = max(max(r["force_off_derivative_max"], r["torque_off_derivative_max"]) for r in t["energy_laws"])
        left = max(r["left_out_share"] for r in t["energy_laws"])
        found.append(Goal("Energy laws: force and torque against numeric derivatives, every shape and the skull", "1e-4, under 5 % left out",
                          f"{off:.2g}, {percent(left)} left out", off <= 1e-4 and left < 0.05))
        worst = max(r["net_work_rel_worst"] for r in chosen if not math.isnan(r["net_work_rel_worst"]))
        found.append(Goal("Energy law of depths: net work on closed paths", "1e-4 of the path's", f"{worst:.2g} at most", worst <= 1e-4))
    if t["orders"]:
        bad = [r for r in t["orders"] if r["holds"] == 0]
        found.append(Goal("Orders of convergence at least .9 of the expected", "all", f"{len(t['orders']) - len(bad)} of {len(t['orders'])}", not bad))
    return found


def pair(sweep, scenarios, first, second, key, kind="discretisation", form=percent, **more):
    a = tables.worst([r for r in (sweep.at_defaults(s, first, kind, **more) for s in scenarios) if r], key)
    b = tables.worst([r for r in (sweep.at_defaults(s, second, kind, **more) for s in scenarios) if r], key)
    return f"{form(a)} against {form(b)}"


def settled(sweep, t):
    """Rows: question, thesis, ours, figures (ours first)."""
    tips = [s for s in tables.SMOOTH_TIPS if sweep.where(scenario=s)]
    shafts = [s for s in tables.SMOOTH_SHAFTS if sweep.where(scenario=s)]
    line = tables.LINE_DEFAULT
    rows = [
        ["sum of the vertex springs", "Eq. 16, CollisionRatio", "AreaWeights",
         "force p95, smooth tips, 26 vertices: " + pair(sweep, tips, tables.SURFACE_DEFAULT, tables.SURFACE_THESIS, "force_error_rel_p95")
         + "; direction p99 " + pair(sweep, tips, tables.SURFACE_DEFAULT, tables.SURFACE_THESIS, "direction_error_deg_p99", form=degrees)
         + ". PatchWeights at 200 vertices: " + pair(sweep, tips, tables.SURFACE_PATCH, tables.SURFACE_DEFAULT, "force_error_rel_p95", vertices=200.0)
         + " of AreaWeights, for " + pair(sweep, tips, tables.SURFACE_PATCH, tables.SURFACE_DEFAULT, "tick_ns_median", form=microseconds, vertices=200.0)],
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
              for name in ("line", "line (cell normals)", "surface area 26", "surface patch 200")}
    said.append(f"Whether Surface's sum is smoother than Line's single point depends on the normals: slid at 1 N Line ripples by {ripple['line (cell normals)']:.2g} N rms with those of "
                f"single cells and by {ripple['line']:.2g} N with smoothed ones, Surface by {ripple['surface area 26']:.2g} N with 26 vertices and by {ripple['surface patch 200']:.2g} N with 200.")
    binary = sweep.where(scenario="plane", field="binary_8bit", renderer="line", error_kind="discretisation", vertices=50.0, steps="1/2vx")
    if binary:
        said.append(f"Binary masks spoil what any counts can reach: Line on a plane errs by {percent(binary[0]['force_error_rel_p95'])} (p95) there. Keep the scanner's grey levels.")
    if t["holes"]:
        falls = sorted({r["width_over_diameter"] for r in t["holes"] if r["renderer"] == "surface area" and r["place"] == "round hole" and r["falls_in"] == 1})
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
    return [r for r in rows if r["scenario"] == scenario and all(r[k] == v for k, v in wanted.items())]


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
    for renderer in ("line", "surface", "coupled", "energy"):
        names = list(dict.fromkeys(r["options"] for r in rows if r["renderer"] == renderer and str(r["scenario"]).startswith("choices:")))
        for name in names:
            pick = lambda s: next((r["measured"] for r in of(rows, s, renderer=renderer, options=name)), math.nan)
            table.append([renderer, name, pick("21 closed paths: worst net work"), pick("21 closed paths: mean net work"), pick("21 closed paths: greatest force step")]
                         + [next((r["measured"] for r in rows if str(r["scenario"]).startswith("choices:") and r["renderer"] == renderer and r["options"] == name and r["case"] == p), math.nan)
                            for p in places])
    return header, table


def places_words(off, farther):
    """What the coupled tool's greatest stable stiffness is by place, by options; those beyond the goal one by one."""
    said = []
    for options in dict.fromkeys(r["options"] for r in off):
        mine = [r for r in off if r["options"] == options]
        bad = [r for r in mine if r["pass"] == "fail"]
        parts = []
        for place in dict.fromkeys(r["case"].split("; b ")[0] for r in bad):
            there = [r for r in bad if r["case"].split("; b ")[0] == place]
            deep = [r["measured"] for r in farther if r["options"] == options and r["case"].startswith(place + "; b ")]
            parts.append(f"{place} {tables.worst(there, 'measured'):.2g} %" + (f" ({max(deep):.2g} mm farther in than the shape lets it)" if deep and max(deep) > 0.1 else ""))
        said.append(f"coupled, {options}: the greatest stable stiffness is theory's within {mine[0]['limit']:g} % in {len(mine) - len(bad)} of {len(mine)} cases over all places"
                    + ("; off by more: " + ", ".join(parts) + ". Sharp edges pass between the vertices before they are held; a shaft that is held beside the tip is softer by its lever, "
                       "and so stable beyond theory" if parts else "") + ".")
    return said


def stability_words(rows):
    """What the closed loops say, failures first."""
    if not rows:
        return []
    said = []
    judged = [r for r in rows if r["pass"] in ("pass", "fail")]
    failed = [r for r in judged if r["pass"] == "fail"]
    ours = [r for r in failed if r["options"] not in ("thesis", "Eq. 16", "held force", "torque without force", "projected tracking", "stored gradient", "thesis' trigger",
                                                      "most active vertex", "renderer alone")]
    said.append(f"{len(failed)} of {len(judged)} limits are not met, {len(ours)} of them by our options; the tables name each.")

    def worst_of(scenario, renderer, options):
        return tables.worst(of(rows, scenario, renderer=renderer, options=options), "measured")

    for renderer in ("line", "surface"):
        net, thesis = worst_of("21 closed paths: worst net work", renderer, "default"), worst_of("21 closed paths: worst net work", renderer, "thesis")
        mean, mean_thesis = worst_of("21 closed paths: mean net work", renderer, "default"), worst_of("21 closed paths: mean net work", renderer, "thesis")
        if not math.isnan(net):
            said.append(f"NOT an energy: {renderer}'s forces do {net:.2g} % of net work on the worst closed path, {mean:.2g} % on the mean one (thesis: {thesis:.2g} %, {mean_thesis:.2g} %); "
                        "the goal is 0.01 %. Springs toward a centre and a point that snaps between places are no gradient.")
    for renderer, why in (("coupled", "its normals are the slope of the smoothed depth, which is not quite that of the depths' own energy"),
                          ("energy", "where the depths' slope jumps, at cells' faces and at the bone's middle, so does the force")):
        for row in of(rows, "21 closed paths: worst net work", renderer=renderer):
            mean = tables.worst(of(rows, "21 closed paths: mean net work", renderer=renderer, options=row["options"]), "measured")
            said.append(f"{renderer}, {row['options']}: {row['measured']:.2g} % of net work on the worst closed path, {mean:.2g} % on the mean one; the goal of {row['limit']:g} % is "
                        + ("met." if row["pass"] == "pass" else f"not met: {why}."))
    for row in of(rows, "21 closed paths: most net work gained"):
        if row["options"].startswith("default"):
            said.append(f"{row['renderer']}, {row['options']}: a closed path with friction gives the hand at most {row['measured']:.2g} % of its work, {row['reference']:.2g} % on the mean; "
                        f"the limit of {row['limit']:g} % is {'met' if row['pass'] == 'pass' else 'not met'}.")
    through = of(rows, "17 falls through a thin wall (1: yes)")
    for renderer, options in (("energy", "default"), ("energy", "default + 200 vertices"), ("surface", "default"), ("surface", "thesis"), ("line", "thesis"), ("line", "default"),
                              ("coupled", "default"), ("coupled", "default + friction 0.3")):
        mine = [r for r in through if (r["renderer"], r["options"]) == (renderer, options)]
        fell = [r for r in mine if r["measured"] > 0]
        if mine and fell:
            hardest = max(fell, key=lambda r: r["case"])
            said.append(f"{renderer}, {options}: falls through {len(fell)} of {len(mine)} thin walls, up to {hardest['case']} (held {hardest['reference']:.2g} N before).")
        elif mine:
            said.append(f"{renderer}, {options}: falls through no wall of 1 to 4 voxels at .01 to 1 m/s.")
    for renderer in ("line", "surface", "coupled", "energy"):
        step = worst_of("15 force step beyond 1.5 K |Δx|; slid at 30 mm/s", renderer, "default")
        if step > 0.02:
            why = ("vertices that turn from one face to another find another way out at once" if renderer in ("surface", "energy")
                   else "a proxy that slides off the end of a face lets go of its whole spring at once")
            said.append(f"{renderer} slid over edges and into corners: the force steps by {step:.2g} N more than 1.5 K |Δx| in a tick; {why}. A rate limit makes it a slope.")
    for renderer in ("line", "surface"):
        without, thesis, budget = (worst_of("14 stiffness felt", renderer, o) for o in ("default", "thesis", "default + budget"))
        turn, turn_budget = worst_of("14 rotational stiffness felt", renderer, "default"), worst_of("14 rotational stiffness felt", renderer, "default + budget")
        if not math.isnan(budget):
            said.append(f"Stiffness felt at the tip, {renderer}, from one contact to the whole shaft: up to {without:.0f} N/m and {turn:.2g} N·m/rad; with a budget of 800 N/m and 0.3 N·m/rad "
                        f"{budget:.0f} N/m and {turn_budget:.2g} N·m/rad.")
    for renderer in ("coupled", "energy"):
        felt, turn = worst_of("14 stiffness felt", renderer, "default"), worst_of("14 rotational stiffness felt", renderer, "default")
        if not math.isnan(felt):
            said.append(f"Stiffness felt, {renderer}, from one contact to the whole shaft: up to {felt:.0f} N/m and {turn:.2g} N·m/rad at 800 N/m stated.")
    said += places_words(of(rows, "13 K_crit by place off theory's"), of(rows, "13 farther in than the shape lets it"))
    off = of(rows, "13 K_crit off the analytic wall's")
    for renderer in ("coupled", "energy"):
        mine = [r for r in off if r["renderer"] == renderer and r["options"] == "default"]
        if mine:
            said.append(f"{renderer} on a flat wall: the greatest stable stiffness is within {tables.worst(mine, 'measured'):.2g} % of an analytic wall's of the same law in {len(mine)} cases (goal 2 %).")
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
    for renderer in ("line", "surface", "coupled", "energy"):
        steps = of(rows, "20 greatest force step a tick", renderer=renderer, options="default")
        if not steps:
            continue
        bad = [r for r in steps if r["pass"] == "fail"]
        most = max(steps, key=lambda r: r["measured"])
        why = ": bone that falls below the isovalue lets long springs go at once" if renderer in ("line", "surface") and bad else ""
        said.append(f"Milling and sliding under 1 to 10 N, {renderer}: the force steps by more than 0.2 N a tick in {len(bad)} of {len(steps)} runs, at most by {most['measured']:.2g} N "
                    f"({most['case']}){why}.")
    generators = [("line", "torque without force"), ("line", "projected tracking"), ("line", "stored gradient"), ("surface", "torque without force"), ("surface", "Eq. 16"), ("surface", "held force")]
    parts = [f"{renderer} {choice} {worst_of('21 closed paths: mean net work', renderer, choice):.2g} % (default {worst_of('21 closed paths: mean net work', renderer, 'default'):.2g} %)"
             for renderer, choice in generators if of(rows, "21 closed paths: mean net work", renderer=renderer, options=choice)]
    if parts:
        said.append("Which of the thesis' choices make energy, one at a time, mean net work of closed paths: " + "; ".join(parts) + ".")
    header, stages = stability_stages(rows)
    by_name = {line[0]: line for line in stages}
    if "none" in by_name:
        parts = []
        for name in ("Hunt-Crossley 5 s/m", "damping 5 N·s/m", "passivity controller; 20 N·s/m", "filter 200 Hz"):
            if name in by_name:
                parts.append(f"{name} {by_name[name][1]:.0f} N/m at {by_name[name][8]:.2g} % of force error")
        said.append(f"Greatest stable stiffness of a free device with 0.5 N·s/m: {by_name['none'][1]:.0f} N/m alone; " + "; ".join(parts) + ".")
    return said
