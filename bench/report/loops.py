# SPDX-License-Identifier: MIT
"""Tables of the closed loops and of the coupled tool's figures: each function answers header, rows and title."""

import math

from tables import finite, first, unique, where, worst

STAGES = ["greatest stable K", "amplitude left at 5000 N/m", "force error", "ripple held with a quantum of .055 mm"]
USUAL = dict(damping=0.5, delay=0, hand="light", friction=0, quantum_mm=0)


def limits(rows):
    """Limits by scenario, renderer and options: how many are met, the worst; failures first."""
    judged = where(rows, **{"pass": ["pass", "fail"]})
    lines = []
    for scenario, renderer, options in unique(judged, "scenario", "renderer", "options"):
        mine = where(judged, scenario=scenario, renderer=renderer, options=options)
        hardest = max(mine, key=lambda r: r["measured"])
        met = len(where(mine, **{"pass": "pass"}))
        lines.append([scenario, renderer, options, f"{met} of {len(mine)}", hardest["measured"], hardest["limit"],
                      hardest["unit"], hardest["case"], "pass" if met == len(mine) else "fail"])
    lines.sort(key=lambda line: (line[-1] == "pass", *map(str, line[:3])))
    return ["what", "renderer", "options", "met", "worst", "limit", "unit", "worst case", ""], lines, "Limits, failures first"


def stages(rows):
    mine = [r for r in rows if str(r["scenario"]).startswith("stages: ")]
    columns = [c for name in STAGES for c in unique(where(mine, scenario="stages: " + name), "scenario", "case")]
    lines = [[stack] + [first(where(mine, options=stack, scenario=s, case=c), "measured") for s, c in columns]
             for stack in unique(mine, "options")]
    header = ["stages"] + [s.split(": ")[1] + (f": {c}" if s.endswith("stable K") else "") for s, c in columns]
    return header, lines, "Stages: Line on a flat wall [N/m, mm, %, N]"


def choices(rows):
    scenario = "choices: greatest stable stiffness (as the option means it)"
    mine = where(rows, scenario=scenario)
    paths = ["worst net work", "mean net work", "greatest force step"]
    places = unique(mine, "case")
    lines = []
    for renderer, options in unique(mine, "renderer", "options"):
        who = dict(renderer=renderer, options=options)
        lines.append([renderer, options] + [first(where(rows, scenario="21 closed paths: " + p, **who), "measured") for p in paths]
                     + [first(where(mine, case=p, **who), "measured") for p in places])
    return (["renderer", "choice"] + [f"closed paths: {p}" for p in paths] + [f"K: {p}" for p in places], lines,
            "The thesis' choices one at a time [%, N, N/m]")


def presets(rows):
    mine = [r for r in rows if str(r["scenario"]).startswith("presets:")]
    keys = ["scenario", "case", "renderer", "options", "measured", "unit", "limit", "pass"]
    return keys, [[r[k] if r[k] == r[k] else "" for k in keys] for r in mine], "Presets at the stated stiffness"


def stiffness_sweep(rows):
    """A line a renderer, a column a place."""
    places = unique(rows, "place")
    lines = []
    for renderer, options in unique(rows, "renderer", "options"):
        line = [renderer, options]
        for place in places:
            mine = where(rows, renderer=renderer, options=options, place=place)
            shares = [r["stable_N_per_m"] / r["theory_N_per_m"] for r in mine]
            line.append(f"{first(where(mine, **USUAL), 'stable_N_per_m'):.0f} ({min(shares):.2g} to {max(shares):.2g}); "
                        f"{max(0, worst(mine, 'beyond_mJ')):.1g} mJ; {worst(mine, 'force_step_N'):.2g} N")
        lines.append(line)
    return (["renderer", "options"] + places, lines,
            "Stiffness from 10² to 10⁶ N/m: stable in the usual case [N/m] (share of theory's in all cases); energy beyond Rule E; force step")


def all_tables(rows, sweep):
    return [limits(rows), stiffness_sweep(sweep), stages(rows), choices(rows), presets(rows)]


def figures(rows):
    """A line a figure: the values judged by blur."""
    blurs = unique(rows, "blur_voxels")
    lines = []
    for name in unique(rows, "figure"):
        mine = where(rows, figure=name)
        cells = [where(mine, blur_voxels=blur) for blur in blurs]
        medians = sorted(finite(mine, "median"))
        lines.append([name, sum(r["cases"] for r in mine), mine[0]["bound"], mine[0]["unit"], medians[len(medians) // 2]]
                     + [f"{c[0]['judged']:.2g}" if c else "" for c in cells] + ["fail" if where(mine, **{"pass": "fail"}) else ""])
    return (["figure", "cases", "bound", "unit", "median"] + [f"σ {blur:g}" for blur in blurs] + [""], lines,
            "Greatest of all cases (directions: p99), by blur in voxels")


def constants(rows):
    """A line a constant and factor: limits lost and won, the greatest change."""
    lines = []
    for constant, header, factor in unique(rows, "constant", "header", "factor"):
        mine = where(rows, constant=constant, header=header, factor=factor)
        lost, won = (where(mine, pass_before=a, pass_after=b) for a, b in (("pass", "fail"), ("fail", "pass")))
        judged = [r for r in mine if not math.isnan(r["bound"])]
        most = max(judged, key=lambda r: abs(r["after"] - r["before"]) / r["bound"], default=None)
        names = "; ".join(unique(lost, "figure")) if judged else mine[0]["figure"]
        lines.append([constant, header, factor, names, float(len(won)), (most["after"] - most["before"]) / most["bound"] if most else math.nan,
                      most["figure"] if most else ""])
    return (["constant", "header", "times", "limits no longer met", "met anew", "greatest change / bound", "of"], lines,
            "Each constant a fifth less and more")
