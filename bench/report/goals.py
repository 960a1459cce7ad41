# SPDX-License-Identifier: MIT
"""The sweep's goals: what is asked of which settings, the figures found, met or not."""

import math

import tables

# Columns of error_vs_time.csv by a short name: title, column, factor.
COLUMNS = {
    "force": ("force p95 [%]", "force_error_rel_p95", 100),
    "direction": ("direction p99 [°]", "direction_error_deg_p99", 1),
    "torque": ("torque p95 [%]", "torque_error_rel_p95", 100),
    "point": ("contact p95 [voxel]", "point_error_voxel_p95", 1),
    "tick": ("median tick [µs]", "tick_ns_median", 1e-3),
    "late": ("p99.9 tick [µs]", "tick_ns_p999", 1e-3),
}
HEADER = ["what"] + [title for title, _, _ in COLUMNS.values()] + ["met"]
IMAGES = {"ct_blur": "CT blur", "ct_blur_c60": "CT blur, contrast 60", "partial_volume": "partial volume"}
TIPS, SHAFTS = tables.SMOOTH_TIPS, tables.SMOOTH_SHAFTS


def goal(what, rows, **limits):
    """The worst of the rows in every column, "found (limit)" where there is one."""
    rows = [r for r in rows if r]
    if not rows:
        return None
    found = {name: factor * tables.worst(rows, column) for name, (_, column, factor) in COLUMNS.items()}
    cells = ["–" if math.isnan(v) else f"{v:.3g}" + (f" ({limits[n]:g})" if n in limits else "") for n, v in found.items()]
    return [what] + cells + ["yes" if all(not found[n] > limit for n, limit in limits.items()) else "no"]


def recommended(sweep, scenarios, renderer, variant, most_ns, voxel_mm, key):
    """The rows of a variant's setting with the least worst error among those within a time."""
    best = (math.inf, [])
    scenarios = [s for s in scenarios if sweep.where(scenario=s)]  # a quick run has fewer
    rows = sweep.where(renderer=renderer, variant=variant, error_kind="discretisation", field=tables.DEFAULT_FIELD,
                       voxel_mm=voxel_mm, steps="1/2vx", scenario=scenarios)
    for setting in {tables.counts(r) for r in rows}:
        mine = [r for r in rows if tables.counts(r) == setting]
        if len({r["scenario"] for r in mine}) == len(scenarios) and tables.worst(mine, "tick_ns_median") <= most_ns:
            best = min(best, (tables.worst(mine, key), mine), key=lambda b: b[0])
    return best[1]


def goals(sweep):
    def at(scenarios, variant, kind="discretisation", **more):
        return [sweep.at_defaults(s, variant, kind, **more) for s in scenarios]

    def best(name, scenarios, renderer, variant, most_ns, key, voxel_mm=0.3, **limits):
        rows = recommended(sweep, scenarios, renderer, variant, most_ns, voxel_mm, key)
        counts = ("{:.0f} + {:.0f} x {:.0f}" if renderer == "surface" else "{:.0f}").format(*tables.counts(rows[0])) if rows else ""
        return goal(f"{name}: {counts} vertices, best within {most_ns / 1e3:g} µs", rows, **limits)

    found = [goal("Coupled, tip", at(TIPS, tables.COUPLED), direction=1.2, tick=4, late=15),
             goal("Line, tip, 50 vertices", at(TIPS, tables.LINE_DEFAULT), force=1, direction=2, point=0.05)]
    for field, name in IMAGES.items():
        more = dict(field=field, **tables.SURFACE_COUNTS)
        found.append(goal(f"Surface, defaults, tip, {name}", at(TIPS, tables.SURFACE_DEFAULT, **more),
                          force=1, direction=2, point=0.05, tick=20))
        found.append(goal(f"Surface, defaults, shaft, {name}", at(SHAFTS, tables.SURFACE_DEFAULT, **more),
                          torque=2, direction=2, tick=20))
        found.append(goal(f"Surface, defaults, against rigid contact, {name}",
                          at(TIPS + SHAFTS, tables.SURFACE_DEFAULT, "model", **more), direction=5))
    found.append(best("Surface, tip", TIPS, "surface", tables.SURFACE_DEFAULT, 20e3, "force_error_rel_p95",
                      force=1, direction=2, point=0.05))
    for voxel_mm, diameter in ((0.3, "5.3"), (0.15, "10.7")):
        laws = [("Line", "line", tables.LINE_DEFAULT, 50e3), ("Surface", "surface", tables.SURFACE_DEFAULT, 20e3)]
        for name, renderer, variant, most_ns in laws:
            found.append(best(f"{name}, shaft of {diameter} voxels diameter", SHAFTS, renderer, variant, most_ns,
                              "torque_error_rel_p95", voxel_mm, torque=2, direction=2))
    return [g for g in found if g]


GAIN_HEADER = ["at the thesis' counts, tip", "times less force error (4)", "times the time (1)", "met"]


def gains(sweep):
    """Ours against the thesis' formulas at the same counts: least and greatest over the smooth tips."""
    found = []
    for name, variant, thesis in (("Surface", tables.SURFACE_DEFAULT, tables.SURFACE_THESIS),
                                  ("Line", tables.LINE_DEFAULT, tables.LINE_THESIS)):
        both = [(sweep.at_defaults(s, variant), sweep.at_defaults(s, thesis)) for s in TIPS]
        both = [(ours, theirs) for ours, theirs in both if ours and theirs]
        if not both:
            continue
        less = [theirs["force_error_rel_p95"] / ours["force_error_rel_p95"] for ours, theirs in both]
        time = [ours["tick_ns_median"] / theirs["tick_ns_median"] for ours, theirs in both]
        found.append([name] + [f"{min(x):.2g} to {max(x):.2g}" for x in (less, time)]
                     + ["yes" if min(less) >= 4 and max(time) <= 1.05 else "no"])
    return found


def choices(sweep):
    """The worst figures of ours beside those of the thesis' algorithms, and of Line's two searches."""
    surface, line = (tables.SURFACE_DEFAULT, tables.SURFACE_THESIS), (tables.LINE_DEFAULT, tables.LINE_THESIS)
    asked = [("Surface: ours, thesis", TIPS, *surface, key) for key in ("force", "direction", "tick")]
    asked += [("Surface: ours, thesis", SHAFTS, *surface, key) for key in ("torque", "tick")]
    asked += [("Line: ours, thesis", TIPS, *line, key) for key in ("force", "direction", "tick")]
    asked += [("Line: ours, thesis", SHAFTS, *line, key) for key in ("torque", "tick")]
    asked += [("Line: translate and rotate, ray casting", SHAFTS, tables.LINE_DEFAULT, tables.LINE_RAY_CAST, key)
              for key in ("torque", "tick")]
    rows = []
    for what, scenarios, ours, theirs, key in asked:
        title, column, factor = COLUMNS[key]
        rows.append([what, "tip" if scenarios is TIPS else "shaft", title]
                    + [factor * tables.worst([sweep.at_defaults(s, v) for s in scenarios], column) for v in (ours, theirs)])
    return rows
