# SPDX-License-Identifier: MIT
"""Volumes and segmentations in files, where the module has ITK."""

import os
import tempfile
import unittest

import numpy as np
import trephine as t
from block import SPACING, block, path

try:
    from trephine import _files  # noqa: F401

    HAS_ITK = True
except ImportError:
    HAS_ITK = False


@unittest.skipUnless(HAS_ITK, "the module has no ITK")
class Files(unittest.TestCase):
    def test_a_scan_is_read_in_our_order(self):
        bone = t.read_volume(os.environ["TREPHINE_SCAN"], isovalue=300)
        self.assertEqual((bone.shape, bone.dtype), ((20, 32, 32), np.int16))
        expected = [1200] * 12 + [900, 600, 300, 0, -300, -600, -1000, -1000]
        np.testing.assert_array_equal(bone.voxels(), np.broadcast_to(np.array(expected)[:, None, None], (20, 32, 32)))
        np.testing.assert_allclose(bone.spacing, 0.5e-3)

    def test_drilled_bone_comes_back(self):
        X_WG = np.eye(4)
        X_WG[:3, 3] = 0.01, -0.02, 0.03
        for dtype in (np.uint8, np.int16, np.float32):
            bone = t.Bone(block(dtype), SPACING, X_WG=X_WG)
            t.Scene(bone, 60, t.Burr(tip_radius=1.6e-3), cut=t.GeometricCut()).run(X_WG @ path())
            self.assertTrue((bone.voxels() != block(dtype)).any())
            with tempfile.TemporaryDirectory() as folder:
                t.save_volume(folder + "/bone.nrrd", bone)
                read = t.read_volume(folder + "/bone.nrrd")
            np.testing.assert_array_equal(read.voxels(), bone.voxels())
            self.assertEqual(read.dtype, dtype)
            np.testing.assert_allclose(read.spacing, SPACING, rtol=1e-9)
            np.testing.assert_allclose(read.X_WG, X_WG, atol=1e-12)

    def test_labels(self):
        with tempfile.TemporaryDirectory() as folder:
            made = np.zeros((4, 5, 6), np.uint8)
            made[1:3, 2, 3:5] = 9
            made[3, 4, 5] = 4
            with open(folder + "/nerves.nrrd", "wb") as file:
                file.write(b"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 6 5 4\nspace: left-posterior-superior\n"
                           b"space directions: (0.5,0,0) (0,0.6,0) (0,0,0.4)\nspace origin: (1,2,3)\n"
                           b"encoding: raw\n\n" + made.tobytes())  # fmt: skip
            labels = t.read_labels(folder + "/nerves.nrrd")
        np.testing.assert_array_equal(labels.voxels, np.select([made == 4, made == 9], [1, 2]))
        np.testing.assert_allclose(labels.spacing, [0.5e-3, 0.6e-3, 0.4e-3])
        np.testing.assert_allclose(labels.X_WS[:3, 3], [1e-3, 2e-3, 3e-3])
        self.assertEqual(labels.names, ["label 4", "label 9"])
        bone = t.Bone(block(), SPACING, X_WG=labels.X_WS)
        np.testing.assert_allclose(labels.X_GS(bone), np.eye(4), atol=1e-12)
        self.assertEqual(t.Structures(labels.voxels, labels.spacing, X_GS=labels.X_GS(bone)).count, 2)

    def test_unusable_files_are_volume_errors(self):
        self.assertTrue(issubclass(t.VolumeError, OSError))
        bone = t.Bone(block(), SPACING)
        for word, call in (
            ("no such file", lambda: t.read_volume("/absent.nrrd")),
            ("absent", lambda: t.read_labels("/absent.nrrd")),
            ("no image", lambda: t.read_volume(__file__)),
            ("isovalue|surface", lambda: t.read_volume(os.environ["TREPHINE_SCAN"], isovalue=5000)),
            ("nrrd", lambda: t.save_volume("/tmp/bone.txt", bone)),
            ("folder", lambda: t.save_volume("/absent/bone.nrrd", bone)),
        ):
            with self.subTest(word), self.assertRaisesRegex(t.VolumeError, word):
                call()


@unittest.skipIf(HAS_ITK, "the module has ITK")
class Without(unittest.TestCase):
    def test_it_is_said(self):
        for call in (lambda: t.read_volume("a"), lambda: t.read_labels("a"), lambda: t.save_volume("a", t.Bone(block(), SPACING))):
            with self.assertRaisesRegex(RuntimeError, "needs ITK"):
                call()


if __name__ == "__main__":
    unittest.main()
