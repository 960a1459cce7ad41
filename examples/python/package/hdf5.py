# SPDX-License-Identifier: MIT
"""Sessions in HDF5, in the tree that the recorder of volumetric_drilling writes (`metadata_v3`), and that tree read.

    trephine.hdf5.export(trephine.load_session("session.log"), "session.hdf5")
    log = trephine.hdf5.load(["20260101_100000.hdf5", "20260101_100500.hdf5"], X_OT=X_OT)
    scene.run(log.poses, log.spindle, log.dt)

or `python3 -m trephine.hdf5 session.log session.hdf5`. It needs h5py, as Debian's python3-h5py.

A file of `export` holds the tree for tools that read it, and besides a group `trephine`, from which `load` gives the
session back, bit for bit. Files in that tree have neither spindle nor names of tools: see `load`.
"""

from __future__ import annotations

import argparse
import os
import sys
from typing import Any, Iterable, Mapping, NamedTuple, Sequence

import numpy as np
from numpy.typing import NDArray

from . import load_session

try:
    import h5py  # type: ignore[import]
except ImportError as error:
    raise ImportError("trephine.hdf5 needs h5py: apt-get install python3-h5py") from error

Array = NDArray[Any]

DRILL = "mastoidectomy_drill"  #: name of the drill in files of the recorder
MOST_NUMBERS = 2**28  #: of an array that is read: a hostile file may name more than memory holds

_VOXELS = "physics_data/intermittent_data/voxels_removed"
_BURRS = "physics_data/intermittent_data/burr_change"
_FORCES = "physics_data/intermittent_data/drill_force_feedback"
_POSES = "physics_data/continuous_data/high_frequency_poses"
_VOLUME = "vision_data/continuous_data/pose_mastoidectomy_volume"


class Bone(NamedTuple):
    """As `trephine.FollowedBone`."""

    shape: tuple[int, ...]
    spacing: Array
    X_WG: Array
    outside: float
    dtype: str
    isovalue: float | None
    hash: int


class Report(NamedTuple):
    """As `trephine.SessionReport`."""

    ticks: int
    dropped: int
    missing_time: float
    lost_bytes: int
    complete: bool
    text: str


class Tables(NamedTuple):
    """A session of ours: as `trephine.Session`, with the same bits. `export` takes it, too."""

    poses: Array
    spindle: Array
    dt: Array
    time: Array
    columns: dict[str, Array]
    tools: dict[str, Array]
    events: dict[str, Array]
    gaps: dict[str, Array]
    changes: dict[str, Array]
    bone: Bone | None
    report: Report

    def results(self) -> dict[str, Array]:
        """A dict of arrays as `Scene.run` returns it."""
        return self.columns


class Log(NamedTuple):
    """What files in the tree hold, in one piece: N poses, F forces, M removed voxels in G groups, B changes of burr.
    What they lack has no rows. Times are seconds since the epoch."""

    poses: Array  #: (N, 7) X_WT, or X_WO without X_OT: x y z [m], qx qy qz qw
    time: Array  #: (N,) of the poses
    dt: Array  #: (N,) since the pose before [s]
    spindle: Array  #: (N,) bool, as it was given
    wrench_time: Array  #: (F,)
    wrench: Array  #: (F, 6) force [N], then torque [N m]
    voxel_time: Array  #: (G,) when the group was removed
    voxel_group: Array  #: (M,) index of the group, over all files
    voxels: Array  #: (M, 3) i, j, k
    voxel_color: Array  #: (M, 4) r, g, b, a, 0 to 255
    burr_time: Array  #: (B,)
    burr_diameter: Array  #: (B,) [m]
    X_WG: Array | None  #: (7,) pose of the volume
    session: Tables | None  #: the session, from a file of `export`


