# SPDX-License-Identifier: MIT
"""Environments for reinforcement learning: a drill in a bone, with Gymnasium's interface.

    env = trephine.env.DrillEnv("crown")            # or "mastoid"
    observation, info = env.reset(seed=1)
    observation, reward, terminated, truncated, info = env.step(env.action_space.sample())

Gymnasium is not needed. Where it is installed, DrillEnv is a gymnasium.Env and its spaces are gymnasium's.

Bones are made of formulas, so no file is read. Each task has gates, which are measures with limits. An episode
terminates once all gates are passed, or at a breach: bone of a structure is removed, or the tool's head is in one.
`scripted(task)` is a policy that passes all gates.
"""

from __future__ import annotations

import dataclasses
import functools
import importlib
from typing import Any, Callable, Dict, List, NamedTuple, Sequence, Tuple

import numpy
from numpy.typing import NDArray

from . import AdvancingCut, Bone, Burr, CoupledOptions, NamedTool, Scene, _phantoms, tool

try:
    gymnasium: Any = importlib.import_module("gymnasium")
except ImportError:
    gymnasium = None

Array = NDArray[Any]


class Box:
    """A space of arrays between `low` and `high`: what DrillEnv needs of gymnasium.spaces.Box, where that is absent."""

    def __init__(self, low: Array, high: Array, dtype: type = numpy.float32) -> None:
        self.dtype: Any = numpy.dtype(dtype)
        self.low: Array = low.astype(dtype)
        self.high: Array = high.astype(dtype)
        self.shape = self.low.shape
        self.seed()

    def seed(self, seed: int | None = None) -> None:
        self._random = numpy.random.default_rng(seed)

    def sample(self) -> Array:
        return self._random.uniform(self.low, self.high).astype(self.dtype)

    def __contains__(self, x: object) -> bool:
        return (isinstance(x, numpy.ndarray) and x.dtype == self.dtype and x.shape == self.shape
                and bool(numpy.all((x >= self.low) & (x <= self.high))))  # fmt: skip


class _Env:
    """What DrillEnv needs of gymnasium.Env, where that is absent."""

    np_random: numpy.random.Generator

    def reset(self, *, seed: int | None = None, options: Dict[str, Any] | None = None) -> Any:
        if seed is not None or not hasattr(self, "np_random"):
            self.np_random = numpy.random.default_rng(seed)

    def close(self) -> None:
        pass


_Base: Any = gymnasium.Env if gymnasium else _Env
_Box: Any = gymnasium.spaces.Box if gymnasium else Box


class Gate(NamedTuple):
    """Limits of a measure."""

    least: float = -numpy.inf
    most: float = numpy.inf

    def passes(self, value: float) -> bool:
        return self.least <= value <= self.most


@dataclasses.dataclass(frozen=True)
class Task:
    """A bone, what is planned and what must stay. Arrays are (z, y, x), in the bone's voxels; W is the bone's world."""

    voxels: Array
    spacing: float  #: [m]
    X_WG: Array  #: (4, 4)
    isovalue: float
    tool: Burr | NamedTool
    head: Tuple[float, float]  #: radius of the cutting head, and its length from T's origin up [m]
    cut: AdvancingCut
    names: Tuple[str, ...]  #: of structures
    distances: Array  #: (S, z, y, x) float32, of voxels from each structure [m]
    planned: Array  #: bool: bone that is to be removed
    start: Tuple[float, float, float]  #: of the tool in W, about which it is random by 1 mm [m]
    gates: Dict[str, Gate]
    covered: str | None = None  #: structure over which bone must be left


