# SPDX-License-Identifier: MIT
"""Scenes: the bits of a C++ program, `run` beside `tick`, volumes of holes, refusals, threads, recordings."""

import copy
import math
import os
import signal
import struct
import subprocess
import tempfile
import threading
import time
import unittest

import numpy as np
import trephine as t
from block import SPACING, TOP, block, path, quaternions


def scene_of(kind, bone):
    """The scenes of same_bits.cpp."""
    burr = t.Burr(tip_radius=1.6e-3)
    if kind == "coupled":
        return t.Scene(bone, 300, burr, t.CoupledOptions(stiffness=700), friction=t.Coulomb(0.3, 0.2),
                       cut=t.GeometricCut(), vibration=t.MillingVibration(), damping=t.Damping(linear=1),
                       passivity=t.PassivityController(), limits=t.DeviceLimits(force=3, torque=0.1))  # fmt: skip
    if kind == "line":
        return t.Scene(bone, 300, burr, t.LineOptions(stiffness=500), line_counts=t.LineCounts(shaft=40),
                       cut=t.RateLimitedCut(rate=2e5), release_limit=t.ReleaseLimit(stiffness=1000))  # fmt: skip
    if kind == "surface":
        return t.Scene(bone, 300, burr, t.SurfaceOptions(budget=t.StiffnessBudget(linear=900, angular=0.4)),
                       surface_counts=t.SurfaceCounts.thesis(), cut=t.AdvancingCut(speed=2e-3),
                       hunt_crossley=t.HuntCrossley(lambda_=2), filter=t.FirstOrderFilter(),
                       rate_limit=t.WrenchRateLimit())  # fmt: skip
    tool = t.tool("match-head-3")
    law = t.CuttingForceOptions(edges=tool.edges, stall_torque=0.05, strength=t.BoneStrength(cortical=1200))
    return t.Scene(bone, 300, tool, t.CoupledOptions(stiffness=2000), cut=t.PressureCut(), law=law)


KINDS = ("coupled", "line", "surface", "law")


def same(a, b):
    """Whether two dicts of arrays hold the same bits."""
    return a.keys() == b.keys() and all(a[k].tobytes() == b[k].tobytes() for k in a)


