# SPDX-License-Identifier: MIT
"""Environments: Gymnasium's rules, bits by seed, measures by brute force, and gates that scripted policies pass."""

import inspect
import unittest

import numpy as np
import trephine as t
from trephine import _phantoms, env


def straight(*direction, spindle=1.0):
    """A policy that goes one way at full speed, whatever is there."""
    return lambda observation: np.array([*direction, 0, 0, 0, spindle], np.float32)


def drive(drill, policy, steps, seed=3):
    """Observations, rewards and last info of so many steps."""
    observation, info = drill.reset(seed=seed)
    made = [(observation, 0.0)]
    for _ in range(steps):
        observation, reward, terminated, truncated, info = drill.step(policy(observation))
        made.append((observation, reward))
    return np.array([o for o, _ in made]), np.array([r for _, r in made]), info


class Rules(unittest.TestCase):
    """What Gymnasium asks of an environment; its own check_env passes too, where it is installed."""

    def test_signatures_and_types(self):
        parameters = inspect.signature(env.DrillEnv.reset).parameters
        self.assertEqual({n: p.default for n, p in parameters.items() if n != "self"}, {"seed": None, "options": None})
        self.assertEqual(parameters["seed"].kind, inspect.Parameter.KEYWORD_ONLY)
        for task, patch in (("crown", 0), ("mastoid", 5)):
            drill = env.DrillEnv(task, patch=patch)
            space = drill.observation_space
            self.assertEqual(space.shape, (15 + len(drill.task.names) + patch**3,))
            self.assertEqual((drill.action_space.shape, drill.action_space.dtype), ((7,), np.float32))
            self.assertTrue(np.isfinite(space.low).all() and np.isfinite(space.high).all())
            result = drill.reset(seed=1)
            self.assertEqual((type(result), len(result), type(result[1])), (tuple, 2, dict))
            self.assertTrue(result[0] in space)
            drill.action_space.seed(1)
            for _ in range(40):
                observation, reward, terminated, truncated, info = drill.step(drill.action_space.sample())
                self.assertTrue(observation in space, observation)
                self.assertEqual([type(x) for x in (reward, terminated, truncated, info)], [float, bool, bool, dict])
            self.assertEqual(info["gates"].keys(), drill.task.gates.keys())
            self.assertIsNone(drill.render())
            drill.close()
        with self.assertRaisesRegex(ValueError, "crown, mastoid"):
            env.DrillEnv("hip")

    def test_a_seed_gives_the_same_bits(self):
        for task in env.TASKS:
            drill = env.DrillEnv(task)
            first = drive(drill, straight(0.3, 0, -1), 60)
            again = drive(drill, straight(0.3, 0, -1), 60)  # on the bone that was drilled and restored
            fresh = drive(env.DrillEnv(task), straight(0.3, 0, -1), 60)
            other = drive(drill, straight(0.3, 0, -1), 60, seed=4)
            self.assertGreater(np.abs(first[0][:, 6:9]).max(), 0.1)
            for run in (again, fresh):
                self.assertEqual(run[0].tobytes(), first[0].tobytes())
                self.assertEqual(run[1].tobytes(), first[1].tobytes())
            self.assertNotEqual(other[0].tobytes(), first[0].tobytes())

    def test_the_space_of_our_own(self):
        box = env.Box(-np.ones(3), np.array([1, 2, 3]))
        box.seed(5)
        drawn = np.array([box.sample() for _ in range(200)])
        box.seed(5)
        self.assertEqual(box.sample().tobytes(), drawn[0].tobytes())
        self.assertTrue(all(x in box for x in drawn) and (drawn.max(axis=0) > [0.9, 1.8, 2.7]).all())
        for wrong in (np.ones(3), np.ones(2, np.float32), np.array([0, 0, 4], np.float32), [0, 0, 0]):
            self.assertFalse(wrong in box)