def _quaternions(R: Array) -> Array:
    """Rotations (N, 3, 3) as qx qy qz qw (N, 4), from the largest of the four, which loses no digits."""
    x, y, z = R[:, 0, 0], R[:, 1, 1], R[:, 2, 2]
    squares = 1 + np.stack([x - y - z, y - x - z, z - x - y, x + y + z], axis=1)  # four times each one's square
    sums = R + R.swapaxes(1, 2)
    turns = R - R.swapaxes(1, 2)
    products = np.empty((len(R), 4, 4))  # four times each product of two
    products[:, :3, :3] = sums
    products[:, 3, :3] = products[:, :3, 3] = np.stack([turns[:, 2, 1], turns[:, 0, 2], turns[:, 1, 0]], axis=1)
    products[:, range(4), range(4)] = squares
    row = products[np.arange(len(R)), np.argmax(squares, axis=1)]
    units: Array = row / np.linalg.norm(row, axis=1, keepdims=True)
    return units


def _sevens(X: Array) -> Array:
    """Poses (N, 4, 4) as (N, 7)."""
    return np.concatenate([X[:, :3, 3], _quaternions(X[:, :3, :3])], axis=1)


def _times(left: Array, right: Array) -> Array:
    """Products of poses (N, 7) and a pose (7,)."""
    q, w = left[:, 3:6], left[:, 6:]
    norm = np.sum(q * q, axis=1, keepdims=True) + w * w
    p, r, s = right[:3], right[3:6], right[6]
    with np.errstate(divide="ignore", invalid="ignore"):  # a pose that is none stays none
        turned = p + 2 / norm * np.cross(q, np.cross(q, p) + w * p)
    vector = w * r + s * q + np.cross(q, r)
    scalar = s * w - np.sum(q * r, axis=1, keepdims=True)
    return np.concatenate([left[:, :3] + turned, vector, scalar], axis=1)


def _put(group: Any, name: str, values: Any) -> None:
    array = np.asarray(values)
    group.create_dataset(name, data=array, compression="gzip" if array.ndim > 0 and array.size > 0 else None)


def _removed(session: Any, voxels: Array | None) -> tuple[Array, Array]:
    """Positions and indices z, y, x of voxels, in the changes that first took them below the isovalue."""
    changes, bone = session.changes, session.bone
    shape = tuple(bone.shape)
    level = np.inf if bone.isovalue is None else bone.isovalue
    index = changes["index"]
    gone = changes["density"] < level
    if voxels is not None:
        if np.shape(voxels) != shape:
            raise ValueError(f"trephine.hdf5.export: voxels must have the shape {shape}, got {np.shape(voxels)}")
        gone &= voxels[tuple(index.T)] >= level
    rows = np.flatnonzero(gone)
    flat = np.ravel_multi_index(tuple(index[rows].T), shape)
    rows = rows[np.sort(np.unique(flat, return_index=True)[1])]
    return changes["position"][rows], index[rows]


def export(
    session: Any,
    path: str | os.PathLike[str],
    start: float = 0.0,
    burrs: Mapping[int, float] | None = None,
    voxels: Array | None = None,
    drill: str = DRILL,
    every: int | None = None,
) -> None:
    """Writes a session, of `load_session` or of `load`, to one HDF5 file, which it replaces.

    Times in the file are those of the session after `start`, its beginning in seconds since the epoch, with what is
    missing. `burrs` are diameters [m] by tool number, from 0 for the first; without them the tree has no burrs. Removed
    voxels are those of the bone that the log followed, once their density went below its isovalue: name `voxels`
    (z, y, x) with which the session began to leave out those that were no bone then. With `every` the tree has each
    so-many-th tick alone, and the file no group `trephine`: little to share. Raises OSError where the file cannot be
    written, ValueError for an `every` below 1 or `voxels` of another shape.
    """
    path = os.fspath(path)
    if every is not None and every < 1:
        raise ValueError(f"trephine.hdf5.export: every must be at least 1, got {every}")
    try:
        with h5py.File(path, "w") as file:
            _put_tree(file, session, start, burrs or {}, voxels, drill, every or 1)
            if every is None:
                _put_session(file.create_group("trephine"), session)
    except OSError as error:
        raise OSError(f"trephine.hdf5.export: {path}: cannot be written ({_reason(error)})") from None


