# SPDX-License-Identifier: MIT
"""The report of a session: its numbers, what is escaped, refusals."""

import base64
import html
import json
import os
import re
import subprocess
import sys
import tempfile
import unittest
from unittest import mock

import numpy as np
import trephine as t
from block import SPACING, TOP
from test_session import RADIUS, add_gap, labels, scene, strokes
from trephine import report
from trephine.report import _meshes

EVIL = "</script><script>document.title='owned'</script><b onclick=x>"
TICKS = 3000


def made(folder, name="session", **changes):
    """A session with an event, another tool and a gap, its report, and what it was made of."""
    path = f"{folder}/{name}.log"
    one = scene()
    before = one.bone.copy()
    with t.SessionLog(path) as log:
        one.run(strokes(TICKS)[:1200], log=log)
        log.event(7)
        one.run(strokes(TICKS)[1200:1900], log=log)
        log.tool_changed(2)
        one.run(strokes(TICKS)[1900:], log=log)
    names = changes.pop("names", ["nerve"])
    given = dict(bone=before, after=one.bone, structures=t.Labels(labels(), np.array(SPACING), np.eye(4), names),
                 tool=t.Burr(tip_radius=RADIUS), force_limit=0.2)  # fmt: skip
    page = f"{folder}/{name}.html"
    report.write(path, page, **{**given, **changes})
    return path, page


def data_of(page):
    with open(page, encoding="utf-8") as file:
        return json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', file.read(), re.S)[1])