class Measures(unittest.TestCase):
    def test_the_tool_moves_as_the_action_says(self):
        drill = env.DrillEnv("crown", substeps=25)
        start, _ = drill.reset(seed=1)
        step = 0.025 * env.DrillEnv.MOST_SPEED * 1e3  # mm
        for n in range(1, 11):
            observation, *_ = drill.step(np.array([0.5, -0.25, 1, 1, 0, 0, -1], np.float32))
            np.testing.assert_allclose(observation[:3] - start[:3], n * step * np.array([0.5, -0.25, 1]), atol=1e-4)
            angle = n * 0.025 * env.DrillEnv.MOST_TURN
            np.testing.assert_allclose(observation[3:6], [0, -np.sin(angle), np.cos(angle)], atol=1e-6)
        z = np.array([0, 0, 0, 0, 0, 1, -1], np.float32)
        turned = drill.step(z)[0][3:6]
        half = 0.025 * env.DrillEnv.MOST_TURN
        expected = [np.sin(half) * np.sin(angle), -np.cos(half) * np.sin(angle), np.cos(angle)]
        np.testing.assert_allclose(turned, expected, atol=1e-6)  # about W's z
        far = drive(drill, straight(1, 1, 1, spindle=-1), 400)[0]
        self.assertTrue((far[-1] == far[-2]).all())  # at the border of its room

    def test_distances_are_the_formulas(self):
        drill = env.DrillEnv("mastoid")
        for start in ((-3e-3, 1e-3, 3.7e-3), (3e-3, 2e-3, 3e-3)):
            observation, _ = drill.reset(options={"start": start})
            exact = _phantoms.temporal_distances([start])[0] - 2.5e-3
            np.testing.assert_allclose(observation[15:22], np.minimum(1e3 * exact, 10), atol=0.06)

    def test_shares_are_those_of_the_voxels(self):
        for task, steps in (("crown", 45), ("mastoid", 100)):
            drill = env.DrillEnv(task)
            observations, rewards, info = drive(drill, straight(0.1, 0.05, -0.3), steps)
            before, after = (v >= drill.task.isovalue for v in (drill.task.voxels, drill.bone.voxels()))
            gone = before & ~after
            plan = drill.task.planned
            right, wrong, planned = (gone & plan).sum(), (gone & ~plan).sum(), plan.sum()
            self.assertGreater(right, 100)
            np.testing.assert_allclose(observations[-1][13:15], [right / planned, wrong / planned], rtol=1e-6)
            self.assertFalse(info["breach"])
            self.assertAlmostEqual(rewards.sum(), (100 * right - 50 * wrong) / planned - 0.01 * steps, places=9)
            if task == "crown":
                self.assertAlmostEqual(info["gates"]["overlap"], 2 * right / (planned + right + wrong))
            else:
                nerve = drill.task.distances[drill.task.names.index("facial nerve")][gone].min()
                self.assertAlmostEqual(info["gates"]["cover_mm"], 1e3 * (nerve - drill.task.spacing / 2), places=5)
            self.assertFalse((drill.task.planned & ~before).any())

    def test_the_patch_is_the_bone_round_the_tip(self):
        drill = env.DrillEnv("mastoid", patch=9)
        for start in ((-0.1e-3, 0.3e-3, 2.7e-3), (-18e-3, 0, 8e-3)):
            patch = drill.reset(options={"start": start})[0][-(9**3) :].reshape(9, 9, 9)
            centre = np.round((np.array(start) - drill.task.X_WG[:3, 3]) / drill.task.spacing).astype(int)
            for k, j, i in np.ndindex(9, 9, 9):
                x, y, z = centre + 2 * np.array([i - 4, j - 4, k - 4])
                inside = all(0 <= a < n for a, n in zip((z, y, x), drill.task.voxels.shape))
                density = drill.task.voxels[z, y, x] if inside else drill.task.voxels.min()
                self.assertAlmostEqual(patch[k, j, i], density / drill.task.isovalue - 1, places=5)

    def test_the_picture_has_bone_plan_and_tool(self):
        drill = env.DrillEnv("crown", render_mode="rgb_array")
        drill.reset(seed=1, options={"start": (0, 0, 6.8e-3)})
        picture = drill.render()
        self.assertEqual((picture.shape, picture.dtype), ((51, 89, 3), np.uint8))
        self.assertEqual(picture[-1, 35].tolist(), [200, 200, 200] if drill.task.voxels[0, 33, 35] > 85 else [20, 20, 20])
        blue = np.argwhere((picture == [90, 140, 250]).all(axis=2))
        self.assertAlmostEqual(blue[:, 1].mean(), 35, delta=0.5)  # x = 0
        self.assertLess(blue[:, 0].max(), 8)  # at the top

    def test_time_runs_out(self):
        drill = env.DrillEnv("crown", seconds=0.1)
        drill.reset(seed=1)
        self.assertEqual([drill.step(np.zeros(7))[2:4] for _ in range(5)], [(False, False)] * 4 + [(False, True)])


