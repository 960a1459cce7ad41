# SPDX-License-Identifier: MIT
"""Sessions as HDF5: the round trip to the bit, files of volumetric_drilling's recorder, refusals."""

import contextlib
import io
import os
import subprocess
import sys
import tempfile
import unittest

import numpy as np
import trephine as t

try:
    import h5py
    import trephine.hdf5 as hdf5
except ImportError as error:
    raise unittest.SkipTest(str(error))
from block import SPACING, TOP, block, path, quaternions, tilted

RADIUS = 1.6e-3
START = 1.7e9  # [s]


def scene():
    return t.Scene(t.Bone(block(), SPACING), 300, t.Burr(tip_radius=RADIUS), cut=t.AdvancingCut(speed=3e-3))


def seven(X):
    return quaternions(X[None])[0]


class InFolder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def name(self, file):
        return os.path.join(self.folder, file)

    def logged(self):
        """A session of 1500 ticks with a bone, tools and events."""
        made = scene()
        with t.SessionLog(self.name("session.log"), flush=0.01) as log:
            log.follow(made.bone, 300)
            log.tool_changed(2)
            made.run(path(900), np.arange(900) > 100, log=log)
            log.event(-(2**62))
            log.tool_changed(3)
            made.run(path(600), True, np.linspace(0.5e-3, 2e-3, 600), log=log)
        return t.load_session(self.name("session.log")), made


