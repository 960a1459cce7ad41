# SPDX-License-Identifier: MIT
"""Sessions: logs, their files in memory, scores live and from the file, replays, refusals, threads."""

import os
import struct
import tempfile
import threading
import unittest

import numpy as np
import trephine as t

try:
    import resource
except ImportError:  # on Windows
    resource = None
from block import SHAPE, SPACING, TOP, block

DT = 1e-3
RADIUS = 1.6e-3


def labels():
    """One structure, below the strokes."""
    made = np.zeros(SHAPE, np.uint8)
    made[14:22, 12:24, 12:24] = 1
    return made


def scene():
    """A block with a structure that is watched."""
    made = t.Scene(t.Bone(block(), SPACING), 300, t.Burr(tip_radius=RADIUS), cut=t.AdvancingCut(speed=2e-3))
    watched = t.ProtectedStructure(
        guard=t.GuardedStructure(mode=t.GuardMode.WARN), veto=t.StructureVeto(mode=t.VetoMode.WATCH)
    )
    made.set_structures(t.Structures(labels(), SPACING), [watched])
    return made


def strokes(ticks=4000, depth=0.5e-3, count=3):
    """Poses that stroke along x by 8 mm, each time deeper by `depth`, and lift off in between."""
    whole = np.linspace(0, count, ticks, endpoint=False)
    part = whole % 1
    poses = np.tile(np.eye(4), (ticks, 1, 1))
    poses[:, 0, 3] = 8e-3 + 8e-3 * np.clip(np.minimum(part / 0.8, (0.95 - part) / 0.1), 0, 1)
    poses[:, 1, 3] = 10.5e-3
    lift = np.minimum(part - 0.8, np.where(whole < count - 0.1, 1 - part, 1))  # and stays up at the end
    poses[:, 2, 3] = TOP + RADIUS - depth * (1 + np.floor(whole)) + 3e-3 * np.clip(lift / 0.05, 0, 1)
    return poses


def add_gap(path, count, time):
    """Puts dropped records after the first chunk of a log's file, as a log whose disk stalled does."""

    def hashed(data):
        value = 0xCBF29CE484222325
        for byte in data:
            value = (value ^ byte) * 0x100000001B3 % 2**64
        return data + struct.pack("=Q", value)

    with open(path, "rb") as file:
        head, at, records = file.read(32), 0, []
        rest = file.read()
    while at < len(rest):
        length = struct.unpack_from("=I", rest, at + 4)[0]
        records.append(rest[at + 16 : at + 16 + length])
        at += 16 + length + 8
    records.insert(1, struct.pack("=BQd", 4, count, time))
    with open(path, "wb") as file:
        file.write(head)
        for number, record in enumerate(records):
            file.write(hashed(b"CHNK" + struct.pack("=IQ", len(record), number) + record))


class InFolder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = folder.name + "/session.log"

    def assert_same(self, one, other):
        """Dicts of arrays or numbers with the same bits."""
        self.assertEqual(list(one), list(other))
        for key in one:
            np.testing.assert_array_equal(one[key], other[key], key)

    def assert_same_scores(self, one, other):
        for name in ("totals", "strokes", "structures", "around_structures", "tools", "unlisted_tools"):
            self.assert_same(getattr(one, name), getattr(other, name))


