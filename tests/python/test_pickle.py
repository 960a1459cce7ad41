# SPDX-License-Identifier: MIT
"""Pickles: every class of the module comes back with the same bits, also in another process."""

import inspect
import multiprocessing
import pickle
import tempfile
import unittest

import numpy as np
import trephine as t
from block import SPACING, TOP, block, path
from test_scene import KINDS, same, scene_of

# Classes that stay where they are, and why.
AT_HOME = {
    "BoneReader": "it watches a bone of this process",
    "Protection": "it is made for one scene object",
    "SessionLog": "it writes a file of this process",
    "Scores": "they are computed again from the file",
    "Session": "its file travels",
    "SessionReport": "it is of a session",
    "FollowedBone": "likewise",
}


def labels():
    made = np.zeros(block().shape, np.uint8)
    made[4:9, 10:16, 12:20] = 1
    return made


def guarded(bone):
    scene = scene_of("coupled", bone)
    each = [t.ProtectedStructure(veto=t.StructureVeto(mode=t.VetoMode.WATCH), guard=t.GuardedStructure(margin=1e-3))]
    options = t.ProtectionOptions(guard=t.GuardOptions(push=False))
    scene.set_structures(t.Structures(labels(), SPACING, reach=5e-3), each, options)
    return scene


def drilled(keep_original=True, dtype=np.int16):
    X_WG = np.eye(4)
    X_WG[:3, 3] = 1e-3, -2e-3, 3e-3
    bone = t.Bone(block(dtype), SPACING, X_WG=X_WG, keep_original=keep_original)
    t.Scene(bone, 60, t.Burr(tip_radius=1.6e-3), cut=t.GeometricCut()).run(X_WG @ path(300))
    return bone


def scenes():
    """A scene of each kind that travels, on a bone that has been drilled."""
    made = {kind: scene_of(kind, drilled()) for kind in KINDS}
    made["structures"] = guarded(drilled())
    return made


