# SPDX-License-Identifier: MIT
"""The minute to compare with: its files are small, and its rows alone give its forces."""

import contextlib
import importlib.util
import io
import os
import sys
import tempfile
import unittest

import numpy as np

sys.path.insert(0, os.environ["TREPHINE_EXAMPLE"])
import one_minute  # noqa: E402


class OneMinute(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = folder.name
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            one_minute.main(cls.folder)
        cls.printed = printed.getvalue()
        cls.hand, cls.columns = one_minute.read_csv(os.path.join(cls.folder, "one_minute.csv"))

    def test_the_files_are_small_and_a_minute_long(self):
        for name in os.listdir(self.folder):
            self.assertLessEqual(os.path.getsize(os.path.join(self.folder, name)), 1e6, name)
        self.assertEqual(self.columns["t"][-1], 60)
        self.assertEqual(len(self.columns["t"]), 6001)
        for renderer in one_minute.RENDERERS:
            self.assertIn(renderer, self.printed)

    def test_the_rows_alone_give_the_forces(self):
        # Everything anew, from the text of the file and the formulas of its description.
        i, j, k = np.meshgrid(*(np.arange(n) for n in (96, 80, 40)), indexing="ij")
        depth = 1e3 * np.minimum(0.4e-3 * k - 4e-3, 9e-3 - 0.4e-3 * k)
        density = np.rint(np.clip(300 + 1500 * depth, -1000, 1500)).astype(np.int16)
        np.testing.assert_array_equal(one_minute.bone().voxels(), density.transpose(2, 1, 0))
        for renderer in one_minute.RENDERERS:
            poses, spindle = one_minute.inputs(self.hand)
            self.assertEqual(len(poses), 60000)
            ticks = one_minute.scene(renderer).run(poses, spindle)
            for axis, name in enumerate("xyz"):
                expected = self.columns[f"{renderer}_f{name}"][1:]
                np.testing.assert_allclose(ticks["force"][9::10, axis], expected, rtol=5.1e-4)
            removed = np.cumsum(ticks["removed_mm3"])[9::10]
            np.testing.assert_allclose(removed, self.columns[f"{renderer}_mm3"][1:], rtol=5.1e-5)

    def test_the_hand_does_what_it_says(self):
        force = np.linalg.norm([self.columns[f"coupled_f{name}"] for name in "xyz"], axis=0)
        removed = np.diff(self.columns["coupled_mm3"], prepend=0) * 100  # a second
        t = self.columns["t"]
        for (name, turns, _), (first, last) in zip(one_minute.PHASES, one_minute.spans()):
            part = (t >= first) & (t < last)  # a row has the spindle from its own tick on
            if name in ("press", "slide", "drill", "mill", "break through"):
                self.assertGreater(force[part].mean(), 0.1, name)
            if name in ("drill", "mill", "break through"):
                self.assertGreater(removed[part].mean(), 1, name)
            self.assertTrue(turns or not removed[part].any(), name)
        self.assertEqual(force[t <= 3.9].max(), 0)
        self.assertEqual(force[t > 59].max(), 0)
        # Open from end to end.
        drilled = one_minute.scene("coupled")
        drilled.run(*one_minute.inputs(self.hand))
        self.assertTrue((drilled.bone.voxels()[:, 40, 30] < one_minute.ISOVALUE).all())

    @unittest.skipUnless(importlib.util.find_spec("h5py"), "h5py is not installed")
    def test_the_other_file_holds_the_same(self):
        from trephine import hdf5

        log = hdf5.load(os.path.join(self.folder, "one_minute.hdf5"))
        np.testing.assert_allclose(log.time, self.columns["t"][1:], atol=1e-9)
        np.testing.assert_allclose(log.poses[:, :3], self.hand.place[1:, :3], atol=1e-12)
        np.testing.assert_allclose(log.poses, one_minute.inputs(self.hand)[0][9::10], atol=1e-12)
        np.testing.assert_allclose(log.wrench[:, 2], self.columns["coupled_fz"][1:], rtol=5.1e-4)
        np.testing.assert_allclose(log.burr_diameter, 4e-3)
        volume = len(log.voxels) * one_minute.SPACING**3 * 1e9
        self.assertAlmostEqual(volume / self.columns["coupled_mm3"][-1], 1, delta=0.1)


if __name__ == "__main__":
    unittest.main()