class Logs(InFolder):
    def test_the_file_has_every_bit_of_the_run(self):
        poses, spindle = strokes(), np.arange(4000) > 100
        with t.SessionLog(self.path, flush=0.01) as log:
            ticks = scene().run(poses[:2500], spindle[:2500], 2 * DT, log=log)
            log.event(-7)
            log.tool_changed(3)
            log.event(2**40)
            self.assertEqual((log.ticks, log.closed), (2500, False))
        self.assertEqual((log.ticks, log.dropped, log.failed, log.closed), (2500, 0, False, True))
        log.close()
        session = t.load_session(self.path)
        self.assertEqual(len(session), 2500)
        np.testing.assert_array_equal(session.poses, poses[:2500])
        np.testing.assert_array_equal(session.spindle, spindle[:2500])
        np.testing.assert_array_equal(session.dt, np.full(2500, 2 * DT))
        np.testing.assert_allclose(session.time, 2 * DT * np.arange(1, 2501), rtol=1e-12)
        results = session.results()
        self.assertGreater(ticks["removed_mm3"].sum(), 1)
        for key, column in ticks.items():
            np.testing.assert_array_equal(results[key], column, key)
        self.assert_same(session.events, {"position": [2500, 2500], "number": [-7, 2**40]})
        self.assert_same(session.tools, {"position": [2500], "number": [3]})
        self.assert_same(session.gaps, {"position": [], "count": [], "time": []})
        report = session.report
        self.assertEqual((report.ticks, report.dropped, report.missing_time, report.lost_bytes), (2500, 0, 0, 0))
        self.assertTrue(report.complete)
        self.assertIn("2500 ticks", report.text)

    def test_ticks_of_a_loop_are_those_of_a_run(self):
        poses = strokes(600)
        scores = t.Scores(), t.Scores()
        one, other = scene(), scene()
        with t.SessionLog(self.path) as log:
            for pose in poses:
                one.tick(pose, True, DT, log=log, scores=scores[0])
        other.run(poses, True, DT, scores=scores[1])
        self.assert_same_scores(*scores)
        self.assertEqual(len(t.load_session(self.path)), 600)
        self.assert_same(t.load_session(self.path).results(), scene().record(poses, True, DT).results())

    def test_a_run_waits_for_the_disk_and_drops_nothing(self):
        poses = np.tile(strokes(1)[0], (20000, 1, 1))
        poses[:, 2, 3] += 0.05  # in air, where ticks are fast
        with t.SessionLog(self.path, records=64, flush=0.01) as log:
            scene().run(poses, log=log)
            for number in range(100):
                log.event(number)
        session = t.load_session(self.path)
        self.assertEqual((len(session), session.report.dropped, log.dropped), (20000, 0, 0))
        np.testing.assert_array_equal(session.events["number"], np.arange(100))

    def test_a_session_replays_and_so_does_a_recording_of_it(self):
        made = t.Scene(t.Bone(block(), SPACING), 300, t.Burr(tip_radius=RADIUS), cut=t.GeometricCut())
        with t.SessionLog(self.path) as log:
            made.run(strokes(800), log=log)
        session = t.load_session(self.path)
        made.bone.restore()
        made.reset()
        made.forget_wrench()
        report = made.replay(session)
        self.assertEqual((report.ticks, report.different, report.first_different), (800, 0, None))
        self.assertEqual(made.replay(session).ticks, 800)
        self.assertGreater(made.replay(session).different, 0)  # the bone is drilled

    def test_a_file_that_was_cut_short_is_read_up_to_there(self):
        with t.SessionLog(self.path, flush=0.01) as log:
            scene().run(strokes(3000), log=log)
        with open(self.path, "rb") as file:
            bytes_ = file.read()
        with open(self.path, "wb") as file:
            file.write(bytes_[: 2 * len(bytes_) // 3])
        session = t.load_session(self.path)
        self.assertTrue(0 < len(session) < 3000)
        self.assertFalse(session.report.complete)
        self.assertGreater(session.report.lost_bytes, 0)
        self.assertIn("not closed", session.report.text)
        self.assert_same(session.results(), {k: v[: len(session)] for k, v in scene().record(strokes(3000)).results().items()})

    def test_gaps(self):
        with t.SessionLog(self.path, flush=0.01) as log:
            scene().run(strokes(3000), log=log)
        add_gap(self.path, 20, 0.02)
        session = t.load_session(self.path)
        self.assertEqual((len(session), session.report.dropped, session.report.missing_time), (3000, 20, 0.02))
        position = session.gaps["position"][0]
        self.assertTrue(0 < position < 3000)
        self.assert_same(session.gaps, {"position": [position], "count": [20], "time": [0.02]})
        self.assertIn("20 records dropped", session.report.text)
        later = t.score(session)
        self.assertEqual(later.totals["missing_time"], 0.02)
        self.assert_same_scores(later, t.score(self.path))
        self.assertGreater(later.totals["strokes"], t.score(scene().record(strokes(3000))).totals["strokes"] - 1)

    def test_refusals(self):
        with self.assertRaisesRegex(OSError, "nowhere"):
            t.SessionLog(os.path.dirname(self.path) + "/nowhere/session.log")
        with self.assertRaisesRegex(ValueError, "flush must be 0.01 to 0.5 s"):
            t.SessionLog(self.path, flush=2)
        with self.assertRaisesRegex(ValueError, "records must be"):
            t.SessionLog(self.path, records=0)
        with self.assertRaisesRegex(OSError, "cannot be opened"):
            t.load_session(self.path + ".missing")
        with open(self.path, "wb") as file:
            file.write(b"<html> no session at all, but long enough for a head of one </html>")
        with self.assertRaisesRegex(OSError, "is no trephine session or recording"):
            t.load_session(self.path)
        with self.assertRaisesRegex(OSError, "is no trephine session or recording"):
            t.score(self.path)
        log = t.SessionLog(self.path)
        log.close()
        made = scene()
        for use in (lambda: made.run(strokes(2), log=log), lambda: made.tick(np.eye(4), log=log), lambda: log.event(1)):
            with self.assertRaisesRegex(ValueError, "closed"):
                use()
        self.assertEqual(made.run(strokes(2))["status"].shape, (2,))

    @unittest.skipUnless(resource, "needs limits of files' sizes")
    def test_a_full_disk_is_told_at_the_end(self):
        log = t.SessionLog(self.path, records=16)
        before = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (64, before[1]))  # the head and no chunk
        try:
            scene().run(strokes(), log=log)
            with self.assertRaisesRegex(OSError, "could not be written to its end"):
                log.close()
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)
        self.assertEqual((log.failed, log.closed, log.dropped), (True, True, 4000))
        self.assertEqual(len(t.load_session(self.path)), 0)

    def test_a_log_belongs_to_one_run_at_a_time(self):
        one, poses, scores, seen = scene(), strokes(60000), t.Scores(), []
        with t.SessionLog(self.path) as log:
            thread = threading.Thread(target=lambda: one.run(poses, log=log, scores=scores))
            thread.start()
            while thread.is_alive() and not seen:
                try:
                    scores.totals
                except RuntimeError as error:
                    seen.append(str(error))
                    with self.assertRaisesRegex(RuntimeError, "at work on this log"):
                        log.event(1)
            thread.join()
        self.assertIn("at work on these scores", seen[0])
        self.assertEqual((scores.totals["ticks"], log.ticks), (60000, 60000))


