# SPDX-License-Identifier: MIT
"""Batches: the bits of single scenes for any number of threads, and refusals."""

import unittest

import numpy as np
import trephine as t
from block import SPACING, block, path
from test_scene import KINDS, same, scene_of


def scenes(count):
    return [scene_of(KINDS[s % len(KINDS)], t.Bone(block(), SPACING)) for s in range(count)]


class Batches(unittest.TestCase):
    def test_any_number_of_threads_gives_the_bits_of_single_runs(self):
        poses = np.stack([path(400, to=-1e-3 - 1e-4 * s) for s in range(6)])
        spindle = np.arange(400) > 50 * np.arange(6)[:, None]
        single = [s.run(poses[i], spindle[i]) for i, s in enumerate(scenes(6))]
        for threads in (1, 2, 5, 64, None):
            batch = t.Batch(scenes(6))
            self.assertEqual(len(batch), 6)
            both = [batch.run(poses[:, a:b], spindle[:, a:b], threads=threads) for a, b in ((0, 150), (150, 400))]
            ticks = {k: np.concatenate([part[k] for part in both], axis=1) for k in both[0]}
            self.assertEqual(ticks["force"].shape, (6, 400, 3))
            for s in range(6):
                self.assertTrue(same(single[s], {k: ticks[k][s] for k in single[s]}), (threads, s))
        self.assertEqual(ticks["removed_mm3"][0].sum(), single[0]["removed_mm3"].sum())

    def test_scenes_without_a_law_report_zeros_beside_those_with_one(self):
        ticks = t.Batch(scenes(4)).run(np.stack([path(400)] * 4))
        np.testing.assert_array_equal(ticks["thrust"][0], 0)
        self.assertGreater(ticks["thrust"][3].max(), 0)

    def test_refusals(self):
        bone = t.Bone(block(), SPACING)
        two = [t.Scene(bone, 300, t.Burr()) for _ in range(2)]
        with self.assertRaisesRegex(ValueError, "a bone of its own"):
            t.Batch(two)
        with self.assertRaisesRegex(ValueError, "a bone of its own"):
            t.Batch([two[0], two[0]])
        with self.assertRaisesRegex(ValueError, "empty"):
            t.Batch([])
        batch = t.Batch([two[0], two[0].copy()])
        poses = np.stack([path(10)] * 2)
        for word, call in (
            ("scenes, N, 4, 4", lambda: batch.run(poses[0])),
            ("number of scenes, 2", lambda: batch.run(np.stack([path(10)] * 3))),
            ("threads", lambda: batch.run(poses, threads=0)),
            ("spindle", lambda: batch.run(poses, np.ones(10, bool))),
            ("transposed", lambda: batch.run(poses.transpose(0, 1, 3, 2))),
        ):
            with self.subTest(word), self.assertRaisesRegex(ValueError, word):
                call()
        self.assertEqual(batch.run(poses)["status"].shape, (2, 10))
        self.assertEqual(batch.scenes[0].bone.shape, bone.shape)


if __name__ == "__main__":
    unittest.main()