class Bits(unittest.TestCase):
    def test_a_program_in_cpp_gets_the_same(self):
        spindle = np.arange(1200) >= 600
        for kind in KINDS:
            poses = path(1200, radius=0 if kind == "line" else 1.6e-3)  # Line's tip is the ball's centre
            with self.subTest(kind), tempfile.TemporaryDirectory() as folder:
                bone = t.Bone(block(), SPACING)
                ours = scene_of(kind, bone).run(poses, spindle)
                z, y, x = block().shape
                with open(folder + "/input", "wb") as file:
                    file.write(struct.pack("<4i3d", x, y, z, len(poses), *SPACING) + block().tobytes())
                    file.write(poses.tobytes() + spindle.tobytes())
                run = subprocess.run([os.environ["TREPHINE_SCENE"], kind, folder + "/input"], check=True, capture_output=True)
                rows = np.frombuffer(run.stdout, float, len(poses) * 12).reshape(-1, 12)
                voxels = np.frombuffer(run.stdout, np.int16, offset=rows.nbytes).reshape(z, y, x)
                self.assertEqual(ours["force"].tobytes(), rows[:, :3].tobytes())
                self.assertEqual(ours["torque"].tobytes(), rows[:, 3:6].tobytes())
                for name, column in {"removed_mm3": 6, "depth": 7, "status": 8}.items():
                    np.testing.assert_array_equal(ours[name], rows[:, column])
                if kind == "law":
                    for name, column in {"thrust": 9, "spindle_torque": 10, "spindle_speed": 11}.items():
                        np.testing.assert_array_equal(ours[name], rows[:, column])
                    self.assertGreater(ours["thrust"].max(), 0.5)
                np.testing.assert_array_equal(bone.voxels(), voxels)
                self.assertGreater(np.abs(ours["force"]).max(), 0.05)
                self.assertGreater(ours["removed_mm3"].sum(), 0.2)

    def test_run_is_tick_by_tick(self):
        poses, spindle = path(900), np.arange(900) % 400 > 100
        dt = 1e-3 + 1e-4 * np.sin(np.arange(900))
        for kind in KINDS:
            with self.subTest(kind):
                whole = scene_of(kind, t.Bone(block(), SPACING)).run(poses, spindle, dt)
                scene = scene_of(kind, t.Bone(block(), SPACING))
                for i, pose in enumerate(poses):
                    r = scene.tick(pose, bool(spindle[i]), dt[i])
                    self.assertEqual(r.force.tobytes(), whole["force"][i].tobytes())
                    self.assertEqual(r.torque.tobytes(), whole["torque"][i].tobytes())
                    self.assertEqual((r.status, r.removed_mm3), (whole["status"][i], whole["removed_mm3"][i]))
                    c = r.contact
                    self.assertEqual((c.count, c.tip, c.shaft, c.depth),
                                     tuple(whole[k][i] for k in ("contacts", "tip", "shaft", "depth")))  # fmt: skip

    def test_a_run_in_parts_is_the_whole(self):
        poses = path(1000)
        for kind in KINDS:
            whole = scene_of(kind, t.Bone(block(), SPACING)).run(poses)
            scene = scene_of(kind, t.Bone(block(), SPACING))
            parts = [scene.run(poses[a:b]) for a, b in ((0, 0), (0, 137), (137, 138), (138, 1000))]
            self.assertTrue(same(whole, {k: np.concatenate([p[k] for p in parts]) for k in whole}))

    def test_quaternions_are_the_matrices(self):
        poses = path(800)
        seven = quaternions(poses)
        by_rows = t.Scene(t.Bone(block(), SPACING), 300, t.Burr()).run(poses, False)
        by_quaternions = t.Scene(t.Bone(block(), SPACING), 300, t.Burr()).run(seven, False)
        np.testing.assert_allclose(by_quaternions["force"], by_rows["force"], atol=1e-6)
        scene = t.Scene(t.Bone(block(), SPACING), 300, t.Burr())
        ticks = [scene.tick(p, False) for p in seven]
        self.assertEqual(ticks[-1].force.tobytes(), by_quaternions["force"][-1].tobytes())
        self.assertEqual(scene.tick([*seven[-1][:3], 0, 0, 0, 2]).status, t.Status.BAD_INPUT)