class Followed(InFolder):
    def test_a_log_that_follows_the_bone_has_the_bone_that_was_left(self):
        for dtype, isovalue in ((np.int16, 300), (np.uint8, 60), (np.float32, 300)):
            X_WG = np.eye(4)
            X_WG[:3, 3] = 1e-3, 2e-3, -3e-3
            bone = t.Bone(block(dtype), SPACING, X_WG=X_WG)
            before = bone.copy()
            one = t.Scene(bone, isovalue, t.Burr(tip_radius=RADIUS), cut=t.AdvancingCut(speed=2e-3))
            with t.SessionLog(self.path, flush=0.01) as log:
                log.follow(bone, isovalue=isovalue)
                one.run(X_WG @ strokes(), log=log)
            session = t.load_session(self.path)
            self.assertEqual((session.bone.shape, session.bone.isovalue), (SHAPE, isovalue))
            np.testing.assert_array_equal(session.bone.spacing, SPACING)
            np.testing.assert_array_equal(session.bone.X_WG, X_WG)
            left = session.bone_after(before)
            np.testing.assert_array_equal(left.voxels(), bone.voxels())
            self.assertEqual(left.dtype, dtype)
            np.testing.assert_array_equal(left.X_WG, X_WG)
            self.assertTrue((left.voxels() != before.voxels()).any())
            changes = session.changes
            self.assertTrue((np.diff(changes["position"]) >= 0).all())
            for ticks in (0, int(np.median(changes["position"])), 4000):
                voxels = before.voxels()
                for position, index, density in zip(*changes.values()):
                    if position <= ticks:
                        voxels[tuple(index)] = density
                np.testing.assert_array_equal(session.bone_after(before, ticks).voxels(), voxels)
            np.testing.assert_array_equal(voxels, left.voxels())
            with self.assertRaisesRegex(ValueError, "with which the session began"):
                session.bone_after(left)

    def test_a_log_keeps_its_bone_and_follows_one(self):
        bone = t.Bone(block(), SPACING)
        log = t.SessionLog(self.path)
        log.follow(bone)
        with self.assertRaisesRegex(ValueError, "follows one bone"):
            log.follow(bone)
        t.Scene(bone, 300, t.Burr(tip_radius=RADIUS), cut=t.GeometricCut()).run(strokes(100), log=log)
        del bone
        log.close()
        session = t.load_session(self.path)
        self.assertIsNone(session.bone.isovalue)
        self.assertGreater(len(session.changes["density"]), 0)
        with self.assertRaisesRegex(ValueError, "closed"):
            log.follow(t.Bone(block(), SPACING))

    def test_a_log_without_a_bone_has_none(self):
        with t.SessionLog(self.path) as log:
            scene().run(strokes(10), log=log)
        session = t.load_session(self.path)
        self.assertIsNone(session.bone)
        self.assertEqual([len(column) for column in session.changes.values()], [0, 0, 0])
        with self.assertRaisesRegex(ValueError, "followed its bone"):
            session.bone_after(t.Bone(block(), SPACING))