class OurOwn(InFolder):
    def assert_same(self, one, other):
        """The bits of arrays, dicts of them and numbers, and their types."""
        if isinstance(one, dict):
            self.assertEqual(sorted(one), sorted(other))
            for key in one:
                self.assert_same(one[key], other[key])
        elif isinstance(one, np.ndarray):
            self.assertEqual((one.dtype, one.shape), (other.dtype, other.shape))
            self.assertEqual(one.tobytes(), other.tobytes())
        else:
            self.assertEqual(one, other)

    def assert_same_session(self, one, other):
        for name in ("poses", "spindle", "dt", "time", "tools", "events", "gaps", "changes"):
            self.assert_same(getattr(one, name), getattr(other, name))
        self.assert_same(one.results(), other.results())
        for name in hdf5.Report._fields:
            self.assertEqual(getattr(one.report, name), getattr(other.report, name))
        self.assertEqual(one.bone is None, other.bone is None)
        for name in hdf5.Bone._fields if one.bone is not None else ():
            self.assert_same(getattr(one.bone, name), getattr(other.bone, name))

    def test_a_session_comes_back_bit_for_bit(self):
        session, _ = self.logged()
        hdf5.export(session, self.name("a.hdf5"), START)
        log = hdf5.load(self.name("a.hdf5"))
        self.assert_same_session(session, log.session)
        hdf5.export(log.session, self.name("b.hdf5"), START)
        self.assert_same_session(session, hdf5.load(self.name("b.hdf5")).session)
        # Nothing of a bone, tools or ticks.
        with t.SessionLog(self.name("empty.log")):
            pass
        empty = t.load_session(self.name("empty.log"))
        hdf5.export(empty, self.name("c.hdf5"))
        self.assert_same_session(empty, hdf5.load(self.name("c.hdf5")).session)

    def test_every_tick_with_all_its_results_is_in_it(self):
        session, made = self.logged()
        hdf5.export(session, self.name("a.hdf5"))
        log = hdf5.load(self.name("a.hdf5"))
        again = scene()
        self.assertEqual(again.replay(session).different, 0)
        ticks = scene().run(log.session.poses, log.spindle, log.dt)
        for name, values in ticks.items():
            np.testing.assert_array_equal(values, log.session.results()[name], name)
        after = session.bone_after(t.Bone(block(), SPACING))
        np.testing.assert_array_equal(after.voxels(), made.bone.voxels())
        changes = log.session.changes
        by_hand = block()
        for index, density in zip(changes["index"], changes["density"]):
            by_hand[tuple(index)] = density
        np.testing.assert_array_equal(by_hand, made.bone.voxels())

    def test_the_tree_is_the_recorders(self):
        session, made = self.logged()
        hdf5.export(session, self.name("a.hdf5"), START, {2: 3e-3, 3: 5e-3}, block())
        with h5py.File(self.name("a.hdf5"), "r") as file:
            self.assertEqual(file["metadata_v3/camera_intrinsic"].shape, (3, 3))
            self.assertEqual(file["metadata_v3/camera_extrinsic"].shape, (4, 4))
            self.assertAlmostEqual(file["metadata_v3/voxel_volume"][()], 0.5 * 0.6 * 0.4)
            self.assertEqual(file["metadata_v3/voxel_volume"].attrs["units"], "mm^3, millimeters cubed")
            self.assertIn("m.", file["metadata_v3/README"][()].decode())
            for folder in ("vision_data", "physics_data"):
                self.assertEqual(sorted(file[folder]), ["continuous_data", "intermittent_data"])
            pose = file["physics_data/continuous_data/high_frequency_poses/mastoidectomy_drill_pose"]
            self.assertEqual(pose["pose"].compression, "gzip")
            time = pose["time_stamp"][()]
            np.testing.assert_allclose(time, START + session.time, atol=1e-6)
            expected = np.concatenate([quaternions(path(900)), quaternions(path(600))])
            sign = np.sign(np.sum(expected[:, 3:] * pose["pose"][:, 3:], axis=1, keepdims=True))
            np.testing.assert_allclose(pose["pose"][:, :3], expected[:, :3], atol=0)
            np.testing.assert_allclose(sign * pose["pose"][:, 3:], expected[:, 3:], atol=1e-12)
            forces = file["physics_data/intermittent_data/drill_force_feedback"]
            np.testing.assert_array_equal(forces["wrench"][:, :3], session.results()["force"])
            np.testing.assert_array_equal(forces["wrench"][:, 3:], session.results()["torque"])
            burrs = file["physics_data/intermittent_data/burr_change"]
            np.testing.assert_allclose(burrs["burr_size"], [3, 5])
            np.testing.assert_allclose(burrs["time_stamp"][()] - START, [0, 0.9], atol=1e-6)
            gone = file["physics_data/intermittent_data/voxels_removed"]
            rows = gone["voxel_removed"][()]
            removed = (block() >= 300) & (made.bone.voxels() < 300)
            self.assertGreater(removed.sum(), 30)
            self.assertEqual(len(rows), removed.sum())
            self.assertTrue(removed[tuple(rows[:, 3:0:-1].astype(int).T)].all())
            self.assertEqual(gone["voxel_color"].shape, (len(rows), 5))
            self.assertEqual(len(gone["voxel_time_stamp"]), rows[-1, 0] + 1)
            self.assertTrue((np.diff(gone["voxel_time_stamp"][()]) > 0).all())

    def test_what_is_missing_takes_its_time(self):
        whole = self.logged()[0]
        gaps = {"position": np.array([500, 900]), "count": np.array([2, 3]), "time": np.array([0.25, 1.0])}
        names = [name for name in hdf5.Tables._fields if name not in ("columns", "gaps")]
        session = hdf5.Tables(columns=whole.results(), gaps=gaps, **{name: getattr(whole, name) for name in names})
        hdf5.export(session, self.name("a.hdf5"))
        late = hdf5.load(self.name("a.hdf5")).time - whole.time
        np.testing.assert_allclose(late, np.repeat([0, 0.25, 1.25], [500, 400, 600]), atol=1e-12)

    def test_a_file_to_share_is_thin(self):
        session = self.logged()[0]
        hdf5.export(session, self.name("a.hdf5"), every=10)
        log = hdf5.load(self.name("a.hdf5"))
        self.assertIsNone(log.session)
        self.assertEqual(len(log.poses), 150)
        np.testing.assert_array_equal(log.time, session.time[9::10])
        np.testing.assert_array_equal(log.wrench[:, :3], session.results()["force"][9::10])
        self.assertGreater(len(log.voxels), 30)
        with self.assertRaisesRegex(ValueError, "voxels must have the shape"):
            hdf5.export(session, self.name("a.hdf5"), voxels=block()[1:])
        with self.assertRaisesRegex(ValueError, "every must be at least 1"):
            hdf5.export(session, self.name("a.hdf5"), every=0)

    def test_the_command(self):
        session = self.logged()[0]
        command = [sys.executable, "-B", "-m", "trephine.hdf5"]
        run = subprocess.run([*command, self.name("session.log"), self.name("a.hdf5"), "--start", "5", "--burr", "2=4"],
                             capture_output=True, text=True)  # fmt: skip
        self.assertEqual((run.returncode, run.stderr), (0, ""))
        self.assertIn("1500 ticks", run.stdout)
        log = hdf5.load(self.name("a.hdf5"))
        self.assert_same_session(session, log.session)
        np.testing.assert_allclose(log.burr_diameter, [4e-3])
        np.testing.assert_allclose(log.burr_time, [5])
        for arguments in ((self.name("none.log"), self.name("a.hdf5")),
                          (self.name("session.log"), self.name("no/folder.hdf5")),
                          (self.name("session.log"), self.name("a.hdf5"), "--burr", "2")):  # fmt: skip
            run = subprocess.run([*command, *arguments], capture_output=True, text=True)
            self.assertEqual(run.returncode, 1)
            self.assertEqual(len(run.stderr.strip().splitlines()), 1, run.stderr)