class Physics(unittest.TestCase):
    def test_volume_of_a_hole(self):
        """A ball that goes straight down takes a cylinder with half a ball at its end."""
        spacing, radius, deep = 0.25e-3, 1.5e-3, 4e-3
        voxels = np.full((48, 40, 40), -1000, np.int16)
        voxels[:30] = 1200
        top = (29 + 900 / 2200) * spacing
        poses = np.tile(np.eye(4), (2000, 1, 1))
        poses[:, :2, 3] = 20 * spacing
        poses[:, 2, 3] = np.linspace(top + radius + 1e-4, top + radius - deep, 2000)
        expected = 1e9 * (math.pi * radius**2 * (deep - radius) + 2 / 3 * math.pi * radius**3)
        for renderer in ("coupled", "line", "surface"):
            scene = t.Scene(t.Bone(voxels, spacing), 300, t.Burr(tip_radius=radius), renderer,
                            cut=t.GeometricCut(), cutting=t.CuttingOptions(follow_probe=True))  # fmt: skip
            before = self.mm3(scene.bone)
            removed = scene.run(poses)["removed_mm3"].sum()
            kTolerance = 0.03  # voxels of a sixth of the radius
            self.assertLess(abs(removed / expected - 1), kTolerance, (renderer, removed, expected))
            self.assertLess(abs((before - self.mm3(scene.bone)) / expected - 1), kTolerance)

    def mm3(self, bone):
        mesh = bone.mesh(300)
        a, b, c = (1e3 * mesh.vertices[mesh.triangles[:, i]].astype(float) for i in range(3))
        return np.einsum("ij,ij->", a, np.cross(b, c)) / 6

    def test_a_press_is_the_stiffness_times_the_depth(self):
        scene = t.Scene(t.Bone(block(), SPACING), 300, t.Burr(tip_radius=1.6e-3), t.CoupledOptions(stiffness=600))
        ticks = scene.run(path(2000, lean=0, to=-0.5e-3)[:1400], False)
        self.assertLess(abs(ticks["force"][-1, 2] / (600 * 0.5e-3) - 1), 0.1)
        self.assertEqual(ticks["removed_mm3"].sum(), 0)
        self.assertTrue(ticks["tip"][-1] and not ticks["tip"][0])
        contacts = scene.contacts()
        self.assertGreater(len(contacts["position"]), 0)
        np.testing.assert_allclose(contacts["normal"].mean(axis=0), [0, 0, 1], atol=0.05)
        self.assertGreater(scene.visual_pose[2, 3], path(2000, lean=0, to=-0.5e-3)[1399, 2, 3] + 0.3e-3)

    def test_statuses(self):
        scene = t.Scene(t.Bone(block(), SPACING), 300, t.Burr())
        away, inside = np.eye(4), np.eye(4)
        away[:3, 3] = inside[:3, 3] = 9e-3, 10e-3, TOP + 5e-3
        inside[2, 3] = TOP - 4e-3
        self.assertIs(scene.tick(away).status, t.Status.OK)
        for bad in (np.full((4, 4), np.nan), np.diag([1, 1, 2, 1.0]), np.full(7, np.inf), np.zeros(7)):
            result = scene.tick(bad)
            self.assertIs(result.status, t.Status.BAD_INPUT)
            np.testing.assert_array_equal(result.force, 0)
        statuses = scene.run(np.stack([away, inside]), False)["status"]
        self.assertEqual(statuses[0], t.Status.OK)
        self.assertGreaterEqual(statuses[1], t.Status.STARTED_INSIDE)
        self.assertEqual((statuses == t.Status.OK).sum(), 1)