def instances():
    """One or more of each class, by its name."""
    scene = guarded(t.Bone(block(), SPACING))
    recording = scene.record(path(300))
    tick = scene.tick(path(300)[-1])
    law = scene_of("law", t.Bone(block(), SPACING))
    law.run(path(300))
    made = {
        "Batch": [t.Batch([scene_of("line", drilled()), guarded(drilled())])],
        "Bone": [drilled(), drilled(False), t.Bone(block(), 1e-3, outside=-3)]
        + [drilled(dtype=d) for d in (np.uint8, np.int8, np.uint16, np.float32)],
        "ContactSummary": [tick.contact],
        "Coulomb": [t.Coulomb(0.4, 0.1)],
        "CuttingSummary": [law.tick(path(300)[-1]).cutting],
        "Labels": [t.Labels(labels(), np.array(SPACING), np.eye(4), ["nerve"])],
        "Mesh": [scene.bone.mesh(300), t.Bone(block() * 0, SPACING).mesh(300)],
        "NamedTool": [t.tool("match-head-3")],
        "Recording": [recording],
        "ReplayReport": [scene.copy().replay(recording), guarded(t.Bone(block() // 2, SPACING)).replay(recording)],
        "Scene": list(scenes().values()),
        "Status": list(t.Status),
        "StructureSummary": [tick.structures],
        "StructureTotals": [scene.totals(0)],
        "Structures": [t.Structures(labels(), SPACING, X_GS=drilled().X_WG, reach=5e-3, smooth=False)],
        "TickResult": [tick, law.tick(path(300)[0])],
        "VolumeError": [t.VolumeError("a.nrrd: is empty")],
    }
    for name in t.__all__:
        cls = getattr(t, name)
        if not inspect.isclass(cls) or name in made:
            continue
        if hasattr(cls, "__members__"):
            made[name] = list(cls.__members__.values())
        elif isinstance(getattr(cls, "_fields", None), tuple):
            given = {"linear": 900.0, "angular": 0.4} if cls is t.StiffnessBudget else {}
            made[name] = [cls(**given), changed(cls(**given))]
    return made


def changed(options):
    """The same with every number another, and an option where there is none."""
    for field in options._fields:
        value = getattr(options, field)
        if isinstance(value, float) and np.isfinite(value):
            setattr(options, field, 1.01 * value)
        elif hasattr(value, "_fields"):
            setattr(options, field, changed(value))
    for field, cls in {"friction": t.Coulomb, "budget": None, "damping": t.Damping, "law": t.CuttingForceOptions}.items():
        if field in options._fields and getattr(options, field) is None:
            setattr(options, field, cls() if cls else t.StiffnessBudget(linear=900, angular=0.4))
    return options


def content(x):
    """All that is in an object, in Python's own types."""
    if isinstance(x, np.ndarray):
        return (str(x.dtype), x.shape, x.tobytes())
    if isinstance(x, dict):
        return {k: content(v) for k, v in x.items()}
    if isinstance(x, (tuple, list)):
        return [type(x).__name__, *map(content, x)]
    if type(x).__module__ == "trephine" and not isinstance(x, (int, Exception)):
        return [type(x).__name__, content(x.__getstate__())]
    return repr(x)


def run(scene):
    """What a scene does, and what is left of its bone; then what `restore` brings back."""
    ticks = scene.run(scene.bone.X_WG @ path(400, to=-1.5e-3))
    left = scene.bone.voxels()
    scene.bone.restore()
    return ticks, left, scene.bone.voxels()


class RoundTrips(unittest.TestCase):
    def test_every_class_comes_back(self):
        made = instances()
        classes = {name for name in t.__all__ if inspect.isclass(getattr(t, name))}
        self.assertEqual(classes - made.keys() - AT_HOME.keys(), set(), "a class without a round trip")
        for name, objects in made.items():
            for x in objects:
                with self.subTest(name):
                    self.assertIs(type(x), getattr(t, name))
                    back = pickle.loads(pickle.dumps(x))
                    self.assertIs(type(back), type(x))
                    self.assertEqual(content(back), content(x))
                    for member, value in vars(type(x)).items():
                        if isinstance(value, property) and not hasattr(type(x), "__members__"):
                            self.assertEqual(content(getattr(back, member)), content(getattr(x, member)), member)

    def test_those_that_stay_say_so(self):
        scene = guarded(t.Bone(block(), SPACING))
        with tempfile.TemporaryDirectory() as folder:
            with t.SessionLog(folder + "/log") as log:
                log.follow(scene.bone, 300)
                scene.run(np.tile(np.eye(4), (3, 1, 1)), log=log)
            session = t.load_session(folder + "/log")
        stay = (scene.bone.reader(), scene.make_protection(), log, t.Scores(), session, session.report, session.bone)
        self.assertEqual([type(x).__name__ for x in stay], list(AT_HOME))
        for x in stay:
            with self.assertRaisesRegex(TypeError, "cannot pickle"):
                pickle.dumps(x)

    def test_a_drilled_bone_restores_to_its_original(self):
        for bone in (drilled(), pickle.loads(pickle.dumps(drilled()))):
            back = pickle.loads(pickle.dumps(bone))
            np.testing.assert_array_equal(back.voxels(), drilled().voxels())
            self.assertTrue((back.voxels() < block()).any())
            self.assertEqual(back.restore(), 0)
            np.testing.assert_array_equal(back.voxels(), block())
        with self.assertRaisesRegex(ValueError, "keep_original"):
            pickle.loads(pickle.dumps(drilled(False))).restore()

    def test_scenes_of_one_bone_still_share_it(self):
        bone = t.Bone(block(), SPACING)
        one, two, alone = pickle.loads(pickle.dumps([scene_of("coupled", bone), scene_of("line", bone), bone]))
        self.assertIs(one.bone, two.bone)
        self.assertIs(one.bone, alone)

    def test_contact_begins_anew(self):
        scene = scene_of("coupled", t.Bone(block(), SPACING))
        scene.run(path(400), False)
        back = pickle.loads(pickle.dumps(scene))
        self.assertEqual(back.tick(path(400)[0], False).contact.count, 0)
        self.assertLess(abs(back.proxy_pose[2, 3] - path(400)[0, 2, 3]), 1e-12)
        self.assertGreater(TOP, 0)

    def test_options_travel_as_they_are(self):
        options = t.CoupledOptions()
        options.stiffness = -1  # which a Scene refuses, and so may one over there
        self.assertEqual(pickle.loads(pickle.dumps(options)).stiffness, -1)
        state = t.CoupledOptions(force=5).__getstate__()
        del state["stiffness"]  # as a version without it would write
        made = t.CoupledOptions.__new__(t.CoupledOptions)
        made.__setstate__(state)
        self.assertEqual((made.force, made.stiffness), (5, t.CoupledOptions().stiffness))


class Workers(unittest.TestCase):
    def test_a_spawned_process_gets_the_same_bits(self):
        here = {kind: run(scene) for kind, scene in scenes().items()}
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            there = dict(zip(here, pool.map(run, scenes().values())))
        for kind, (ticks, left, original) in here.items():
            with self.subTest(kind):
                self.assertTrue(same(ticks, there[kind][0]))
                self.assertGreater(ticks["removed_mm3"].sum(), 0)
                np.testing.assert_array_equal(left, there[kind][1])
                np.testing.assert_array_equal(original, there[kind][2])
                np.testing.assert_array_equal(original, block())


if __name__ == "__main__":
    unittest.main()