class DrillEnv(_Base):
    """One task: `crown`, the preparation of a molar for a crown, or `mastoid`, a cortical mastoidectomy.

    A step is `substeps` ticks of 1 ms, over which the tool moves evenly.

    **Action**, (7,) float32 in -1 to 1: translation in W over MOST_SPEED, rotation about W's axes over MOST_TURN, and
    the spindle, which turns above 0.

    **Observation**, float32: position of T in W [mm] (3), the tool's +z in W (3), force [N] (3) and torque [N mm] (3)
    on the tool in W axes in the last tick, contact 0 or 1, shares of the plan that are removed and, of bone that is not
    planned, that are removed too much (2), then the distance of the virtual tool's head from each structure [mm], as far
    as 10 mm and as the voxels reach; with `patch`, densities round the head's centre over the isovalue, less 1, as
    (patch, patch, patch) in z, y, x, in steps of two voxels. All are clipped to the space.

    **Reward**: 100 times the share of the plan that a step removes, less 50 times the share that it removes too much,
    less 0.1 for each newton over the gate's limit, less 0.01 a step; 10 more for success, and 10 less for a breach.

    **info**: `gates`, each with its value; `passed`; and `breach`, the structure's name or "". Truncated after
    `seconds` of simulated time.
    """

    metadata: Dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 50}
    MOST_SPEED = 0.02  #: [m/s] along each axis
    MOST_TURN = 1.0  #: [rad/s] about each axis

    def __init__(
        self, task: str = "crown", *, substeps: int = 20, seconds: float = 120, patch: int = 0, render_mode: str | None = None
    ) -> None:
        if task not in TASKS:
            raise ValueError(f"trephine.env: task must be one of {', '.join(TASKS)}, got {task!r}")
        self.task = t = TASKS[task]()
        self.substeps, self.seconds, self.patch, self.render_mode = substeps, seconds, patch, render_mode
        self.bone = Bone(t.voxels, t.spacing, X_WG=t.X_WG)
        self.scene = Scene(self.bone, t.isovalue, t.tool, CoupledOptions(stiffness=4000, force=20, torque=0.5), cut=t.cut)
        self._reader = self.bone.reader()
        # Bricks are whole in these, and voxels beyond the bone are no bone.
        sides = [(0, -n % 8) for n in t.voxels.shape]
        self._bone_before = numpy.pad(t.voxels >= t.isovalue, sides)
        self._planned = numpy.pad(t.planned, sides).ravel()
        self._distances = numpy.pad(t.distances, [(0, 0), *sides], mode="edge").reshape(len(t.names), -1)
        self._solid = self._bone_before.copy()
        self._planned_count = int(self._planned.sum())
        self._low = t.X_WG[:3, 3] - 0.02
        self._high = t.X_WG[:3, 3] + t.spacing * (numpy.array(t.voxels.shape[::-1]) - 1) + 0.02
        self.action_space = _Box(-numpy.ones(7, numpy.float32), numpy.ones(7, numpy.float32), dtype=numpy.float32)
        reach = 1e3 * numpy.maximum(abs(self._low), abs(self._high))
        greatest = [*reach, 1, 1, 1, *[50] * 3, *[2000] * 3, 1, 1, 10, *[10] * len(t.names), *[10] * patch**3]
        most: Array = numpy.array(greatest, numpy.float32)
        self.observation_space = _Box(-most, most, dtype=numpy.float32)

    def reset(self, *, seed: int | None = None, options: Dict[str, Any] | None = None) -> Tuple[Array, Dict[str, Any]]:
        """Begins an episode with the bone as it was. `options` may have the `start` of the tool in W [m]."""
        super().reset(seed=seed)
        self.bone.restore()
        self.scene.reset()
        self.scene.forget_wrench()
        self._reader.changed()
        numpy.copyto(self._solid, self._bone_before)
        t = self.task
        self._at = numpy.array((options or {}).get("start", t.start + self.np_random.uniform(-1e-3, 1e-3, 3)), float)
        self._turned = numpy.eye(3)
        self._steps = self._right = self._wrong = 0
        self._taken = numpy.zeros(len(t.names), int)
        self._thinnest, self._peak, self._breach = numpy.inf, 0.0, ""
        ticks = self.scene.run(self._poses(numpy.zeros(3), numpy.zeros(3))[:1], False)
        return self._observation(ticks), self._info()

    def step(self, action: Array) -> Tuple[Array, float, bool, bool, Dict[str, Any]]:
        """Runs `substeps` ticks."""
        action = numpy.clip(numpy.asarray(action, float), -1, 1)
        time = 1e-3 * self.substeps
        move = numpy.clip(self._at + time * self.MOST_SPEED * action[:3], self._low, self._high) - self._at
        spindle = bool(action[6] > 0)
        ticks = self.scene.run(self._poses(move, time * self.MOST_TURN * action[3:6]), spindle)
        right, wrong = self._removed()
        force = float(numpy.sqrt((ticks["force"] ** 2).sum(axis=1).max()))
        self._peak = max(self._peak, force)
        self._steps += 1
        observation = self._observation(ticks)
        inside = self._nearest() < -0.5 * self.task.spacing
        if spindle and inside.any():
            self._breach = self.task.names[int(inside.argmax())]
        elif self._taken.any():
            self._breach = self.task.names[int((self._taken > 0).argmax())]
        info = self._info()
        reward = (100 * right - 50 * wrong) / self._planned_count - 0.01
        reward -= 0.1 * max(0.0, force - self.task.gates["peak_force_N"].most)
        success = bool(all(info["passed"].values()))
        reward += 10 * success - 10 * bool(self._breach)
        truncated = bool(self._steps * time >= self.seconds - 1e-9)
        return observation, float(reward), success or bool(self._breach), truncated, info

    def render(self) -> Array | None:
        """A section of the bone through the tool's axis as (height, width, 3) uint8, +z up; the plan is green, and
        structures are red."""
        if self.render_mode is None:
            return None
        z, y, x = self.task.voxels.shape
        row = int(numpy.clip(round((self._at[1] - self.task.X_WG[1, 3]) / self.task.spacing), 0, y - 1))
        grey = numpy.where(self._solid[:z, row, :x], 200, 20)
        picture = numpy.repeat(grey[..., None], 3, axis=2)
        picture[..., 1] += 50 * self.task.planned[:, row]
        picture[..., 0] += 50 * (self.task.distances[:, :, row] < 0).any(axis=0)
        zx = self.task.X_WG[[2, 0], 3] + self.task.spacing * numpy.moveaxis(numpy.indices((z, x)), 0, -1)
        for point in self._head()[:, [2, 0]]:
            picture[numpy.linalg.norm(zx - point, axis=-1) < self.task.head[0]] = 90, 140, 250
        return numpy.minimum(picture[::-1], 255).astype(numpy.uint8)

    def _poses(self, move: Array, turn: Array) -> Array:
        """Poses of the ticks in which the tool moves and turns by these vectors in W, where it then is."""
        share = numpy.arange(1, self.substeps + 1) / self.substeps
        poses = numpy.tile(numpy.eye(4), (self.substeps, 1, 1))
        poses[:, :3, 3] = self._at + share[:, None] * move
        poses[:, :3, :3] = _rotations(share[:, None] * turn) @ self._turned
        self._at, self._turned = poses[-1, :3, 3].copy(), poses[-1, :3, :3].copy()
        return poses

    def _removed(self) -> Tuple[int, int]:
        """Counts of voxels that are no bone any more: planned, and not."""
        nz, ny, nx = self._solid.shape
        bx, by, _ = self.bone.bricks
        gone: List[Array] = []
        for b in self._reader.changed().tolist():
            k, j, i = 8 * (b // (bx * by)), 8 * (b // bx % by), 8 * (b % bx)
            before = self._solid[k : k + 8, j : j + 8, i : i + 8]
            now = before & (self._reader.copy_brick(b)[1:9, 1:9, 1:9] >= self.task.isovalue)
            z, y, x = numpy.nonzero(before & ~now)
            if len(z):
                gone.append(((k + z) * ny + j + y) * nx + i + x)
                before[:] = now
        if not gone:
            return 0, 0
        at = numpy.concatenate(gone)
        self._taken += (self._distances[:, at] < 0).sum(axis=1)
        if self.task.covered:
            cover = self._distances[self.task.names.index(self.task.covered), at].min() - self.task.spacing / 2
            self._thinnest = min(self._thinnest, float(cover))
        right = int(self._planned[at].sum())
        self._right += right
        self._wrong += len(at) - right
        return right, len(at) - right

    def _head(self) -> Array:
        """(N, 3) centres of balls along the head of the virtual tool, in W [m]."""
        radius, length = self.task.head
        X = self.scene.proxy_pose
        return X[:3, 3] + numpy.linspace(0, length, 1 + int(numpy.ceil(length / radius)))[:, None] * X[:3, 2]

    def _nearest(self) -> Array:
        """Distances of the virtual tool's head from the structures, (S,) [m]."""
        z, y, x = self._solid.shape
        u = (self._head() - self.task.X_WG[:3, 3]) / self.task.spacing
        u = numpy.clip(u, 0, numpy.array([x, y, z]) - 1.001)
        low = u.astype(int)
        part = u - low
        least = numpy.zeros((len(self.task.names), len(u)))
        for corner in numpy.ndindex(2, 2, 2):
            i, j, k = (low + corner).T
            weight = numpy.where(corner, part, 1 - part).prod(axis=1)
            least += weight * self._distances[:, (k * y + j) * x + i]
        return least.min(axis=1) - self.task.head[0]

    def _observation(self, ticks: Dict[str, Array]) -> Array:
        shares = self._right / self._planned_count, self._wrong / self._planned_count
        parts = [1e3 * self._at, self._turned[:, 2], ticks["force"][-1], 1e3 * ticks["torque"][-1],
                 [ticks["contacts"][-1] > 0, *shares], 1e3 * self._nearest()]  # fmt: skip
        if self.patch:
            parts.append(self._patch().ravel())
        made = numpy.concatenate(parts).astype(numpy.float32)
        return numpy.clip(made, self.observation_space.low, self.observation_space.high)

    def _patch(self) -> Array:
        """Densities round the head's centre, those of air beyond the voxels."""
        z, y, x = self.task.voxels.shape
        centre = (self.scene.proxy_pose[:3, 3] - self.task.X_WG[:3, 3]) / self.task.spacing
        i, j, k = numpy.round(centre).astype(int)[:, None] + 2 * (numpy.arange(self.patch) - self.patch // 2)
        at = numpy.meshgrid(k, j, i, indexing="ij")
        there = numpy.all([(a >= 0) & (a < n) for a, n in zip(at, (z, y, x))], axis=0)
        voxels = numpy.full(there.shape, self.bone.outside)
        voxels[there] = self.bone.voxels()[tuple(a[there] for a in at)]
        return voxels / self.task.isovalue - 1

    def _info(self) -> Dict[str, Any]:
        mm3 = (1e3 * self.task.spacing) ** 3
        values = {
            "overlap": 2 * self._right / (self._planned_count + self._right + self._wrong),
            "removed_share": self._right / self._planned_count,
            "peak_force_N": self._peak,
            "breaches": int(bool(self._breach)),
            "cover_mm": 1e3 * self._thinnest,
            **{f"{name}_mm3": float(mm3 * taken) for name, taken in zip(self.task.names, self._taken)},
        }
        gates = {name: values[name] for name in self.task.gates}
        passed = {name: gate.passes(values[name]) for name, gate in self.task.gates.items()}
        return {"gates": gates, "passed": passed, "breach": self._breach}


def _rotations(vectors: Array) -> Array:
    """Matrices (N, 3, 3) of rotation vectors (N, 3), by Rodrigues."""
    angle = numpy.linalg.norm(vectors, axis=1)[:, None, None]
    x, y, z = (vectors / numpy.maximum(angle[:, :, 0], 1e-300)).T
    o = numpy.zeros_like(x)
    K = numpy.stack([o, -z, y, z, o, -x, -y, x, o], axis=1).reshape(-1, 3, 3)
    return numpy.eye(3) + numpy.sin(angle) * K + (1 - numpy.cos(angle)) * (K @ K)


def _points(shape: Sequence[int], spacing: float, origin: Array) -> Array:
    """Centres of voxels (z, y, x) as (N, 3) x, y, z in W [m]."""
    return origin + spacing * numpy.indices(shape).reshape(3, -1).T[:, ::-1]


# The stump of a crown: an elliptic cylinder up from the margin [m].
_STUMP_RADII, _STUMP_MARGIN, _STUMP_TOP = (3.9e-3, 3.4e-3), 1.0e-3, 4.3e-3
_NEIGHBOUR = numpy.array([11.2e-3, 0, 0])  # along x to the next tooth
_CROWN_RADIUS = 0.8e-3


@functools.lru_cache(maxsize=None)
def _crown() -> Task:
    """A molar and the near half of its neighbour, without most of their roots; W's origin is the middle of its neck."""
    spacing = 0.2e-3
    whole = _phantoms.tooth_voxels((89, 67, 71), spacing)[38:]  # x from -7 mm, y from -6.6 mm, z from -3 mm
    voxels = numpy.full((51, 67, 89), whole.min(), whole.dtype)
    voxels[:, :, :71] = whole
    voxels[:, :, 56:] = numpy.maximum(voxels[:, :, 56:], whole[:, :, :33])
    origin = numpy.array([-7e-3, -6.6e-3, -3e-3])
    points = _points(voxels.shape, spacing, origin)
    tooth = _phantoms.tooth_distances(points)
    pulp, neighbour = tooth[:, 2], _phantoms.tooth_distances(points - _NEIGHBOUR)[:, 0]
    stump = numpy.hypot(*(points[:, :2] / _STUMP_RADII).T) < 1
    stump &= points[:, 2] < _STUMP_TOP
    planned = (tooth[:, 0] < neighbour) & (points[:, 2] > _STUMP_MARGIN) & ~stump
    X_WG = numpy.eye(4)
    X_WG[:3, 3] = origin
    return Task(
        voxels=voxels, spacing=spacing, X_WG=X_WG, isovalue=_phantoms.TOOTH_ISOVALUE, tool=tool("cylinder-1.6"),
        head=(_CROWN_RADIUS, 5.5 * _CROWN_RADIUS - 2 * _CROWN_RADIUS), cut=AdvancingCut(speed=4e-3, reference_force=1),
        names=("pulp", "neighbour"),
        distances=numpy.stack([pulp, neighbour]).reshape(2, *voxels.shape).astype(numpy.float32),
        planned=planned.reshape(voxels.shape) & (voxels >= _phantoms.TOOTH_ISOVALUE), start=(0, 0, 9e-3),
        gates={"overlap": Gate(least=0.9), "pulp_mm3": Gate(most=0), "neighbour_mm3": Gate(most=0),
               "breaches": Gate(most=0), "peak_force_N": Gate(most=5)},
    )  # fmt: skip


# The ear canal, a tube, and the cavity of a mastoidectomy: half an ellipsoid that keeps away from structures [m].
_CANAL_ENDS, _CANAL_RADIUS = ((9.5e-3, 0, 4e-3), (9.5e-3, -0.5e-3, -7e-3)), 3e-3
_CAVITY_CENTRE, _CAVITY_RADII, _CAVITY_MARGIN = (-2.5e-3, 0, 0), (7.5e-3, 8e-3, 9e-3), 1.5e-3
_MASTOID_RADIUS = 2.5e-3


def _from_canal(points: Array) -> Array:
    a, b = numpy.array(_CANAL_ENDS)
    along = numpy.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
    return numpy.linalg.norm(points - a - along[:, None] * (b - a), axis=1) - _CANAL_RADIUS


def _from_all(points: Array) -> Array:
    """Distances from the structures of the temporal bone, (N, S) [m]."""
    return numpy.column_stack([_phantoms.temporal_distances(points), _from_canal(points)])


def _in_cavity(points: Array, shrunk: float) -> Array:
    """Whether points are in the cavity, and so far from its wall as `shrunk` [m]."""
    radii = numpy.array(_CAVITY_RADII) - shrunk
    within = numpy.linalg.norm((points - _CAVITY_CENTRE) / radii, axis=1) < 1
    return within & (_from_all(points).min(axis=1) > _CAVITY_MARGIN + shrunk)


@functools.lru_cache(maxsize=None)
def _mastoid() -> Task:
    """A temporal bone whose outer face is z = 0 of W; x is forward and y up."""
    voxels, spacing, X_WG, isovalue = _phantoms.temporal_bone()
    points = _points(voxels.shape, spacing[0], X_WG[:3, 3])
    # The canal's wall is two voxels wide.
    bone = numpy.clip(0.5 + _from_canal(points) / (2 * spacing[0]), 0, 1).reshape(voxels.shape)
    voxels = numpy.round(bone * voxels + (1 - bone) * voxels.min()).astype(voxels.dtype)
    distances = _from_all(points).T.reshape(-1, *voxels.shape).astype(numpy.float32)
    return Task(
        voxels=voxels, spacing=spacing[0], X_WG=X_WG, isovalue=isovalue,
        tool=Burr(tip_radius=_MASTOID_RADIUS, shaft_radius=1.2e-3, shaft_length=60e-3), head=(_MASTOID_RADIUS, 0),
        cut=AdvancingCut(speed=4e-3, reference_force=1), names=(*_phantoms.TEMPORAL_STRUCTURES, "ear canal"),
        distances=distances, planned=_in_cavity(points, 0).reshape(voxels.shape) & (voxels >= isovalue),
        start=(-2.5e-3, 0, 6e-3), covered="facial nerve",
        gates={"removed_share": Gate(least=0.9), "breaches": Gate(most=0), "cover_mm": Gate(least=1),
               "peak_force_N": Gate(most=8)},
    )  # fmt: skip


TASKS: Dict[str, Callable[[], Task]] = {"crown": _crown, "mastoid": _mastoid}


class Scripted:
    """A policy that leads the tool along a path, slower where the force rises. For one episode."""

    def __init__(self, path: Array, ease: float, time: float = 0.02) -> None:
        """`path` has rows of x, y, z in W [m] and the speed of the way there [m/s]. At the force `ease` [N] the tool
        nearly stands. `time` is that of a step [s]."""
        self.path, self.ease, self.time, self.next = path, ease, time, 0

    def __call__(self, observation: Array) -> Array:
        action = numpy.zeros(7, numpy.float32)
        action[6] = 1
        at = 1e-3 * observation[:3].astype(float)
        while self.next < len(self.path) and numpy.linalg.norm(self.path[self.next, :3] - at) < 2e-5:
            self.next += 1
        if self.next == len(self.path):
            return action
        way = self.path[self.next, :3] - at
        force = float(numpy.linalg.norm(observation[6:9]))
        most = self.path[self.next, 3] * self.time * numpy.clip(1 - force / self.ease, 0.05, 1)
        way *= min(1.0, most / float(numpy.linalg.norm(way)))
        action[:3] = way / (self.time * DrillEnv.MOST_SPEED)
        return action


def scripted(task: str, **changes: float) -> Scripted:
    """A policy that passes the gates of a task, for an environment with the default `substeps`. `changes` are
    parameters of its path: see `crown_path` and `mastoid_path`."""
    path = {"crown": crown_path, "mastoid": mastoid_path}[task](**changes)
    return Scripted(path, {"crown": 4, "mastoid": 6}[task])


def crown_path(offset: float = 0.0, deeper: float = 0.0, feed: float = 6e-3, pitch: float = 1.3e-3) -> Array:
    """Lines over the crown, and a way round it. `offset` [m] widens the way round, `deeper` [m] lowers all of it,
    `feed` [m/s] is the speed in bone, and `pitch` [m] lies between lines."""
    fast, r = 20e-3, _CROWN_RADIUS
    a, b = numpy.array(_STUMP_RADII) + r + offset
    rows: List[Tuple[float, float, float, float]] = [(0, -9e-3, 9e-3, fast)]
    side, z = -1.0, _STUMP_TOP + r - deeper
    for x in numpy.linspace(-4.2e-3, 4.2e-3, 1 + int(numpy.ceil(8.4e-3 / pitch))):
        y = 4.2e-3 * numpy.sqrt(1 - (x / 5.4e-3) ** 2) + 1.2e-3
        rows += [(x, side * y, z, fast), (x, -side * y, z, feed)]
        side = -side
    z = _STUMP_MARGIN + r - deeper
    rows += [(*rows[-1][:2], 9e-3, fast), (-8e-3, 0, 9e-3, fast), (-8e-3, 0, z, fast)]
    for angle in numpy.radians(numpy.arange(180, 180 + 375, 5)):
        rows.append((a * numpy.cos(angle), b * numpy.sin(angle), z, feed))
    return numpy.array(rows)


def mastoid_path(feed: float = 1e-2, layer: float = 1.6e-3, pitch: float = 1.8e-3, spare: float = -4e-4) -> Array:
    """Layers of lines, each as deep as the cavity lets the burr. `spare` [m] is kept from its wall."""
    r, fast = _MASTOID_RADIUS, 20e-3
    x, y = numpy.arange(-12e-3, 8e-3, 0.5e-3), numpy.arange(-10e-3, 10e-3, pitch)
    levels = numpy.arange(r, -9e-3, -0.1e-3)
    grid = numpy.stack(numpy.meshgrid(x, y, levels, indexing="ij"), axis=-1)
    free = _in_cavity(numpy.minimum(grid.reshape(-1, 3), [1, 1, 0]), r + spare).reshape(grid.shape[:3])
    deepest = levels[numpy.maximum(free.cumprod(axis=2).sum(axis=2) - 1, 0)]  # where no level is free: the first
    rows: List[Tuple[float, float, float, float]] = []
    forward = True
    for level in numpy.arange(r - layer, deepest.min() - layer, -layer):
        for n in range(len(y)):
            columns = numpy.flatnonzero(deepest[:, n] < level + layer - 1e-9)
            if not len(columns):
                continue
            line = [(x[c], y[n], max(level, deepest[c, n]), feed) for c in (columns if forward else columns[::-1])]
            rows += [(*line[0][:2], 4e-3, fast), *line, (*line[-1][:2], 4e-3, fast)]
            forward = not forward
    return numpy.array(rows)


def play(env: Any, policy: Callable[[Array], Array], seed: int | None = None) -> Tuple[float, Dict[str, Any]]:
    """Runs an episode; returns its sum of rewards and its last info."""
    observation, info = env.reset(seed=seed)
    total, over = 0.0, False
    while not over:
        observation, reward, terminated, truncated, info = env.step(policy(observation))
        total += float(reward)
        over = terminated or truncated
    return total, info