class Scored(InFolder):
    def test_live_and_from_the_file_the_bits_are_the_same(self):
        live = t.Scores(force_limit=0.3, chord=0.5e-3)
        made = scene()
        poses = strokes()
        with t.SessionLog(self.path) as log:
            made.run(poses[:2000], True, 2 * DT, log=log, scores=live)
            log.tool_changed(2)
            live.tool_changed(2)
            made.run(poses[2000:], True, 2 * DT, log=log, scores=live)
        live.finish()
        for source in (self.path, t.load_session(self.path)):
            later = t.score(source, force_limit=0.3, chord=0.5e-3)
            self.assert_same_scores(live, later)
        self.assertGreater(live.totals["over_limit"], 0)
        again = t.Scores(force_limit=0.3, chord=0.5e-3)
        again.add(self.path)
        again.reset()
        self.assertEqual(again.totals["ticks"], 0)
        self.assertEqual(again.add(self.path).ticks, 4000)
        self.assert_same_scores(live, again)

    def test_the_scores_are_those_of_the_motion(self):
        made = scene()
        scores = t.Scores()
        ticks = made.run(strokes(), True, DT, scores=scores)
        scores.finish()
        totals, listed = scores.totals, scores.strokes
        self.assertEqual((totals["ticks"], totals["strokes"], totals["unusable"]), (4000, 3, 0))
        self.assertAlmostEqual(totals["time"], 4.0, places=9)
        self.assertAlmostEqual(totals["removed_mm3"], ticks["removed_mm3"].sum(), places=9)
        self.assertAlmostEqual(totals["peak_force"], np.linalg.norm(ticks["force"] - ticks["push_force"], axis=1).max())
        self.assertEqual({len(column) for column in listed.values()}, {3})
        np.testing.assert_allclose(listed["length"][0], 8e-3, rtol=0.01)
        np.testing.assert_allclose(listed["duration"], 0.8 * 4 / 3, rtol=0.05)
        np.testing.assert_allclose(listed["mean_speed"], listed["length"] / listed["duration"], rtol=1e-12)
        self.assertEqual(list(listed["end"]), [t.StrokeEnd.LIFT_OFF] * 3)
        self.assertAlmostEqual(totals["stroke_length"], listed["length"].sum())
        self.assertAlmostEqual(totals["idle_share"], 1 - listed["duration"].sum() / 4, places=9)
        np.testing.assert_array_equal(listed["nearest"], 0)
        self.assertAlmostEqual(listed["distance"].min(), ticks["distance"][ticks["nearest"] >= 0].min())

    def test_structures_and_tools(self):
        made = scene()
        poses = strokes(3000)
        poses[:, 0, 3] = 9e-3
        poses[:, 2, 3] = TOP + RADIUS - 7e-3 * np.linspace(0, 1, 3000)  # through the structure's top
        scores = t.Scores(structures=2, tools=2)
        ticks = made.run(poses, True, DT, scores=scores)
        scores.tool_changed(1)
        more = made.run(poses[-10:], False, DT, scores=scores)
        scores.tool_changed(7)
        made.run(poses[-5:], False, DT, scores=scores)
        around = scores.structures
        np.testing.assert_array_equal(scores.shell_edges, [0.5e-3, 1e-3, 2e-3, 4e-3])
        self.assertEqual(around["shell_time"].shape, (2, 5))
        known = ticks["nearest"] == 0
        self.assertAlmostEqual(around["breached_mm3"][0], ticks["taken_mm3"].sum() + more["taken_mm3"].sum())
        self.assertGreater(around["breached_mm3"][0], 0)
        self.assertEqual(around["breaches"][0], 1)
        shells = np.searchsorted(np.concatenate([[0], scores.shell_edges]), ticks["distance"][known], "right")
        expected = np.bincount(shells, minlength=6)[:5] * DT
        self.assertGreater(np.count_nonzero(expected), 2)
        expected[shells[-1]] += 15 * DT  # at rest
        np.testing.assert_allclose(around["shell_time"][0], expected, atol=1e-9)
        self.assertEqual(around["distance"][1], np.inf)
        np.testing.assert_array_equal(around["near_misses"], np.zeros((2, 4)))
        self.assert_same({k: v[:1] for k, v in around.items()}, scores.around_structures)
        np.testing.assert_allclose(scores.tools["time"], [3, 0.01], rtol=1e-9)
        np.testing.assert_allclose(scores.tools["spindle_time"], [3, 0], rtol=1e-9)
        np.testing.assert_allclose(scores.unlisted_tools["time"], [0.005], rtol=1e-9)

    def test_a_circle_has_its_curvature_and_speed(self):
        radius, angle = 4e-3, np.linspace(0, 2 * np.pi, 2000)
        poses = strokes(1, depth=0.3e-3).repeat(2000, axis=0)
        poses[:, 0, 3], poses[:, 1, 3] = 12e-3 + radius * np.cos(angle), 10.5e-3 + radius * np.sin(angle)
        scores = t.Scores(chord=0.5e-3)
        t.Scene(t.Bone(block(), SPACING), 300, t.Burr(tip_radius=RADIUS)).run(poses, scores=scores)
        scores.finish()
        listed = scores.strokes
        self.assertEqual(len(listed["length"]), 1)
        self.assertAlmostEqual(listed["mean_curvature"][0], 1 / radius, delta=0.05 / radius)
        self.assertAlmostEqual(listed["peak_speed"][0], 2 * np.pi * radius / 2, delta=1e-4)

    def test_near_misses(self):
        scores = t.Scores(event_gap=0.1)
        ticks = scene().run(strokes(), scores=scores)
        lifted = ticks["distance"] > 4e-3
        self.assertEqual(np.count_nonzero(np.diff(lifted.astype(int)) == 1), 3)
        expected = np.zeros(4)
        starts = [0, *np.flatnonzero(np.diff(lifted.astype(int)) == 1) + 1]
        for start, end in zip(starts, starts[1:]):
            expected[np.searchsorted(scores.shell_edges, ticks["distance"][start:end].min(), "right")] += 1
        np.testing.assert_array_equal(scores.structures["near_misses"][0], expected)
        np.testing.assert_array_equal(scores.around_structures["near_misses"][0], expected)

    def test_options_are_those_of_the_headers(self):
        scores = t.Scores(force=t.ScoredForce.THRUST, strokes=1)
        self.assertEqual((scores.options.strokes, scores.options.chord), (1, 1e-3))
        scene().run(strokes(), scores=scores)
        scores.finish()
        self.assertEqual((len(scores.strokes["start"]), scores.unlisted_strokes, scores.totals["strokes"]), (1, 2, 3))
        self.assertEqual(scores.totals["peak_force"], 0)  # no law, no thrust
        with self.assertRaisesRegex(ValueError, "chord must be"):
            t.Scores(chord=-1)
        with self.assertRaisesRegex(TypeError, "no option 'limit'"):
            t.score(self.path, limit=3)

    def test_every_score_is_documented(self):
        scores = t.Scores()
        for name in ("totals", "strokes", "structures", "tools"):
            text = getattr(t.Scores, name).__doc__
            for key in getattr(scores, name):
                self.assertRegex(text, rf"(?m)^{key}( \[[^]]+\])?: ", name)


if __name__ == "__main__":
    unittest.main()
