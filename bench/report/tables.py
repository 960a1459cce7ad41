# SPDX-License-Identifier: MIT
"""Reads the benchmark's tables and answers questions about them."""

import csv
import math
import os

SURFACE_THESIS = "ratio-hold-torque-analytic"
SURFACE_AREA = "area-extend-full-analytic"
SURFACE_DEFAULT = "patch-extend-full-analytic"
LINE_THESIS = "translate_rotate-projected-torque-stored-thesis_trigger"
LINE_DEFAULT = "translate_rotate-constrained-full-spline-refined"
SURFACE_COUNTS = dict(vertices=260.0, slices=70.0, per_slice=8.0)  # SurfaceCounts{}
DENSEST = dict(vertices=1000.0, slices=200.0, per_slice=16.0)
COUPLED = "coupled"
DEFAULT_FIELD = "ct_blur_8bit"
SMOOTH_TIPS = ["plane", "sphere", "socket", "cylinder", "ridge", "plate"]
SMOOTH_SHAFTS = ["shaft_ridge", "shaft_cylinder"]


def number(text):
    try:
        return float(text)
    except (TypeError, ValueError):
        return math.nan


def read(folder, name):
    """Rows of folder/name.csv as dictionaries, numbers as floats; empty if there is no such table."""
    path = os.path.join(folder, name + ".csv")
    if not os.path.exists(path):
        return []
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        for key, value in row.items():
            value_number = number(value)
            if not math.isnan(value_number):
                row[key] = value_number
            elif value in ("", "nan", "-nan"):
                row[key] = math.nan
    return rows


class Sweep:
    """error_vs_time.csv."""

    def __init__(self, rows):
        self.rows = rows

    def where(self, **wanted):
        def fits(row):
            for key, value in wanted.items():
                if isinstance(value, (list, tuple, set)):
                    if row[key] not in value:
                        return False
                elif row[key] != value:
                    return False
            return True

        return [row for row in self.rows if fits(row)]

    def at_defaults(self, scenario, variant, kind="discretisation", **more):
        """The row of a variant at the thesis' counts, half-voxel steps, single precision, the default image. Coupled has no counts, and double precision."""
        law = variant.split("-")[0]
        renderer = "surface" if law in ("ratio", "area", "mean", "patch") else "coupled" if law == "coupled" else "line"
        wanted = dict(scenario=scenario, variant=variant, error_kind=kind, field=DEFAULT_FIELD, voxel_mm=0.3,
                      scalar="float", steps="1/2vx", renderer=renderer)
        wanted.update({"surface": dict(vertices=26.0, slices=20.0, per_slice=8.0), "line": dict(vertices=50.0), "coupled": dict(scalar="double")}[renderer])
        wanted.update(more)
        rows = self.where(**wanted)
        return rows[0] if rows else None


def worst(rows, key):
    values = [row[key] for row in rows if row is not None and not isinstance(row[key], str) and not math.isnan(row[key])]
    return max(values) if values else math.nan


def front(points):
    """Indices of the points (time, error) that no other beats in both."""
    order = sorted(range(len(points)), key=lambda i: points[i])
    best, chosen = math.inf, []
    for i in order:
        if points[i][1] < best:
            best = points[i][1]
            chosen.append(i)
    return chosen
