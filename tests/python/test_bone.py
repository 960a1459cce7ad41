# SPDX-License-Identifier: MIT
"""Bones of arrays: order of axes, dtypes, views, refusals, readers, meshes."""

import os
import struct
import tempfile
import unittest

import numpy as np
import trephine as t
from block import SHAPE, SPACING, TOP, block, path


class Voxels(unittest.TestCase):
    def test_every_dtype_comes_back_as_it_was(self):
        random = np.random.default_rng(1)
        for dtype in (np.uint8, np.int8, np.uint16, np.int16, np.float32):
            voxels = random.integers(0, 127, (5, 6, 7)).astype(dtype)
            bone = t.Bone(voxels, SPACING)
            self.assertEqual(bone.dtype, dtype)
            self.assertEqual(bone.shape, (5, 6, 7))
            np.testing.assert_array_equal(bone.spacing, SPACING)
            np.testing.assert_array_equal(bone.voxels(), voxels)
            self.assertEqual(bone.outside, voxels.min())
        self.assertEqual(t.Bone(voxels, 1e-3, outside=-7.0).outside, -7)

    def test_views_are_copied_in_their_own_order(self):
        whole = np.random.default_rng(2).integers(0, 1000, (12, 10, 8)).astype(np.int16)
        for view in (whole[::2, 1:, ::-1], whole.T, np.asfortranarray(whole), whole.transpose(1, 0, 2)):
            np.testing.assert_array_equal(t.Bone(view, 1e-3).voxels(), view)
        whole.flags.writeable = False
        bone = t.Bone(whole, 1e-3)
        np.testing.assert_array_equal(bone.voxels(), whole)
        bone.voxels()[:] = 0
        np.testing.assert_array_equal(bone.voxels(), whole)

    def test_x_is_the_last_axis(self):
        """A wall at x = 8 mm stops a tool that moves along x, and none that moves along z."""
        voxels = np.full((40, 40, 40), -1000, np.int16)
        voxels[:, :, 20:] = 1200
        for axis, pressed in ((0, True), (1, False), (2, False)):
            scene = t.Scene(t.Bone(voxels, 0.4e-3), 300, t.Burr(tip_radius=1.5e-3, shaft_length=0))
            poses = np.tile(np.eye(4), (600, 1, 1))
            poses[:, :3, 3] = 4e-3
            poses[:, axis, 3] += np.linspace(0, 3e-3, 600)
            force = scene.run(poses, False)["force"][-1]
            self.assertEqual(force[0] < -0.3, pressed)
            self.assertLess(np.abs(force[1:]).max(), 1e-6)

    def test_what_is_no_voxels_is_refused(self):
        good = block()
        for word, wrong in {
            "float64": good.astype(float),
            "int64": good.astype(int),
            "bool": good > 0,
            ">i2": good.astype(">i2"),
            "object": good.astype(object),
            "(z, y, x)": good[0],
            "(1, 50, 36, 40)": good[None],
            "side": good[:0],
            "int64 ": None,
        }.items():
            with self.subTest(word), self.assertRaisesRegex(ValueError, "trephine::Bone: .*" + word.strip().replace("(", r"\(").replace(")", r"\)")):
                t.Bone([[[1, 2], [3, 4]]] if wrong is None else wrong, SPACING)
        for word, spacing in {"spacing": (1, 2), "> 0": (0.5e-3, 0, 0.5e-3), "mm": 0.5, "nan": float("nan")}.items():
            with self.subTest(word), self.assertRaisesRegex(ValueError, word):
                t.Bone(good, spacing)
        with self.assertRaisesRegex(ValueError, "rigid|rotation|pose"):
            t.Bone(good, SPACING, X_WG=np.diag([1, 1, 2, 1]))
        with self.assertRaisesRegex(ValueError, "keep_original"):
            t.Bone(good, SPACING, keep_original=False).restore()

    def test_the_pose_moves_the_bone(self):
        poses = path()
        moved = np.eye(4)
        moved[:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
        moved[:3, 3] = 0.1, -0.2, 0.3
        still = t.Scene(t.Bone(block(), SPACING), 300, t.Burr(tip_radius=1.6e-3)).run(poses, False)
        bone = t.Bone(block(), SPACING, X_WG=moved)
        np.testing.assert_array_equal(bone.X_WG, moved)
        turned = t.Scene(bone, 300, t.Burr(tip_radius=1.6e-3)).run(moved @ poses, False)
        np.testing.assert_allclose(turned["force"], still["force"] @ moved[:3, :3].T, atol=1e-6)
        np.testing.assert_allclose(turned["torque"], still["torque"] @ moved[:3, :3].T, atol=1e-8)
        bone.X_WG = [0, 0, 0, 0, 0, np.sqrt(0.5), np.sqrt(0.5)]
        np.testing.assert_allclose(bone.X_WG[:3, :3], moved[:3, :3], atol=1e-12)
        with self.assertRaises(ValueError):
            bone.X_WG = np.zeros(7)

    def test_restore_and_copy(self):
        bone = t.Bone(block(), SPACING)
        t.Scene(bone, 300, t.Burr(tip_radius=1.6e-3), cut=t.GeometricCut()).run(path())
        drilled = bone.voxels()
        self.assertLess(drilled.sum(dtype=float), block().sum(dtype=float))
        copy = bone.copy()
        left = bone.restore(1)
        self.assertGreater(left, 0)
        self.assertEqual(bone.restore(), 0)
        np.testing.assert_array_equal(bone.voxels(), block())
        np.testing.assert_array_equal(copy.voxels(), drilled)
        bone.take(copy)
        np.testing.assert_array_equal(bone.voxels(), drilled)
        copy.restore()
        np.testing.assert_array_equal(copy.voxels(), block())
        with self.assertRaisesRegex(ValueError, "another grid"):
            bone.take(t.Bone(block(), SPACING))
        self.assertEqual((copy.outside, copy.dtype), (bone.outside, bone.dtype))


class Readers(unittest.TestCase):
    def test_changed_bricks_are_where_voxels_changed(self):
        bone = t.Bone(block(), SPACING)
        reader, second = bone.reader(), t.BoneReader(bone)
        x, y, z = bone.bricks
        self.assertEqual((x, y, z), (5, 5, 7))
        np.testing.assert_array_equal(np.sort(reader.changed()), np.arange(x * y * z))
        self.assertEqual(len(reader.changed()), 0)
        t.Scene(bone, 300, t.Burr(tip_radius=1.6e-3), cut=t.GeometricCut()).run(path())
        voxels = bone.voxels()
        k, j, i = np.nonzero(voxels != block())
        drilled = set((i // 8 + x * (j // 8 + y * (k // 8))).tolist())
        changed = set(reader.changed().tolist())
        self.assertTrue(drilled and drilled <= changed and len(changed) < x * y * z)
        self.assertEqual(len(second.changed()), x * y * z)
        padded = np.pad(voxels, ((1, 16), (1, 16), (1, 16)), constant_values=-1000)
        for b in changed:
            at = [8 * (b // (x * y)), 8 * (b // x % y), 8 * (b % x)]
            expected = padded[at[0] : at[0] + 10, at[1] : at[1] + 10, at[2] : at[2] + 10]
            np.testing.assert_array_equal(reader.copy_brick(b), expected)
            self.assertEqual(reader.brick_range(b), (expected.min(), expected.max()))
        for wrong in (x * y * z, 10**9):
            with self.assertRaisesRegex(ValueError, "brick"):
                reader.copy_brick(wrong)

    def test_a_reader_keeps_its_bone(self):
        reader = t.Bone(block(), SPACING).reader()
        self.assertEqual(reader.copy_brick(0)[1, 1, 1], 1200)


class Meshes(unittest.TestCase):
    def test_volume_and_area_are_the_blocks(self):
        mesh = t.Bone(block(), SPACING).mesh(300)
        v = mesh.vertices.astype(float)[mesh.triangles]
        normal = np.cross(v[:, 1] - v[:, 0], v[:, 2] - v[:, 0]) / 2
        volume = (v.mean(axis=1) * normal).sum() / 3
        # Beyond the outermost voxels the surface is a share of a voxel away.
        sides = [SPACING[a] * (SHAPE[2 - a] - 1 + 2 * 900 / 2200) for a in range(2)]
        expected = sides[0] * sides[1] * (TOP + SPACING[2] * 900 / 2200)
        self.assertLess(abs(volume / expected - 1), 0.01)
        self.assertLess(np.abs(normal.sum(axis=0)).max(), 1e-9)  # closed
        self.assertEqual((mesh.vertices.dtype, mesh.triangles.dtype), (np.float32, np.uint32))
        with self.assertRaisesRegex(ValueError, "isovalue"):
            t.Bone(block(), SPACING).mesh(float("nan"))

    def test_bricks_add_up_to_the_whole(self):
        bone = t.Bone(block(), SPACING)
        t.Scene(bone, 300, t.Burr(tip_radius=1.6e-3), cut=t.GeometricCut()).run(path())

        def moments(mesh):
            v = mesh.vertices.astype(float)[mesh.triangles]
            normal = np.cross(v[:, 1] - v[:, 0], v[:, 2] - v[:, 0]) / 2
            return np.append((v.mean(axis=1) * normal).sum() / 3, np.linalg.norm(normal, axis=1).sum())

        reader = bone.reader()
        parts = sum(moments(reader.mesh(b, 300)) for b in reader.changed())
        np.testing.assert_allclose(parts, moments(bone.mesh(300)), rtol=1e-9)
        with self.assertRaisesRegex(ValueError, "brick"):
            reader.mesh(10**9, 300)
        with self.assertRaisesRegex(ValueError, "isovalue"):
            reader.mesh(0, float("inf"))

    def test_arrays_outlive_their_mesh(self):
        vertices = t.Bone(block(), SPACING).mesh(300).vertices
        self.assertLess(vertices.max(), 0.05)

    def test_files(self):
        mesh = t.Bone(block(), SPACING).mesh(300)
        X_WG = np.eye(4)
        X_WG[:3, 3] = 0.01, 0.02, 0.03
        with tempfile.TemporaryDirectory() as folder:
            mesh.save_stl(folder + "/bone.stl", X_WG=X_WG)
            with open(folder + "/bone.stl", "rb") as file:
                stl = file.read()
            self.assertEqual(struct.unpack_from("<I", stl, 80)[0], len(mesh.triangles))
            first = np.frombuffer(stl, "<f4", 3, 84 + 12)
            np.testing.assert_allclose(first, 1e3 * (mesh.vertices[mesh.triangles[0, 0]] + [0.01, 0.02, 0.03]), rtol=1e-6)
            mesh.save_ply(folder + "/bone.ply")
            with open(folder + "/bone.ply", "rb") as file:
                self.assertIn(f"element vertex {len(mesh.vertices)}\n".encode(), file.read())
            with self.assertRaisesRegex(OSError, "save_stl"):
                mesh.save_stl(os.path.join(folder, "absent", "bone.stl"))


if __name__ == "__main__":
    unittest.main()