def _put_tree(
    file: Any, session: Any, start: float, burrs: Mapping[int, float], voxels: Any, drill: str, every: int
) -> None:
    times = np.concatenate([[0.0], session.time])  # by position
    for position, missing in zip(session.gaps["position"], session.gaps["time"]):
        times[position + 1 :] += missing
    times += start
    about = file.create_group("metadata_v3")
    _put(about, "camera_intrinsic", np.eye(3))
    _put(about, "camera_extrinsic", np.eye(4))
    about["README"] = (
        "Positions are in m. Poses are T_world_obj, x y z qx qy qz qw, of the burr's centre with +z along the shaft to "
        "the handle. Time stamps are seconds after the start that the export was given. There was no camera. The group "
        "trephine holds the session bit for bit."
    )
    for folder in ("vision_data", "physics_data"):
        for kind in ("intermittent_data", "continuous_data"):
            file.create_group(f"{folder}/{kind}")
    if len(session.time):
        made = file.create_group(f"{_POSES}/{drill}_pose")
        _put(made, "time_stamp", times[every::every])
        _put(made, "pose", _sevens(session.poses[every - 1 :: every]))
        results = session.results()
        made = file.create_group(_FORCES)
        _put(made, "time_stamp", times[every::every])
        _put(made, "wrench", np.concatenate([results["force"], results["torque"]], axis=1)[every - 1 :: every])
    changes = [(0, 0), *zip(session.tools["position"], session.tools["number"])]
    sizes = [(times[position], 1e3 * burrs[int(number)]) for position, number in changes if int(number) in burrs]
    if sizes:
        made = file.create_group(_BURRS)
        _put(made, "time_stamp", [time for time, _ in sizes])
        _put(made, "burr_size", [size for _, size in sizes])
    if session.bone is None:
        return
    about["voxel_volume"] = 1e9 * np.prod(session.bone.spacing)
    about["voxel_volume"].attrs["units"] = "mm^3, millimeters cubed"
    _put(file, _VOLUME, _sevens(np.asarray(session.bone.X_WG)[None]))
    positions, index = _removed(session, voxels)
    if len(positions):
        moments, group = np.unique(positions, return_inverse=True)
        made = file.create_group(_VOXELS)
        _put(made, "voxel_time_stamp", times[moments])
        _put(made, "voxel_removed", np.column_stack([group, index[:, ::-1]]).astype(float))
        _put(made, "voxel_color", np.column_stack([group, np.full((len(group), 4), 255)]).astype(float))
        made["README"] = (
            "The first column of voxel_removed (i, j, k) and voxel_color (r, g, b, a) is a row of voxel_time_stamp."
        )


_TABLES = ("tools", "events", "gaps", "changes")


def _put_session(group: Any, session: Any) -> None:
    _put(group, "X_WT", session.poses)
    for name in ("spindle", "dt", "time"):
        _put(group, name, getattr(session, name))
    tables = {"results": session.results(), **{name: getattr(session, name) for name in _TABLES}}
    for name, table in tables.items():
        made = group.create_group(name)
        for column, values in table.items():
            _put(made, column, values)
    for field in Report._fields:
        group.attrs[field] = getattr(session.report, field)
    if session.bone is not None:
        made = group.create_group("bone")
        for field in Bone._fields:
            value = getattr(session.bone, field)
            if value is not None:
                made.attrs[field] = np.uint64(value) if field == "hash" else value


class _Reader:
    """A file of which each array is checked before it is read. Raises ValueError."""

    def __init__(self, file: Any, path: str) -> None:
        self.file, self.path = file, path

    def fail(self, what: str) -> ValueError:
        return ValueError(f"trephine.hdf5.load: {self.path}: {what}")

    def find(self, name: str) -> Any:
        """The group or array of this name; None if there is none. Links that lead to other files are none."""
        item = self.file
        for part in name.split("/"):
            if not isinstance(item, h5py.Group) or not isinstance(item.get(part, getlink=True), h5py.HardLink):
                return None
            item = item[part]
        return item

    def array(self, name: str, *shape: int) -> Array:
        """Numbers whose shape is (n, *shape); n = 0 if the file has none. Without a shape, of any."""
        item = self.find(name)
        if item is None:
            return np.zeros((0, *shape))
        if not isinstance(item, h5py.Dataset) or item.dtype.kind not in "fiub" or item.dtype.shape:
            raise self.fail(f"{name} is no array of numbers")
        if item.size is None or item.size > MOST_NUMBERS:
            raise self.fail(f"{name} has {item.size} numbers, more than {MOST_NUMBERS}")
        if shape != (-1,) and item.shape[1:] != shape or not item.shape:
            raise self.fail(f"{name} has the shape {item.shape}, not {('n', *shape)}")
        made: Array = item[()]
        return made

    def rows(self, folder: str, *columns: tuple[str, tuple[int, ...]]) -> list[Array]:
        """Arrays of a group, which have a row for each other's."""
        made = [self.array(f"{folder}/{name}", *shape) for name, shape in columns]
        if len({len(array) for array in made}) > 1:
            raise self.fail(f"{folder} has columns of {', '.join(str(len(array)) for array in made)} rows")
        return made