def recorder_files(names, X_WO, times, skip=()):
    """Files in the recorder's layout: poses, forces, voxels of two groups each, with indices from 0, and burrs."""
    for number, (name, X, time) in enumerate(zip(names, X_WO, times)):
        with h5py.File(name, "w") as file:
            about = file.create_group("metadata_v3")
            about["camera_intrinsic"] = np.eye(3)
            about["README"] = "T_world_obj"
            for group in ("vision_data/continuous_data", "vision_data/intermittent_data"):
                file.create_group(group)
            if "pose" not in skip:
                made = file.create_group("physics_data/continuous_data/high_frequency_poses/mastoidectomy_drill_pose")
                made.create_dataset("time_stamp", data=time, compression="gzip")
                made.create_dataset("pose", data=np.stack([seven(x) for x in X]), compression="gzip")
            physics = file.require_group("physics_data/intermittent_data")
            if "voxels_removed" not in skip:
                made = physics.create_group("voxels_removed")
                made["voxel_removed"] = np.array([[0, 1, 2, 3], [0, 4, 5, 6], [1, 7, 8, 9.0]]) + [0, number, 0, 0]
                made["voxel_color"] = np.array([[0, 9, 9, 9, 255], [0, 8, 8, 8, 255], [1, 7, 7, 7, 255.0]])
                made["voxel_time_stamp"] = time[[0, -1]]
                made["README"] = "groups"
            if "drill_force_feedback" not in skip:
                made = physics.create_group("drill_force_feedback")
                made["time_stamp"] = time[::3]
                made["wrench"] = np.arange(6.0) + np.arange(len(time[::3]))[:, None]
            if "burr_change" not in skip:
                made = physics.create_group("burr_change")
                made["time_stamp"] = time[:1]
                made["burr_size"] = [2.0 + number]


class Theirs(InFolder):
    def setUp(self):
        super().setUp()
        self.X_OT = np.eye(4)
        self.X_OT[:3, :3] = tilted(0.3, -0.2)
        self.X_OT[:3, 3] = 0.01, -0.02, 0.15
        self.X_WT = path(1500)
        self.names = [self.name("1.hdf5"), self.name("2.hdf5")]
        X_WO = self.X_WT @ np.linalg.inv(self.X_OT)
        time = START + 1e-3 * np.arange(1500)
        recorder_files(self.names, (X_WO[:700], X_WO[700:]), (time[:700], time[700:]))
        self.time = time

    def test_two_files_are_one_session(self):
        log = hdf5.load(self.names, self.X_OT)
        np.testing.assert_array_equal(log.time, self.time)
        np.testing.assert_allclose(log.dt, 1e-3, atol=3e-7)
        expected = quaternions(self.X_WT)
        np.testing.assert_allclose(log.poses[:, :3], expected[:, :3], atol=1e-12)
        np.testing.assert_allclose(log.poses[:, 3:], expected[:, 3:], atol=1e-12)
        np.testing.assert_allclose(hdf5.load(self.names, seven(self.X_OT)).poses, log.poses, atol=1e-15)
        np.testing.assert_array_equal(log.voxel_group, [0, 0, 1, 2, 2, 3])
        np.testing.assert_array_equal(log.voxels[:, 0], [1, 4, 7, 2, 5, 8])
        np.testing.assert_array_equal(log.voxel_color[:, 0], [9, 8, 7, 9, 8, 7])
        np.testing.assert_array_equal(log.voxel_time, self.time[[0, 699, 700, 1499]])
        np.testing.assert_array_equal(log.wrench[0], np.arange(6))
        np.testing.assert_array_equal(log.wrench_time, np.concatenate([self.time[:700:3], self.time[700::3]]))
        np.testing.assert_allclose(log.burr_diameter, [2e-3, 3e-3])
        np.testing.assert_allclose(hdf5.load(self.names, burr_unit=2e-3).burr_diameter, [4e-3, 6e-3])
        self.assertTrue(log.spindle.all())
        self.assertIsNone(log.session)
        self.assertIsNone(log.X_WG)
        # By their times, in whichever order they are named.
        np.testing.assert_array_equal(hdf5.load(self.names[::-1], self.X_OT).poses, log.poses)
        # As they stand, without X_OT.
        with h5py.File(self.names[0], "r") as file:
            pose = file["physics_data/continuous_data/high_frequency_poses/mastoidectomy_drill_pose/pose"][()]
        np.testing.assert_array_equal(hdf5.load(self.names[0]).poses, pose)

    def test_a_scene_runs_it_and_loses_bone(self):
        log = hdf5.load(self.names, self.X_OT)
        ticks = scene().run(log.poses, log.spindle, log.dt)
        expected = scene().run(self.X_WT, True)
        self.assertGreater(ticks["removed_mm3"].sum(), 1)
        np.testing.assert_allclose(ticks["removed_mm3"].sum(), expected["removed_mm3"].sum(), rtol=0.01)
        still = scene().run(log.poses, hdf5.load(self.names, self.X_OT, spindle=False).spindle, log.dt)
        self.assertEqual(still["removed_mm3"].sum(), 0)
        turning = np.arange(1500) > 700
        np.testing.assert_array_equal(hdf5.load(self.names, spindle=turning).spindle, turning)

    def test_groups_may_be_missing(self):
        for group in ("pose", "voxels_removed", "drill_force_feedback", "burr_change"):
            with self.subTest(group):
                recorder_files(self.names[:1], [self.X_WT], [self.time], skip=(group,))
                log = hdf5.load(self.names[:1])
                rows = {"pose": log.poses, "voxels_removed": log.voxels, "burr_change": log.burr_diameter,
                        "drill_force_feedback": log.wrench}  # fmt: skip
                self.assertEqual({name for name, array in rows.items() if len(array) == 0}, {group})
                self.assertEqual(rows[group].shape[1:], {"pose": (7,), "voxels_removed": (3,), "burr_change": (),
                                                         "drill_force_feedback": (6,)}[group])  # fmt: skip
                self.assertEqual(len(log.dt), len(log.poses))


