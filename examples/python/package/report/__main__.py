# SPDX-License-Identifier: MIT
"""python3 -m trephine.report SESSION [--bone FILE] [--after FILE] [--labels FILE] [--out FILE.html]"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

import trephine

from . import write


class Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        self.exit(2, f"trephine.report: {message}\n")


def arrays(path: str, *needed: str) -> dict[str, Any]:
    """What a file of numpy.savez holds. Raises ValueError where it lacks an array."""
    with np.load(path, allow_pickle=False) as file:
        found = {name: file[name] for name in file.files}
    for name in needed:
        if name not in found:
            raise ValueError(f"{path} lacks the array {name}")
    return found


def bone_of(path: str | None) -> trephine.Bone | None:
    if path is None:
        return None
    if not path.endswith(".npz"):
        return trephine.read_volume(path)
    found = arrays(path, "voxels", "spacing")
    return trephine.Bone(found["voxels"], found["spacing"], X_WG=found.get("X_WG"), keep_original=False)


def labels_of(path: str | None) -> trephine.Labels | None:
    if path is None:
        return None
    if not path.endswith(".npz"):
        return trephine.read_labels(path)
    found = arrays(path, "voxels", "spacing")
    voxels = found["voxels"]
    names = found.get("names", [f"structure {s}" for s in range(int(voxels.max(initial=0)))])
    spacing = np.broadcast_to(found["spacing"], 3)
    return trephine.Labels(voxels, spacing, found.get("X_WS", np.eye(4)), [str(name) for name in names])


def main() -> None:
    parser = Parser(prog="trephine.report", description="Writes the report of a session, one HTML page.")
    parser.add_argument("session", help="the file of a SessionLog, or a recording")
    volume = "a volume that read_volume reads, or an .npz with voxels (z, y, x), spacing [m] and X_WG"
    parser.add_argument("--bone", metavar="FILE", help="the bone before: " + volume)
    parser.add_argument("--after", metavar="FILE", help="the bone after: the same; a log that followed the bone needs none")
    parser.add_argument("--labels", metavar="FILE", help="structures: a segmentation, or an .npz with X_WS and names")
    parser.add_argument("--isovalue", type=float, help="density of the bone's surface (that of the log, or 300)")
    parser.add_argument("--radius", type=float, default=1.5, help="of the burr that is drawn [mm] (1.5)")
    parser.add_argument("--force-limit", type=float, default=float("inf"), help="[N]")
    parser.add_argument("--out", metavar="FILE", help="the page; beside the session if it is not given")
    given = parser.parse_args()
    out = given.out or str(Path(given.session).with_suffix(".html"))
    try:
        tool = trephine.Burr(tip_radius=given.radius * 1e-3)
        bone, after, labels = bone_of(given.bone), bone_of(given.after), labels_of(given.labels)
        write(given.session, out, bone, after, labels, given.isovalue, tool, force_limit=given.force_limit)
    except (OSError, RuntimeError, ValueError) as error:
        parser.error(str(error))
    print(out)


if __name__ == "__main__":
    main()