def _reason(error: BaseException) -> str:
    """What h5py or the system says, in a line."""
    text = str(getattr(error, "strerror", None) or error)
    return " ".join(text.split()) or type(error).__name__


class _Part(NamedTuple):
    poses: list[Array]
    wrenches: list[Array]
    burrs: list[Array]
    moments: Array
    voxels: Array
    color: Array
    X_WG: Array | None
    session: Tables | None


def _read(path: str, drill: str) -> _Part:
    try:
        with h5py.File(path, "r") as file:
            reader = _Reader(file, path)
            if not any(isinstance(reader.find(name), h5py.Group) for name in ("physics_data", "metadata_v3", "trephine")):
                raise reader.fail("has no group physics_data, as logs of volumetric_drilling and of ours have")
            moments = reader.array(f"{_VOXELS}/voxel_time_stamp")
            voxels, color = reader.rows(_VOXELS, ("voxel_removed", (4,)), ("voxel_color", (5,)))
            group = voxels[:, 0]
            if not np.all((group >= 0) & (group < len(moments)) & (group == np.floor(group))):
                raise reader.fail(f"{_VOXELS}/voxel_removed has groups without a time stamp")
            volume = reader.array(_VOLUME, *(() if getattr(reader.find(_VOLUME), "ndim", 2) == 1 else (7,)))
            if volume.ndim == 1 and len(volume) not in (0, 7):
                raise reader.fail(f"{_VOLUME} is no pose")
            return _Part(
                reader.rows(f"{_POSES}/{drill}_pose", ("time_stamp", ()), ("pose", (7,))),
                reader.rows(_FORCES, ("time_stamp", ()), ("wrench", (6,))),
                reader.rows(_BURRS, ("time_stamp", ()), ("burr_size", ())),
                moments,
                voxels,
                color,
                volume.reshape(-1, 7)[-1] if len(volume) else None,
                _session(reader) if isinstance(reader.find("trephine"), h5py.Group) else None,
            )
    except OSError as error:
        raise OSError(f"trephine.hdf5.load: {path}: cannot be read as HDF5 ({_reason(error)})") from None
    except (KeyError, RuntimeError, TypeError, AttributeError, OverflowError, MemoryError) as error:
        raise ValueError(f"trephine.hdf5.load: {path}: is damaged ({_reason(error)})") from None


def _session(reader: _Reader) -> Tables:
    def table(name: str) -> dict[str, Array]:
        group = reader.find(f"trephine/{name}")
        return {column: reader.array(f"trephine/{name}/{column}", -1) for column in group} if group is not None else {}

    about = reader.find("trephine").attrs
    made = reader.find("trephine/bone")
    bone = None
    if made is not None:
        a = made.attrs
        isovalue = float(a["isovalue"]) if "isovalue" in a else None
        shape = tuple(int(n) for n in a["shape"])
        bone = Bone(shape, a["spacing"], a["X_WG"], float(a["outside"]), str(a["dtype"]), isovalue, int(a["hash"]))
    report = Report(*(getattr(about[field], "item", lambda value=about[field]: value)() for field in Report._fields))
    return Tables(
        poses=reader.array("trephine/X_WT", 4, 4),
        spindle=reader.array("trephine/spindle").astype(bool),
        dt=reader.array("trephine/dt"),
        time=reader.array("trephine/time"),
        columns=table("results"),
        **{name: table(name) for name in _TABLES},
        bone=bone,
        report=report,
    )