class Refusals(InFolder):
    def complaint(self, *arguments, **options):
        with self.assertRaises((OSError, ValueError)) as caught:
            hdf5.load(*arguments, **options)
        text = str(caught.exception)
        self.assertTrue(text.startswith("trephine.hdf5.load: "), text)
        self.assertEqual(len(text.splitlines()), 1, text)
        self.assertIsNone(caught.exception.__cause__)
        self.assertTrue(caught.exception.__suppress_context__ or caught.exception.__context__ is None)
        return text

    def test_what_is_no_such_file_ends_in_a_sentence(self):
        name = self.name("a.hdf5")
        self.assertIn("cannot be read as HDF5", self.complaint(name))
        with open(name, "wb") as file:
            file.write(b"TREPHLOG, which is another format")
        self.assertIn("cannot be read as HDF5", self.complaint(name))
        with h5py.File(name, "w") as file:
            file["data"] = np.zeros(3)
        self.assertIn("has no group physics_data", self.complaint(name))
        self.assertIn("must name a file", self.complaint([]))
        place = "physics_data/intermittent_data/drill_force_feedback"
        for what, put in (
            ("no array of numbers", lambda group: group.create_group("wrench")),
            ("no array of numbers", lambda group: group.create_dataset("wrench", data=[b"text"])),
            ("has the shape (4, 5)", lambda group: group.create_dataset("wrench", data=np.zeros((4, 5)))),
            ("columns of 3, 4 rows", lambda group: group.create_dataset("wrench", data=np.zeros((4, 6)))),
            ("more than", lambda group: group.create_dataset("wrench", (2**40, 6), chunks=(8, 6))),
            ("columns of 3, 0 rows", lambda group: group.__setitem__("wrench", h5py.ExternalLink("b.hdf5", "/a"))),
        ):
            with h5py.File(name, "w") as file:
                group = file.create_group(place)
                group["time_stamp"] = np.arange(3.0)
                put(group)
            self.assertIn(what, self.complaint(name))
        with h5py.File(name, "w") as file:
            group = file.create_group("physics_data/intermittent_data/voxels_removed")
            group["voxel_removed"], group["voxel_color"] = np.ones((3, 4)), np.ones((3, 5))
            group["voxel_time_stamp"] = [1.0]
        self.assertIn("groups without a time stamp", self.complaint(name))
        recorder_files([name], [path(10)], [np.arange(10.0)])
        self.assertIn("X_OT must have the shape", self.complaint(name, X_OT=np.eye(3)))

    def test_damaged_files_end_in_a_sentence_or_are_read(self):
        name = self.name("a.hdf5")
        recorder_files([name], [path(60)], [np.arange(60.0)])
        with open(name, "rb") as file:
            good = file.read()
        random = np.random.default_rng(5)
        refused = 0
        for trial in range(200):
            damaged = bytearray(good[: random.integers(len(good))] if trial < 20 else good)
            for at in random.integers(len(damaged), size=1 + trial % 8) if damaged else ():
                damaged[at] = random.integers(256)
            with open(name, "wb") as file:
                file.write(damaged)
            with contextlib.redirect_stderr(io.StringIO()):
                try:
                    hdf5.load(name)
                except (OSError, ValueError) as error:
                    self.assertTrue(str(error).startswith("trephine.hdf5.load: "), error)
                    refused += 1
        self.assertGreater(refused, 40)


if __name__ == "__main__":
    unittest.main()
