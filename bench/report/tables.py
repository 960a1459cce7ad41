# SPDX-License-Identifier: MIT
"""Reads the benchmarks' tables and answers questions about them."""

import csv
import math
import os

SURFACE_THESIS = "thesis_surface"
SURFACE_DEFAULT = "surface"
LINE_THESIS = "thesis_line"
LINE_DEFAULT = "translate_rotate"
LINE_RAY_CAST = "ray_cast"
SURFACE_COUNTS = dict(vertices=260.0, slices=70.0, per_slice=8.0)  # SurfaceCounts{}
THESIS_COUNTS = dict(surface=dict(vertices=26.0, slices=20.0, per_slice=8.0), line=dict(vertices=50.0), coupled={})
COUPLED = "coupled"
DEFAULT_FIELD = "ct_blur"
SMOOTH_TIPS = ["plane", "sphere", "socket", "cylinder", "ridge", "plate"]
SMOOTH_SHAFTS = ["shaft_ridge", "shaft_cylinder"]


def read(folder, name):
    """Rows of folder/name.csv as dictionaries, numbers as floats, empty fields NaN; no rows if there is no such table."""
    path = os.path.join(folder, name + ".csv")
    if not os.path.exists(path):
        return []

    def value(text):
        try:
            return float(text or "nan")
        except ValueError:
            return text

    with open(path, newline="", encoding="utf-8") as file:
        return [{key: value(text) for key, text in row.items()} for row in csv.DictReader(file)]


def digits(value, count=2):
    """The value to so many digits, at least those before the point; nothing for what is no number."""
    if value is None or isinstance(value, str) or math.isnan(value):
        return None
    if value == 0:
        return "0"
    after = max(0, count - 1 - math.floor(math.log10(abs(value))))
    return f"{value:.{after}f}"


def places(value, count):
    """The value with so many digits after the point, and no minus before a zero."""
    text = f"{value:.{count}f}"
    return text.lstrip("-") if float(text) == 0 else text.replace("-", "−")


def where(rows, **wanted):
    def fits(row, key, value):
        return row[key] in value if isinstance(value, (list, tuple)) else row[key] == value

    return [row for row in rows if all(fits(row, key, value) for key, value in wanted.items())]


def unique(rows, *keys):
    """The different values of some columns, in order."""
    return list(dict.fromkeys(tuple(row[k] for k in keys) if len(keys) > 1 else row[keys[0]] for row in rows))


def counts(row):
    return row["vertices"], row["slices"], row["per_slice"]


def renderer_of(variant):
    return "surface" if variant in (SURFACE_THESIS, SURFACE_DEFAULT) else "coupled" if variant == COUPLED else "line"


class Sweep:
    """error_vs_time.csv."""

    def __init__(self, rows):
        self.rows = rows

    def where(self, **wanted):
        return where(self.rows, **wanted)

    def at_defaults(self, scenario, variant, kind="discretisation", **more):
        """The row of a variant at the thesis' counts, half-voxel steps, the default image."""
        renderer = renderer_of(variant)
        wanted = dict(scenario=scenario, variant=variant, error_kind=kind, field=DEFAULT_FIELD, voxel_mm=0.3,
                      steps="1/2vx", renderer=renderer)
        rows = self.where(**{**wanted, **THESIS_COUNTS[renderer], **more})
        return rows[0] if rows else None


def finite(rows, key):
    return [row[key] for row in rows if row and not isinstance(row[key], str) and not math.isnan(row[key])]


def worst(rows, key):
    return max(finite(rows, key), default=math.nan)


def first(rows, key):
    return rows[0][key] if rows else math.nan


def front(points):
    """The points (time, error) that no other beats in both."""
    best, chosen = math.inf, []
    for point in sorted(points):
        if point[1] < best:
            best = point[1]
            chosen.append(point)
    return chosen
