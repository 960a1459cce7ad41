# SPDX-License-Identifier: MIT
"""A session as one HTML page: scores, plots, the bone before and after, and a player.

    python3 -m trephine.report session.log --bone bone.npz --labels nerves.npz --out session.html

The page needs no network and no program but a browser, and can be printed. `write` makes it in Python.
"""

from __future__ import annotations

import base64
import hashlib
import html
import json
import os
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
from numpy.typing import NDArray

import trephine

from ._meshes import meshes_of, removed_bone
from ._tables import figures, tables

__all__ = ["write"]

_BINS = 1200  # of a plot, each with its least and its greatest value
_FRAMES = 15000  # of the player: 25 a second for ten minutes


def write(
    session: trephine.Session | str | os.PathLike[str],
    path: str | os.PathLike[str],
    bone: trephine.Bone | None = None,
    after: trephine.Bone | None = None,
    structures: trephine.Labels | None = None,
    isovalue: float | None = None,
    tool: trephine.Burr | None = None,
    title: str | None = None,
    **options: Any,
) -> None:
    """Writes the report of a Session, or of its file, to an HTML file.

    `bone` is the bone before the session and `after` the one that it left, which are shown where density is at least
    `isovalue`; None: that of the log, or 300. Where the log followed the bone, `after` is known from it. Otherwise a
    replay drills a copy: `scene.replay(session)`, and then `after=scene.bone`. `structures` are those of the scene, as
    `read_labels` returns them, with their pose in the world. `tool` is the Burr that is drawn; None: one with the
    default radii. `options` are the fields of ScoreOptions.

    Raises OSError for a file that cannot be read or written, and ValueError for an option out of range.
    """
    if not isinstance(session, trephine.Session):
        title = title or Path(session).name
        session = trephine.load_session(session)
    scores = trephine.score(session, **options)
    names = list(structures.names) if structures else []
    parts = {kind: (Path(__file__).parent / f"page.{kind}").read_text(encoding="utf-8") for kind in ("html", "css", "js")}
    results, time, poses = session.results(), session.time, session.poses
    results["known_distance"] = np.where(results["nearest"] >= 0, results["distance"], np.inf)
    results["scored_force"] = _scored_force(results, scores.options)
    known = session.bone
    if isovalue is None:
        isovalue = 300 if known is None or known.isovalue is None else known.isovalue
    if bone is not None and after is None and known is not None:
        after = session.bone_after(bone)
    segmentations = [structures, removed_bone(session, isovalue) if bone is None else None]
    meshes, view_notes = meshes_of(bone, after, [s for s in segmentations if s is not None], isovalue, poses[:, :3, 3])
    burr = tool or trephine.Burr()
    data = {
        "duration": float(time[-1]) if len(time) else 0.0,
        "frames": _frames(time, poses, results, session.spindle),
        "strokes": np.stack([scores.strokes["start"], scores.strokes["duration"]], axis=1).tolist(),
        "events": _moments(time, session.events, "event {number}") + _moments(time, session.tools, "tool {number}"),
        "gaps": _moments(time, session.gaps, "{count} lost"),
        "series": _series(time, results, session.spindle, scores.options.force_limit),
        "meshes": meshes,
        "tool": {name: getattr(burr, name) for name in ("tip_radius", "shaft_radius", "shaft_length")},
    }
    page = Template(parts["html"]).substitute(
        title=html.escape(title or "Session"),
        summary=html.escape(session.report.text[0].upper() + session.report.text[1:] + "."),
        figures=figures(scores),
        tables=tables(scores, names),
        view_notes=html.escape(view_notes),
        plot_notes=html.escape(_plot_notes(session, scores.options)),
        data=json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c"),
        style=parts["css"],
        style_hash=_hash(parts["css"]),
        script=parts["js"],
        script_hash=_hash(parts["js"]),
    )
    with open(path, "w", encoding="utf-8", newline="\n") as file:
        file.write(page)


def _hash(text: str) -> str:
    """As a Content-Security-Policy names a script or a style that may be used."""
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()


def _scored_force(results: dict[str, NDArray[Any]], options: trephine.ScoreOptions) -> NDArray[Any]:
    """(N,) the force that the scores judge [N]."""
    if options.force == trephine.ScoredForce.THRUST:
        return results["thrust"]
    force: NDArray[Any] = np.linalg.norm(results["force"] - results["push_force"], axis=1)
    return force


def _frames(time: NDArray[Any], poses: NDArray[Any], results: dict[str, NDArray[Any]], spindle: NDArray[Any]) -> str:
    """Moments of the player as the page's script reads them, 11 numbers each."""
    columns = [time, poses[:, :3, 3], poses[:, :3, 2], results["scored_force"], results["known_distance"]]
    columns += [np.cumsum(results["removed_mm3"]), spindle]
    usable = np.isfinite(poses).all(axis=(1, 2))
    every = max(1, -(-int(usable.sum()) // _FRAMES))
    return base64.b64encode(np.column_stack(columns)[usable][::every].astype("<f4").tobytes()).decode()


def _moments(time: NDArray[Any], records: dict[str, Any], text: str) -> list[Any]:
    """Times at which something happened, each with its text."""
    rows = [dict(zip(records, row)) for row in zip(*records.values())]
    return [[float(time[row["position"] - 1]) if row["position"] else 0.0, text.format(**row)] for row in rows]


def _series(time: NDArray[Any], results: dict[str, NDArray[Any]], spindle: NDArray[Any], limit: float) -> list[dict[str, Any]]:
    """Plots, thinned to the least and the greatest value of each of equal intervals."""
    force: dict[str, Any] = {"name": "Force", "unit": "N", "marks": True, "limit": limit if np.isfinite(limit) else None}
    plots = [(force, results["scored_force"])]
    if np.isfinite(results["known_distance"]).any():
        plots.append(({"name": "Distance from the nearest structure", "unit": "mm"}, 1e3 * results["known_distance"]))
    plots.append(({"name": "Bone removed", "unit": "mm³"}, np.cumsum(results["removed_mm3"])))
    plots.append(({"name": "Spindle on", "unit": "", "flat": True}, np.where(spindle, 1.0, np.nan)))
    bins = min(_BINS, len(time))
    at = np.minimum(time / time[-1] * bins, bins - 1).astype(int) if bins else np.zeros(0, int)
    made = []
    for plot, values in plots:
        low, high = np.full(bins, np.inf), np.full(bins, -np.inf)
        known = np.isfinite(values)
        np.minimum.at(low, at[known], values[known])
        np.maximum.at(high, at[known], values[known])
        made.append({**plot, "low": _numbers(low), "high": _numbers(high)})
    return made


def _numbers(values: NDArray[Any]) -> list[float | None]:
    """Four digits of each; None for what is not known."""
    return [float(f"{v:.4g}") if np.isfinite(v) else None for v in values]


def _plot_notes(session: trephine.Session, options: trephine.ScoreOptions) -> str:
    notes = "Shaded times are strokes, and a click moves the player there."
    if np.isfinite(options.force_limit):
        notes += f" Red bars over the force show where it was over the limit of {options.force_limit:g} N."
    if len(session) > _BINS:
        notes += f" Each plot has {_BINS} intervals with the least and the greatest value of each."
    if session.report.dropped:
        missing = session.report.missing_time
        notes += f" Red lines mark where records are missing; their {missing:.3g} s are not on the time axis."
    return notes
