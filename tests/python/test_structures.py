# SPDX-License-Identifier: MIT
"""Structures: a box that must stay, one that may break, and protections that are made while a scene runs."""

import threading
import unittest

import numpy as np
import trephine as t
from block import SHAPE, SPACING, TOP, block, path


def labels():
    """Structure 0 below the drill's end, and structure 1 beside it."""
    made = np.zeros(SHAPE, np.uint8)
    made[10:20, 12:24, 12:24] = 1
    made[23:27, 12:24, 20:28] = 2
    return made


def down(ticks=1200):
    return path(ticks, lean=0, to=-5e-3)


class Protected(unittest.TestCase):
    def test_the_guard_pushes_and_the_veto_keeps_all_of_it(self):
        structures = t.Structures(labels(), SPACING)
        self.assertEqual(structures.count, 2)
        each = [
            t.ProtectedStructure(guard=t.GuardedStructure(stiffness=500), veto=t.StructureVeto(margin=0.3e-3)),
            t.ProtectedStructure(guard=t.GuardedStructure(mode=t.GuardMode.WARN), veto=t.StructureVeto(mode=t.VetoMode.WATCH)),
        ]
        scene = t.Scene(t.Bone(block(), SPACING), 300, t.Burr(tip_radius=1.6e-3), cut=t.GeometricCut())
        self.assertNotIn("nearest", scene.run(down()[:1]))
        bare = scene.copy()
        scene.set_structures(structures, each)
        ticks = scene.run(down())
        self.assertTrue((bare.run(down())["force"] != ticks["force"]).any())
        self.assertGreater(ticks["push_force"][:, 2].max(), 0.2)
        totals = [scene.totals(s) for s in range(2)]
        self.assertGreater(totals[0].refused_mm3, 0.5)
        self.assertEqual(totals[0].taken_mm3, 0)
        self.assertGreater(totals[1].taken_mm3, 0.5)
        self.assertAlmostEqual(totals[0].refused_mm3, ticks["refused_mm3"].sum(), places=9)
        self.assertAlmostEqual(totals[1].taken_mm3, ticks["taken_mm3"].sum(), places=9)
        self.assertGreaterEqual(totals[1].breaches, 1)
        voxels, inside = scene.bone.voxels(), labels() == 1
        np.testing.assert_array_equal(voxels[inside], block()[inside])
        self.assertLess(bare.bone.voxels()[inside].min(), 1200)
        last = scene.tick(down()[-1]).structures
        self.assertEqual((last.nearest, last.warns, last.distance), tuple(ticks[k][-1] for k in ("nearest", "warns", "distance")))
        twin = scene.copy()
        self.assertEqual(twin.totals(0).refused_mm3, totals[0].refused_mm3)
        self.assertEqual(twin.run(down()[-2:])["nearest"][-1], last.nearest)
        scene.clear_structures()
        self.assertEqual(scene.tick(down()[-1]).structures.nearest, -1)

    def test_a_protection_is_made_while_the_scene_runs(self):
        scene = t.Scene(t.Bone(block(), SPACING), 300, t.Burr(tip_radius=1.6e-3))
        structures = t.Structures(labels(), SPACING)
        made = []
        thread = threading.Thread(target=lambda: made.append(scene.make_protection(structures)))
        thread.start()
        while thread.is_alive():
            scene.run(down()[:50], False)
        scene.exchange(made[0])
        self.assertGreaterEqual(scene.run(down()[:50], False)["nearest"][-1], 0)
        nothing = scene.make_protection()
        scene.exchange(nothing)
        self.assertNotIn("nearest", scene.run(down()[:1]))
        self.assertEqual(nothing.totals(0).breaches, 0)
        with self.assertRaisesRegex(ValueError, "another scene's"):
            scene.copy().exchange(nothing)

    def test_refusals(self):
        for word, wrong in {
            "uint8": labels().astype(int),
            "shape": labels()[0],
            "a voxel must belong": np.zeros(SHAPE, np.uint8),
        }.items():
            with self.subTest(word), self.assertRaisesRegex(ValueError, word):
                t.Structures(wrong, SPACING)
        with self.assertRaisesRegex(ValueError, "reach"):
            t.Structures(labels(), SPACING, reach=0)
        scene = t.Scene(t.Bone(block(), SPACING), 300, t.Burr())
        structures = t.Structures(labels(), SPACING)
        with self.assertRaisesRegex(ValueError, "trephine::"):
            scene.set_structures(structures, [t.ProtectedStructure()])
        with self.assertRaisesRegex(ValueError, "margin"):
            t.GuardedStructure(margin=-1)
        self.assertEqual(t.GuardedStructure().mode, t.GuardMode.PUSH)
        self.assertGreater(TOP, 0)


if __name__ == "__main__":
    unittest.main()