class Gates(unittest.TestCase):
    def test_scripted_policies_pass(self):
        for task in env.TASKS:
            for seed in (1,):
                with self.subTest(task, seed=seed):
                    drill = env.DrillEnv(task)
                    total, info = env.play(drill, env.scripted(task), seed)
                    self.assertTrue(all(info["passed"].values()), info)
                    self.assertGreater(total, 50)

    def test_a_greedy_policy_breaches(self):
        """It drills straight to the middle, and to the nerve."""
        for task, start, found in (("crown", (0, 0, 8e-3), "pulp"), ("mastoid", (0, -2e-3, 5e-3), "facial nerve")):
            drill = env.DrillEnv(task)
            drill.reset(seed=1, options={"start": start})
            for n in range(400):
                _, reward, terminated, truncated, info = drill.step(straight(0, 0, -0.4)(None))
                if terminated:
                    break
            self.assertEqual((terminated, truncated, info["breach"]), (True, False, found))
            self.assertEqual((info["gates"]["breaches"], info["passed"]["breaches"]), (1, False))
            self.assertLess(reward, -9)
            if task == "crown":
                self.assertGreater(info["gates"]["pulp_mm3"], 0)
                self.assertFalse(info["passed"]["pulp_mm3"])

    def test_the_neighbour_and_the_force_have_gates(self):
        drill = env.DrillEnv("crown")
        drill.reset(seed=1, options={"start": (5.2e-3, -7e-3, 3.2e-3)})
        for n in range(400):
            *_, terminated, _, info = drill.step(straight(0.2, 0.4, 0)(None))
            if terminated:
                break
        self.assertEqual(info["breach"], "neighbour")
        self.assertFalse(info["passed"]["neighbour_mm3"])
        _, rewards, info = drive(drill, straight(0, 0, -1, spindle=-1), 40)
        self.assertFalse(info["passed"]["peak_force_N"])
        self.assertLess(rewards[-1], -0.1)
        self.assertFalse(info["breach"])

    def test_a_turning_tool_in_a_structure_breaches_without_a_cut(self):
        drill = env.DrillEnv("mastoid")
        for spindle, found in ((-1, ""), (1, "ear canal")):
            drill.reset(seed=1, options={"start": (9.5e-3, -0.2e-3, -2e-3)})
            _, _, terminated, _, info = drill.step(straight(0, 0, 0, spindle=spindle)(None))
            self.assertEqual((info["breach"], terminated), (found, bool(found)))

    def test_plans_keep_away_from_structures(self):
        crown, mastoid = env.TASKS["crown"](), env.TASKS["mastoid"]()
        self.assertGreater(crown.distances[0][crown.planned].min(), 1e-3)  # pulp
        self.assertGreater(mastoid.distances[:, mastoid.planned].min(), 1.4e-3)
        for task, least, most in ((crown, 120, 260), (mastoid, 500, 1500)):
            self.assertTrue(least < task.planned.sum() * (1e3 * task.spacing) ** 3 < most)
        self.assertEqual(t.Status.OK, 0)


if __name__ == "__main__":
    unittest.main()