def _joined(parts: Iterable[Sequence[Array]]) -> list[Array]:
    """Columns of all parts, by rising time, which is the first of them."""
    columns = [np.concatenate(column).astype(float) for column in zip(*parts)]
    order = np.argsort(columns[0], kind="stable")
    return [column[order] for column in columns]


def load(
    paths: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    X_OT: Array | None = None,
    spindle: bool | Array = True,
    burr_unit: float = 1e-3,
    drill: str = DRILL,
) -> Log:
    """Reads one session from its files, of volumetric_drilling's recorder, which begins one after another, or ours.

    `X_OT` is the pose of T (the burr's centre, +z along the shaft to the handle) in the frame of their body, (4, 4) or
    (7,); without it the poses are as they stand. The tree has no spindle, so it is as given: a bool, or N of them; a
    session of ours has its own. `burr_unit` [m] is what a burr_size of 1 is as a diameter: 1 mm, as their messages have
    it now; say 2e-3 where it is a radius in mm. Groups that a file lacks have no rows. Poses, forces and burrs are in
    the order of their times. Raises OSError for what is no readable HDF5, ValueError for another tree or shape.
    """
    names = [os.fspath(paths)] if isinstance(paths, (str, os.PathLike)) else [os.fspath(path) for path in paths]
    if not names:
        raise ValueError("trephine.hdf5.load: paths must name a file, got none")
    parts = [_read(name, drill) for name in names]
    if len(parts) > 1 and any(part.session for part in parts):
        raise ValueError("trephine.hdf5.load: a file of ours is a session by itself, got several files")
    time, poses = _joined(part.poses for part in parts)
    wrench_time, wrench = _joined(part.wrenches for part in parts)
    burr_time, sizes = _joined(part.burrs for part in parts)
    firsts = np.cumsum([0] + [len(part.moments) for part in parts])
    voxels = np.concatenate([part.voxels for part in parts])
    group = np.concatenate([part.voxels[:, 0] + first for part, first in zip(parts, firsts)]).astype(np.int64)
    session = parts[0].session
    if X_OT is not None:
        X = np.asarray(X_OT, float)
        if X.shape not in ((4, 4), (7,)):
            raise ValueError(f"trephine.hdf5.load: X_OT must have the shape (4, 4) or (7,), got {X.shape}")
        poses = _times(poses, _sevens(X[None])[0] if X.ndim == 2 else X)
    if session is not None:
        dt, turning = session.dt, session.spindle
    else:
        dt = np.diff(time, prepend=2 * time[0] - time[1] if len(time) > 1 else time - 1e-3)
        turning = np.broadcast_to(np.asarray(spindle, bool), time.shape).copy()
    volumes = [part.X_WG for part in parts if part.X_WG is not None]
    return Log(
        poses,
        time,
        dt,
        turning,
        wrench_time,
        wrench,
        np.concatenate([part.moments for part in parts]).astype(float),
        group,
        voxels[:, 1:].astype(np.int64),
        np.concatenate([part.color[:, 1:] for part in parts]),
        burr_time,
        burr_unit * sizes,
        volumes[-1].astype(float) if volumes else None,
        session,
    )


def main(arguments: Sequence[str] | None = None) -> str | None:
    """The command; returns what went wrong."""
    parser = argparse.ArgumentParser(prog="python3 -m trephine.hdf5", description="Writes a session's file as HDF5.")
    parser.add_argument("session", help="file of a SessionLog, or a recording")
    parser.add_argument("out", help="HDF5 file, which it replaces")
    parser.add_argument("--start", type=float, default=0.0, metavar="S", help="beginning in seconds since the epoch (0)")
    parser.add_argument("--burr", action="append", default=[], metavar="TOOL=MM", help="diameter of the tool of a number")
    given = parser.parse_args(arguments)
    try:
        pairs = [burr.split("=") for burr in given.burr]
        burrs = {int(tool): 1e-3 * float(size) for tool, size in pairs}
        session = load_session(given.session)
        export(session, given.out, given.start, burrs)
    except (OSError, ValueError) as error:
        return str(error)
    print(f"{given.out}: {session.report.text}")
    return None


if __name__ == "__main__":
    sys.exit(main())