class Options(unittest.TestCase):
    def test_defaults_are_the_headers(self):
        scene = t.Scene(t.Bone(block(), SPACING), 300, t.Burr())
        self.assertEqual(repr(scene.renderer.coupled), repr(t.CoupledOptions()))
        self.assertEqual((t.CoupledOptions().stiffness, t.Burr().tip_radius), (800, 0.0015))
        self.assertIsNone(scene.stages.cut)
        self.assertEqual(scene.stages.limits.force, math.inf)

    def test_every_option_can_be_set_and_read(self):
        def other(value):
            if isinstance(value, bool):
                return not value
            if isinstance(value, int):
                return value + 1
            return value * 1.01 if math.isfinite(value) else 1.5

        seen = 0
        for name in t.__all__:
            cls = getattr(t, name)
            if not (isinstance(cls, type) and isinstance(getattr(cls, "_fields", None), tuple)) or cls is t.Labels:
                continue
            options = cls(linear=1, angular=1) if cls is t.StiffnessBudget else cls()
            for field in cls._fields:
                value = getattr(options, field)
                if isinstance(value, (bool, int, float)) and not (cls, field) == (t.Burr, "tip_radius"):
                    setattr(options, field, other(value))
                    self.assertEqual(getattr(options, field), other(value), (name, field))
                    self.assertEqual(getattr(copy.deepcopy(options), field), other(value))
                    seen += 1
        self.assertGreater(seen, 100)

    def test_guides_hold_the_axis_and_stop_at_a_depth(self):
        guide = t.AxisGuide(point_G=(5e-3, 5e-3, 0), axis_G=np.array([0, 0, 2.0]), stiffness=300)
        self.assertEqual((guide.point_G, guide.axis_G), ((5e-3, 5e-3, 0), (0, 0, 2)))
        stop = t.DepthStop(point_G=(0, 0, 15e-3), reach=1e-3, stiffness=700)
        scene = t.Scene(t.Bone(block(), SPACING), 300, t.Burr(tip_radius=1e-3), axis_guide=guide, depth_stop=stop)
        poses = np.zeros((600, 7))  # in the air, beside the axis and beyond the stop
        poses[:] = 5.5e-3, 5e-3, 15.5e-3, 0, 0, 0, 1
        force = scene.run(poses)["force"]
        np.testing.assert_allclose(force[-1], [-300 * 0.5e-3, 0, 700 * 0.5e-3], rtol=1e-12)
        self.assertLess(np.abs(force[0]).max(), 1e-4)  # it fades in
        with self.assertRaisesRegex(ValueError, "axis_G"):
            t.AxisGuide(axis_G=(0, 0, 0))
        with self.assertRaisesRegex(TypeError, "point_G"):
            t.AxisGuide(point_G=(0, 0))

    def test_wrong_options_are_refused(self):
        bone = t.Bone(block(), SPACING)
        for error, word, call in (
            (ValueError, "stiffness must be > 0", lambda: t.CoupledOptions(stiffness=-1)),
            (ValueError, "nan", lambda: t.LineOptions(stiffness=math.nan)),
            (ValueError, "kinetic", lambda: t.Coulomb(0.1, 0.2)),
            (TypeError, "no option 'stifness'; it has stiffness", lambda: t.CoupledOptions(stifness=1)),
            (TypeError, "stiffness cannot be 'much'", lambda: t.CoupledOptions(stiffness="much")),
            (TypeError, "no option 'dampen'", lambda: t.Scene(bone, 300, t.Burr(), dampen=t.Damping())),
            (TypeError, "cut cannot be 'all'", lambda: t.Scene(bone, 300, t.Burr(), cut="all")),
            (TypeError, "damping cannot be Coulomb|damping cannot be <", lambda: t.Scene(bone, 300, t.Burr(), damping=t.Coulomb())),
            (ValueError, "renderer must be coupled, line or surface", lambda: t.Scene(bone, 300, t.Burr(), "point")),
            (ValueError, "Surface has no friction", lambda: t.Scene(bone, 300, t.Burr(), "surface", friction=t.Coulomb())),
            (ValueError, "PressureCut", lambda: t.Scene(bone, 300, t.Burr(), cut=t.PressureCut())),
            (ValueError, "take a Burr", lambda: t.Scene(bone, 300, t.tool("disc-6"), "line")),
            (ValueError, "twist-1 to 6", lambda: t.tool("nail-3")),
            (ValueError, "Falcon", lambda: t.device_preset("Toch")),
            (ValueError, "isovalue", lambda: t.Scene(bone, math.nan, t.Burr())),
            (ValueError, "tip_radius", lambda: t.Scene(bone, 300, t.Burr(tip_radius=1.5))),
            (TypeError, "incompatible", lambda: t.Scene(bone, 300, "round-3")),
        ):
            with self.subTest(word), self.assertRaisesRegex(error, word):
                call()
        with self.assertRaises(AttributeError):
            t.CoupledOptions().stifness = 3

    def test_devices_and_tools_by_name(self):
        for name in t.device_preset_names():
            device = t.device_preset(name)
            scene = t.Scene(t.Bone(block(), SPACING), 300, t.Burr(), device, limits=device.limits)
            self.assertEqual(scene.renderer.coupled.stiffness, device.stiffness)
            self.assertLessEqual(np.abs(scene.run(path(1000), False)["force"]).max(), device.limits.force)
        for family, (least, most) in t.tool_families().items():
            self.assertGreater(most, least)
            t.Scene(t.Bone(block(), SPACING), 300, t.tool(f"{family}-{least}"))
        self.assertEqual(t.tool("twist-3").edges.chisel, True)

    def test_stages_and_tools_change_between_ticks(self):
        scene = t.Scene(t.Bone(block(), SPACING), 300, t.tool("round-3"))
        self.assertEqual(scene.run(path(500))["removed_mm3"].sum(), 0)
        scene.stages = t.StageOptions(cut=t.GeometricCut())
        scene.tool = t.tool("disc-6")
        scene.reset()
        scene.forget_wrench()
        ticks = scene.run(path(500, radius=0))
        self.assertGreater(ticks["removed_mm3"].sum(), 1)
        fresh = t.Scene(t.Bone(block(), SPACING), 300, t.tool("disc-6"), cut=t.GeometricCut())
        self.assertTrue(same(ticks, fresh.run(path(500, radius=0))))
        with self.assertRaisesRegex(ValueError, "PressureCut"):
            scene.stages = t.StageOptions(cut=t.PressureCut())
        self.assertIsInstance(scene.stages.cut, t.GeometricCut)
        with self.assertRaisesRegex(ValueError, "set_tool is for the coupled tool"):
            t.Scene(t.Bone(block(), SPACING), 300, t.Burr(), "line").tool = t.Burr(tip_radius=1e-3)


