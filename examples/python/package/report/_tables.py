# SPDX-License-Identifier: MIT
"""Scores as tables of HTML. Definitions and units are those of the docstrings of `trephine.Scores`."""

from __future__ import annotations

import html
import math
import re
from typing import Any, NamedTuple

import numpy as np

import trephine

_LISTED_STROKES = 500
_UNITS = {"m": (1e3, "mm"), "m/s": (1e3, "mm/s"), "1/m": (1e-3, "1/mm")}  # as the page shows them


class _Score(NamedTuple):
    name: str
    key: str
    unit: str
    definition: str

    def text(self, value: Any) -> str:
        """The value without its unit; a text is one already."""
        if isinstance(value, str):
            return value
        if not math.isfinite(value):
            return "–"
        factor, unit = _UNITS.get(self.unit, (1, self.unit))
        shown = float(value) * factor
        return f"{shown:.{0 if not unit and shown == round(shown) else 2}f}".replace("-", "−")

    @property
    def shown_unit(self) -> str:
        return _UNITS.get(self.unit, (1, self.unit))[1]


def _scores(name: str) -> list[_Score]:
    """Those of a property of Scores, in its order. What follows a semicolon is about its array."""
    found = re.findall(r"^\s*(\w+)(?: \[([^]]+)\])?: ([^;\n]+)", getattr(trephine.Scores, name).__doc__ or "", re.M)
    return [_Score(key.replace("_mm3", "_volume").replace("_", " ").capitalize(), key, *rest) for key, *rest in found]


def figures(scores: trephine.Scores) -> str:
    """The few numbers that stand above all, as items of a list."""
    totals, around = scores.totals, scores.around_structures
    breaches, nearest = int(around["breaches"][0]), around["distance"][0]
    shown = [
        (f"{totals['time']:.1f} s", "duration", False),
        (f"{totals['strokes']:.0f}", "strokes", False),
        (f"{totals['removed_mm3']:.1f} mm³", "bone removed", False),
        (f"{totals['mean_force']:.2f} N", "mean force in strokes", False),
        (f"{totals['peak_force']:.2f} N", "greatest force", totals["over_limit"] > 0),
    ]
    if np.isfinite(nearest):
        shown.append((f"{1e3 * nearest:.1f} mm", "least distance from a structure", breaches > 0))
        shown.append((f"{breaches}", "breaches of structures", breaches > 0))
    items = []
    for value, what, bad in shown:
        items.append(f"<li{' class=bad' if bad else ''}><strong>{value.replace('-', '−')}</strong> {what}</li>")
    return "".join(items)


def tables(scores: trephine.Scores, names: list[str]) -> str:
    """Sections of the page: totals, structures, tools and strokes."""
    made = _section("Scores", _totals(scores.totals))
    structures, tools = scores.structures, scores.tools
    near = [s for s, distance in enumerate(structures["distance"]) if s < len(names) or np.isfinite(distance)]
    if near:
        titles = [names[s] if s < len(names) else f"structure {s}" for s in near]
        made += _section("Structures", _structures(*_with_rest(structures, near, titles, scores.around_structures), scores))
    used = [number for number, time in enumerate(tools["time"]) if time > 0]
    rest = scores.unlisted_tools
    columns, titles = _with_rest(tools, used, [f"tool {number}" for number in used], rest if rest["time"][0] else None)
    made += _section("Tools", _rows("Tool", titles, _scores("tools"), columns) + _definitions(_scores("tools")))
    return made + _section("Strokes", _strokes(scores, names))


def _section(title: str, body: str) -> str:
    return f"<section><h2>{html.escape(title)}</h2>{body}</section>\n"


def _totals(totals: dict[str, float]) -> str:
    shown = _scores("totals")
    half = -(-len(shown) // 2)
    return f"<div class=totals>{_listed(shown[:half], totals)}{_listed(shown[half:], totals)}</div>"


def _listed(shown: list[_Score], values: dict[str, float]) -> str:
    rows = [
        f"<tr><th scope=row>{html.escape(s.name)}<small>{html.escape(s.definition)}</small></th>"
        f"<td>{s.text(values[s.key])} {html.escape(s.shown_unit)}</td></tr>"
        for s in shown
    ]
    return f"<table><tbody>{''.join(rows)}</tbody></table>"


def _with_rest(
    columns: dict[str, Any], rows: list[int], titles: list[str], rest: dict[str, Any] | None
) -> tuple[dict[str, Any], list[str]]:
    """These rows, and that of all or of the others where there is more than one."""
    if rest is None or len(rows) == 1:
        return {key: column[rows] for key, column in columns.items()}, titles
    return {key: np.concatenate([column[rows], rest[key]]) for key, column in columns.items()}, titles + ["in all"]


def _rows(first: str, titles: list[str], shown: list[_Score], columns: dict[str, Any]) -> str:
    """A table with a row for each title."""
    head = [f"<th scope=col>{html.escape(s.name)}<span class=unit>{html.escape(s.shown_unit)}</span></th>" for s in shown]
    body = []
    for row, title in enumerate(titles):
        cells = [f"<td>{html.escape(s.text(columns[s.key][row]))}</td>" for s in shown]
        body.append(f"<tr><th scope=row>{html.escape(title)}</th>{''.join(cells)}</tr>")
    table = f"<thead><tr><th scope=col>{first}</th>{''.join(head)}</tr></thead><tbody>{''.join(body)}</tbody>"
    return f"<div class=scroll tabindex=0 role=region aria-label='{first}'><table>{table}</table></div>"


def _definitions(shown: list[_Score]) -> str:
    each = [f"<div><dt>{html.escape(s.name)}</dt>: <dd>{html.escape(s.definition)}</dd></div>" for s in shown]
    return f"<dl>{''.join(each)}</dl>"


def _structures(columns: dict[str, Any], titles: list[str], scores: trephine.Scores) -> str:
    shown = _scores("structures")
    plain = [s for s in shown if columns[s.key].ndim == 1]
    body = _rows("Structure", titles, plain, columns) + _definitions(plain)
    edges = [0.0, *(1e3 * scores.shell_edges)]
    shells = ["inside"] + [f"{low:g}–{high:g}\u00a0mm" for low, high in zip(edges, edges[1:])]
    for s in shown:
        if columns[s.key].ndim == 2:
            near = shells[-columns[s.key].shape[1] :]
            body += f"<h3>{html.escape(s.name)}: {html.escape(s.definition)}</h3>"
            body += _rows("Structure", titles, [_Score(n, n, s.unit, "") for n in near], dict(zip(near, columns[s.key].T)))
    return body


def _strokes(scores: trephine.Scores, names: list[str]) -> str:
    shown = _scores("strokes")
    columns = {key: column[:_LISTED_STROKES].tolist() for key, column in scores.strokes.items()}
    columns["end"] = [trephine.StrokeEnd(end).name.lower().replace("_", " ") for end in columns["end"]]
    columns["nearest"] = [names[n] if 0 <= n < len(names) else str(n) if n >= 0 else "–" for n in columns["nearest"]]
    columns["tool"] = [str(number) for number in columns["tool"]]
    count = len(columns["start"])
    if not count:
        return "<p class=notes>There was no stroke.</p>"
    body = _rows("Stroke", [str(k + 1) for k in range(count)], shown, columns) + _definitions(shown)
    if scores.totals["strokes"] > count:
        body += f"<p class=notes>These are the first {count} of {scores.totals['strokes']:.0f} strokes.</p>"
    return body