def text_of(page):
    """The page's text without its tags."""
    with open(page, encoding="utf-8") as file:
        text = re.sub(r"(?s)<(script|style)[ >].*?</\1>", "", file.read())
    return html.unescape(re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", text)))


def points(mesh):
    """Its vertices in the world, (V, 3) [m]."""
    return np.array(mesh["low"]) + np.frombuffer(base64.b64decode(mesh["vertices"]), "<u2").reshape(-1, 3) * mesh["step"]


def volume(mesh):
    """Of a closed mesh [mm³]."""
    corners = points(mesh)[np.frombuffer(base64.b64decode(mesh["triangles"]), "<u2").reshape(-1, 3)]
    return 1e9 * np.linalg.det(corners).sum() / 6


class InFolder(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = folder.name
        cls.path, cls.page = made(cls.folder)


class Page(InFolder):
    def test_it_says_what_the_scores_are(self):
        scores, text = t.score(self.path, force_limit=0.2), text_of(self.page)
        totals = scores.totals
        self.assertIn(f"{totals['removed_mm3']:.1f} mm³ bone removed", text)
        self.assertIn(f"{totals['mean_force']:.2f} N mean force in strokes", text)
        self.assertIn(f"{totals['strokes']} strokes", text)
        self.assertIn("3000 ticks", text)
        for word in ("Stroke length", "length of the tool's path in strokes", "nerve", "tool 2", "lift off"):
            self.assertIn(word, text)
        self.assertRegex(text, f"Stroke length length of the tool's path in strokes {1e3 * totals['stroke_length']:.2f} mm")
        self.assertIn("0.5–1 mm", text)
        self.assertNotIn("in all 1", text)
        page = self.folder + "/two.html"
        report.write(self.path, page, structures=t.Labels(labels(), np.array(SPACING), np.eye(4), ["nerve", "vein"]))
        least = f"{1e3 * scores.around_structures['distance'][0]:.2f}"
        self.assertRegex(text_of(page), f"nerve {least} 0 .* vein – 0 .* in all {least} 0 ")

    def test_every_score_is_in_it(self):
        text, scores = text_of(self.page), t.score(self.path)
        for name in ("totals", "strokes", "structures", "tools"):
            for key in getattr(scores, name):
                self.assertIn(key.replace("_mm3", "_volume").replace("_", " ").capitalize(), text, name)

    def test_plots_hold_the_extremes_of_every_interval(self):
        session, data = t.load_session(self.path), data_of(self.page)
        results = session.results()
        force = np.linalg.norm(results["force"] - results["push_force"], axis=1)
        plot = data["series"][0]
        self.assertEqual((plot["name"], plot["limit"], len(plot["high"])), ("Force", 0.2, 1200))
        at = np.minimum(session.time / session.time[-1] * 1200, 1199).astype(int)
        for i in range(1200):
            extremes = force[at == i].min(), force[at == i].max()
            self.assertEqual([plot["low"][i], plot["high"][i]], [float(f"{f:.4g}") for f in extremes])
        self.assertEqual([name["name"] for name in data["series"]][-1], "Spindle on")
        np.testing.assert_allclose([e[0] for e in data["events"]], [1.2, 1.9])
        self.assertEqual([e[1] for e in data["events"]], ["event 7", "tool 2"])
        self.assertAlmostEqual(data["duration"], 3.0)

    def test_the_player_has_the_poses(self):
        session, data = t.load_session(self.path), data_of(self.page)
        frames = np.frombuffer(base64.b64decode(data["frames"]), "<f4").reshape(-1, 11)
        self.assertEqual(len(frames), TICKS)
        np.testing.assert_allclose(frames[:, 1:4], session.poses[:, :3, 3], atol=1e-8)
        np.testing.assert_allclose(frames[:, 4:7], session.poses[:, :3, 2], atol=1e-6)
        np.testing.assert_allclose(frames[:, 9], np.cumsum(session.results()["removed_mm3"]), rtol=1e-5)

    def test_meshes_are_those_of_bone_and_structures(self):
        meshes = {mesh["name"]: mesh for mesh in data_of(self.page)["meshes"]}
        self.assertEqual(list(meshes), ["before", "after", "nerve"])

        removed = t.score(self.path).totals["removed_mm3"]
        self.assertAlmostEqual(volume(meshes["before"]) - volume(meshes["after"]), removed, delta=0.15 * removed)
        inside = (labels() == 1).sum() * np.prod(SPACING) * 1e9
        self.assertAlmostEqual(volume(meshes["nerve"]), inside, delta=0.15 * inside)
        voxels = np.argwhere(labels() == 1)[:, ::-1]
        for place, bound in ((points(meshes["nerve"]).min(axis=0), voxels.min(axis=0) - 0.5),
                             (points(meshes["nerve"]).max(axis=0), voxels.max(axis=0) + 0.5)):  # fmt: skip
            np.testing.assert_allclose(place / SPACING, bound, atol=0.3)

    def test_coarse_meshes_are_where_the_bone_is(self):
        page, X_WG = self.folder + "/coarse.html", np.eye(4)
        X_WG[:3, 3] = 0.1, -0.2, 0.3
        bone = t.Bone(scene().bone.voxels(), SPACING, X_WG=X_WG)
        with mock.patch.object(_meshes, "_VERTICES", 1000), mock.patch.object(_meshes, "_MARGIN", 1):
            report.write(self.path, page, bone=bone, structures=t.Labels(labels(), np.array(SPACING), X_WG, ["nerve"]))
        self.assertRegex(text_of(page), r"joins [2-9] voxels along each axis")
        of_bone, of_nerve = (points(mesh) - X_WG[:3, 3] for mesh in data_of(page)["meshes"])
        self.assertLess(len(of_bone), 1000)
        self.assertAlmostEqual(of_bone[:, 2].max(), TOP, delta=2 * SPACING[2])
        middle = (of_nerve.min(axis=0) + of_nerve.max(axis=0)) / 2
        np.testing.assert_allclose(middle / SPACING, np.argwhere(labels() == 1).mean(axis=0)[::-1], atol=0.6)

    def test_the_bone_after_comes_from_a_log_that_followed_it(self):
        one = scene()
        path, page, before = self.folder + "/followed.log", self.folder + "/followed.html", one.bone.copy()
        with t.SessionLog(path) as log:
            log.follow(one.bone, isovalue=200)
            one.run(strokes(TICKS, depth=1.2e-3), log=log)
        report.write(path, page, bone=before)
        told = self.folder + "/told.html"
        report.write(path, told, bone=before, after=one.bone, isovalue=200)
        self.assertEqual([mesh["kind"] for mesh in data_of(page)["meshes"]], ["before", "after"])
        self.assertEqual(data_of(page)["meshes"], data_of(told)["meshes"])
        report.write(path, told, bone=before, isovalue=300)
        self.assertNotEqual(data_of(page)["meshes"], data_of(told)["meshes"])
        with self.assertRaisesRegex(ValueError, "with which the session began"):
            report.write(path, page, bone=one.bone)
        report.write(path, page)
        (removed,) = data_of(page)["meshes"]
        self.assertEqual(removed["name"], "bone removed")
        gone = 1e9 * np.prod(SPACING) * ((before.voxels() >= 200) & (one.bone.voxels() < 200)).sum()
        self.assertAlmostEqual(volume(removed), gone, delta=0.2 * gone)

    def test_a_large_bone_is_cut_out_and_made_coarse(self):
        rng = np.random.default_rng(3)
        wild = rng.integers(0, 600, (120, 120, 120)).astype(np.int16)  # a surface in every voxel
        page = self.folder + "/large.html"
        report.write(self.path, page, bone=t.Bone(wild, 0.5e-3))
        mesh = data_of(page)["meshes"][0]
        self.assertLess(max(np.frombuffer(base64.b64decode(mesh["triangles"]), "<u2")), 40000)
        self.assertIn("cut out around the tool's path", text_of(page))
        self.assertLess(os.path.getsize(page), 5e6)

    def test_ten_minutes_take_few_bytes(self):
        path, page = self.folder + "/long.log", self.folder + "/long.html"
        poses = np.tile(strokes(1)[0], (600000, 1, 1))
        poses[:, 0, 3] += 1e-3 * np.sin(np.arange(600000) * 1e-2)
        poses[:, 2, 3] += 5e-3
        one = t.Scene(t.Bone(np.full((2, 2, 2), -1000, np.int16), 1e-3), 300, t.Burr())
        with t.SessionLog(path) as log:
            one.run(poses, log=log)
        report.write(path, page)
        self.assertLess(os.path.getsize(page), 2e6)
        self.assertIn("1200 intervals", text_of(page))

    def test_gaps_are_marked(self):
        path, page = self.folder + "/gap.log", self.folder + "/gap.html"
        with t.SessionLog(path, flush=0.01) as log:
            scene().run(strokes(TICKS), log=log)
        add_gap(path, 20, 0.02)
        report.write(path, page)
        gaps = data_of(page)["gaps"]
        self.assertEqual([text for _, text in gaps], ["20 lost"])
        self.assertAlmostEqual(gaps[0][0], 1e-3 * t.load_session(path).gaps["position"][0])
        text = text_of(page)
        self.assertIn("20 records dropped while the disk stalled", text)
        self.assertIn("their 0.02 s are not on the time axis", text)

    def test_nothing_given_becomes_script(self):
        folder = f"{self.folder}/a<script>b"
        os.makedirs(folder)
        _, page = made(folder, "x<script>alert(1)<", names=[EVIL], title=None)
        with open(page, encoding="utf-8") as file:
            text = file.read()
        self.assertEqual(len(re.findall(r"<script\b", text)), 2)
        self.assertEqual(len(re.findall(r"</script\b", text)), 2)
        self.assertNotIn("<b ", text)
        self.assertIn("&lt;script&gt;document.title=", text)
        self.assertIn("x&lt;script&gt;alert(1)&lt;.log", text)
        self.assertEqual(data_of(page)["meshes"][-1]["name"], EVIL)

    def test_it_names_no_address(self):
        with open(self.page, encoding="utf-8") as file:
            text = file.read()
        self.assertEqual(set(re.findall(r"https?:[^\"' ]*", text)), {"http://www.w3.org/2000/svg"})
        self.assertEqual(re.findall(r"(?:src|href)=\"?[^\" >]*", text), ['href="data:,'])
        self.assertIn("default-src 'none'", text)
        self.assertNotIn("unsafe", text)

    def test_an_empty_session_and_one_without_bone(self):
        path, page = self.folder + "/empty.log", self.folder + "/empty.html"
        t.SessionLog(path).close()
        report.write(path, page)
        self.assertIn("There was no stroke", text_of(page))
        bad = np.full((3, 4, 4), np.nan)
        with t.SessionLog(path) as log:
            scene().run(bad, log=log)
        report.write(t.load_session(path), page)
        self.assertIn("Unusable ticks of no use to scores, such as those with a bad pose 3", text_of(page))


class Command(InFolder):
    def command(self, *arguments):
        return subprocess.run([sys.executable, "-B", "-m", "trephine.report", *arguments], capture_output=True, text=True)

    def test_files_of_arrays(self):
        np.savez(self.folder + "/bone.npz", voxels=scene().bone.voxels(), spacing=SPACING)
        np.savez(self.folder + "/nerves.npz", voxels=labels(), spacing=SPACING, names=["facial nerve"])
        volumes = "--bone", self.folder + "/bone.npz", "--labels", self.folder + "/nerves.npz"
        run = self.command(self.path, *volumes, "--radius", "1.6")
        self.assertEqual((run.returncode, run.stdout), (0, self.folder + "/session.html\n"), run.stderr)
        data = data_of(self.folder + "/session.html")
        self.assertEqual([mesh["name"] for mesh in data["meshes"]], ["before", "facial nerve"])
        self.assertAlmostEqual(data["tool"]["tip_radius"], 1.6e-3)

    def test_errors_are_one_sentence(self):
        not_arrays = self.folder + "/pickled.npz"
        np.savez(not_arrays, voxels=np.array([{"a": 1}], dtype=object), spacing=1)
        np.savez(self.folder + "/lacks.npz", voxels=labels())
        for arguments, words in {
            (self.folder + "/none.log",): "none.log: cannot be opened",
            (self.page,): "is no trephine session or recording",
            (self.path, "--bone", self.folder + "/lacks.npz"): "lacks the array spacing",
            (self.path, "--bone", not_arrays): "pickle",
            (self.path, "--bone", self.folder + "/none.npz"): "No such file",
            (self.path, "--out", self.folder + "/nowhere/page.html"): "nowhere",
            (self.path, "--radius", "-1"): "tip_radius must be",
            (self.path, "--force-limit", "much"): "invalid float",
            (): "session",
        }.items():
            with self.subTest(words):
                run = self.command(*arguments)
                self.assertEqual((run.returncode, run.stdout), (2, ""))
                self.assertRegex(run.stderr, rf"\Atrephine.report: .*{re.escape(words)}.*\n\Z")


if __name__ == "__main__":
    unittest.main()