class Inputs(unittest.TestCase):
    def test_wrong_shapes_are_refused_and_nothing_ticks(self):
        scene = t.Scene(t.Bone(block(), SPACING), 300, t.Burr(), cut=t.GeometricCut())
        poses = path(50, to=-3e-3)
        transposed = poses.transpose(0, 2, 1)
        bad_last = poses.copy()
        bad_last[-1, 3, 3] = 2
        for word, call in (
            ("poses must have the shape", lambda: scene.run(poses[0])),
            ("poses must have the shape", lambda: scene.run(poses[:, :3])),
            ("poses must have the shape", lambda: scene.run(poses[None])),
            ("poses must have the shape", lambda: scene.run(np.zeros((5, 6)))),
            ("poses must have the shape", lambda: scene.run(3.0)),
            ("transposed", lambda: scene.run(transposed)),
            ("transposed", lambda: scene.run(bad_last)),
            ("transposed", lambda: scene.tick(transposed[0])),
            ("spindle must be a bool", lambda: scene.run(poses, 1.0)),
            ("spindle must be a bool", lambda: scene.run(poses, "on")),
            ("spindle must be one for all", lambda: scene.run(poses, np.ones(49, bool))),
            ("dt must be > 0", lambda: scene.run(poses, dt=0)),
            ("dt must be > 0", lambda: scene.run(poses, dt=math.nan)),
            ("dt must be > 0", lambda: scene.tick(poses[0], dt=-1)),
            ("dt must be one for all", lambda: scene.run(poses, dt=np.ones((50, 1)))),
            ("dt must be a number", lambda: scene.run(poses, dt="fast")),
            ("a pose must have the shape", lambda: scene.tick(np.eye(3))),
            ("a pose must have the shape", lambda: scene.tick(poses)),
        ):
            with self.subTest(word), self.assertRaisesRegex(ValueError, word):
                call()
        np.testing.assert_array_equal(scene.bone.voxels(), block())
        self.assertEqual(scene.run(np.zeros((0, 4, 4)))["force"].shape, (0, 3))

    def test_lists_integers_and_views_are_poses(self):
        scene = t.Scene(t.Bone(block(), SPACING), 300, t.Burr())
        self.assertEqual(scene.tick([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]).status, t.Status.STARTED_INSIDE)
        poses = path(600)
        plain = t.Scene(t.Bone(block(), SPACING), 300, t.Burr()).run(poses, False)
        doubled = np.repeat(poses, 2, axis=0)
        view = t.Scene(t.Bone(block(), SPACING), 300, t.Burr()).run(doubled[::2], np.zeros(600, bool))
        self.assertTrue(same(plain, view))


class Copies(unittest.TestCase):
    def test_a_copy_drills_its_own_bone_as_the_original(self):
        for kind in KINDS:
            scene = scene_of(kind, t.Bone(block(), SPACING))
            twin = scene.copy()
            first = scene.run(path(700))
            np.testing.assert_array_equal(twin.bone.voxels(), block())
            self.assertTrue(same(first, twin.run(path(700))))

    def test_contact_goes_on_in_a_copy_and_is_taken_back(self):
        for kind in KINDS:
            scene = scene_of(kind, t.Bone(block(), SPACING))
            scene.run(path(900)[:600])
            saved = scene.copy()
            twin, rest = saved.copy(), path(900)[600:]
            first = scene.run(rest)
            self.assertTrue(same(first, twin.run(rest)))
            scene.take(saved)
            np.testing.assert_array_equal(scene.bone.voxels(), saved.bone.voxels())
            self.assertTrue(same(first, scene.run(rest)))
            with self.assertRaisesRegex(ValueError, "another"):
                scene.take(scene_of(kind, t.Bone(block(), SPACING)))


class Threads(unittest.TestCase):
    def test_others_run_and_are_kept_from_the_bone(self):
        scene = t.Scene(t.Bone(block(), SPACING), 300, t.Burr(tip_radius=1.6e-3), cut=t.AdvancingCut(speed=2e-4))
        other = t.Scene(scene.bone, 300, t.Burr())
        reader, started, results = scene.bone.reader(), threading.Event(), []
        poses = path(200_000)

        def work():
            started.set()
            results.append(scene.run(poses))

        thread = threading.Thread(target=work)
        thread.start()
        started.wait()
        refused, changed = 0, 0
        while thread.is_alive():
            changed += len(reader.changed())
            try:
                other.tick(poses[0])
            except RuntimeError as error:
                self.assertIn("another thread", str(error))
                refused += 1
                with self.assertRaisesRegex(RuntimeError, "another thread"):
                    scene.bone.voxels()
                with self.assertRaisesRegex(RuntimeError, "another thread"):
                    scene.bone.restore()
                thread.join(0.01)
        self.assertGreater(refused, 0)
        self.assertGreater(changed, 0)
        self.assertEqual(len(results), 1)
        other.tick(poses[0])

    def test_ctrl_c_ends_a_run(self):
        def on_alarm(*_):
            raise KeyboardInterrupt

        before = signal.signal(signal.SIGALRM, on_alarm)
        try:
            for batch in (False, True):
                scene = t.Scene(t.Bone(block(), SPACING), 300, t.Burr(tip_radius=1.6e-3), cut=t.GeometricCut())
                # Pressed for seconds, and it would drill at the end.
                poses = np.tile(quaternions(path(1000))[-1], (1_000_000, 1))
                spindle = np.arange(len(poses)) > 900_000
                signal.setitimer(signal.ITIMER_REAL, 0.2)
                with self.assertRaises(KeyboardInterrupt):
                    if batch:
                        t.Batch([scene]).run(poses[None], spindle[None])
                    else:
                        scene.run(poses, spindle)
                np.testing.assert_array_equal(scene.bone.voxels(), block())
                scene.tick(poses[0])  # free again
        finally:
            signal.signal(signal.SIGALRM, before)


class Recordings(unittest.TestCase):
    def test_a_recording_replays_bit_for_bit(self):
        poses, spindle = path(600), np.arange(600) > 200
        for kind in KINDS:
            scene = scene_of(kind, t.Bone(block(), SPACING))
            recording = scene.record(poses, spindle, 2e-3)
            with tempfile.TemporaryDirectory() as folder:
                recording.save(folder + "/session.rec")
                loaded = t.Recording.load(folder + "/session.rec")
                with open(folder + "/broken.rec", "wb") as file:
                    file.write(b"no recording at all, but long enough for one to be begun")
                with self.assertRaisesRegex(OSError, "not a trephine recording"):
                    t.Recording.load(folder + "/broken.rec")
            self.assertEqual(len(loaded), 600)
            np.testing.assert_array_equal(loaded.poses, poses)
            np.testing.assert_array_equal(loaded.spindle, spindle)
            np.testing.assert_array_equal(loaded.dt, 2e-3)
            plain = scene_of(kind, t.Bone(block(), SPACING)).run(poses, spindle, 2e-3)
            self.assertTrue(same(plain, {k: loaded.results()[k] for k in plain}))
            report = scene_of(kind, t.Bone(block(), SPACING)).replay(loaded)
            self.assertEqual((report.ticks, report.different, report.first_different), (600, 0, None))
            report = t.Scene(t.Bone(block(), SPACING), 300, t.Burr()).replay(loaded)
            self.assertGreater(report.different, 0)


if __name__ == "__main__":
    unittest.main()
