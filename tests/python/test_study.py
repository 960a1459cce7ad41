# SPDX-License-Identifier: MIT
"""Studies: tables in order, failed cases, files, resuming, and Dask's workers, of which one is killed."""

import os
import signal
import tempfile
import time
import unittest
import warnings
from pathlib import Path

import numpy as np
import trephine as t
from block import SPACING, block, path
from trephine import study

try:
    import distributed
except ImportError:
    distributed = None
try:
    import h5py
except ImportError:
    h5py = None

CASES = {"radius": [1.2e-3, 1.6e-3], "to": [-0.4e-3, -0.8e-3, -1.2e-3]}


def drill(radius, to, scene=None, killed=None):
    """Drills the scene that is given, which other cases must not feel. Kills its process where `killed` is no file yet."""
    if killed and to == CASES["to"][1] and not os.path.exists(killed):
        Path(killed).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    scene.tool = t.Burr(tip_radius=radius)
    ticks = scene.run(path(300, to=to))
    return {"peak": np.abs(ticks["force"]).max(), "removed": ticks["removed_mm3"].sum(), "ticks": len(ticks["force"]),
            "ok": bool((ticks["status"] == t.Status.OK).all()), "name": f"hole, {to}"}  # fmt: skip


def scene():
    return t.Scene(t.Bone(block(), SPACING), 300, t.Burr(tip_radius=1.4e-3), cut=t.GeometricCut())


def fails_at_two(x):
    if x == 2:
        raise ValueError("two is too much")
    return {"half": x / 2, "word": "odd" if x % 2 else "even"}


def noted(x, folder):
    """Leaves a file for each call."""
    Path(folder, str(x)).touch()
    return {"third": x / 3}


def bits(table):
    return {name: (column.dtype.kind, column.tobytes()) for name, column in table.items()}


class Here(unittest.TestCase):
    def test_rows_stand_in_the_order_of_the_cases(self):
        table = study.run(drill, CASES, scene=scene())
        self.assertEqual(list(table), ["radius", "to", "peak", "removed", "ticks", "ok", "name", "error"])
        np.testing.assert_array_equal(table["radius"], np.repeat(CASES["radius"], 3))
        np.testing.assert_array_equal(table["to"], np.tile(CASES["to"], 2))
        for row, (radius, to) in enumerate(zip(table["radius"], table["to"])):
            alone = drill(radius, to, scene())
            self.assertEqual(alone, {name: table[name][row] for name in alone})
        self.assertEqual([table[n].dtype.kind for n in table], list("ffffibUU"))

    def test_a_case_that_fails_is_told_and_the_others_go_on(self):
        with self.assertWarnsRegex(UserWarning, "{'x': 2}: ValueError: two is too much"):
            table = study.run(fails_at_two, [{"x": 1}, {"x": 2}, {"x": 3}])
        np.testing.assert_array_equal(table["half"], [0.5, np.nan, 1.5])
        self.assertEqual(table["word"].tolist(), ["odd", "", "odd"])
        self.assertEqual(table["error"].tolist(), ["", "ValueError: two is too much", ""])

    def test_a_file_is_resumed(self):
        for suffix in (".csv", ".h5") if h5py else (".csv",):
            with self.subTest(suffix), tempfile.TemporaryDirectory() as folder:
                out = folder + "/table" + suffix
                first = study.run(noted, {"x": [1, 4]}, folder=folder, out=out)
                self.assertEqual(first["x"].tolist(), [1, 4])
                for x in (1, 4):
                    os.remove(f"{folder}/{x}")
                both = study.run(noted, {"x": [4, 2, 1]}, folder=folder, out=out)
                self.assertEqual(sorted(os.listdir(folder)), ["2", "table" + suffix])
                self.assertEqual(bits(both), bits(study.run(noted, {"x": [4, 2, 1]}, folder=folder)))
                self.assertEqual(bits(study.load(out)), bits(both))

    def test_a_case_that_failed_is_done_again(self):
        with tempfile.TemporaryDirectory() as folder:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                study.run(fails_at_two, {"x": [2, 3]}, out=folder + "/table.csv")
            table = study.run(noted, {"x": [2, 3]}, folder=folder, out=folder + "/table.csv")
            self.assertEqual(os.path.exists(folder + "/2"), True)
            self.assertEqual(os.path.exists(folder + "/3"), False)
            self.assertEqual(table["error"].tolist(), ["", ""])

    def test_files_hold_every_bit(self):
        odd = [0.1 + 0.2, -0.0, 1e-310, np.inf, np.nan, 1 / 3]
        table = study.run(lambda x: {"text": f'a, "{x}"', "whole": 7, "flag": x > 0, "single": np.float32(x)}, {"x": odd})
        with tempfile.TemporaryDirectory() as folder:
            for name in ("table.csv", "table.h5") if h5py else ("table.csv",):
                study.save(Path(folder, name), table)
                self.assertEqual(bits(study.load(Path(folder, name))), bits(table))
                self.assertEqual(list(study.load(Path(folder, name))), list(table))
            self.assertEqual(len(os.listdir(folder)), 2 if h5py else 1)

    def test_refusals(self):
        with self.assertRaisesRegex(ValueError, r"\.csv or \.h5"):
            study.run(noted, {"x": [1]}, out="table.txt", folder=".")
        with self.assertRaisesRegex(ValueError, "every case must have the parameters"):
            study.run(noted, [{"x": 1}, {"y": 1}], folder=".")
        self.assertEqual(list(study.run(noted, [], folder=".")), ["error"])


@unittest.skipUnless(distributed, "distributed (Debian: python3-distributed) is not installed")
class Workers(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.cluster = distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None)
        cls.client = distributed.Client(cls.cluster)

    @classmethod
    def tearDownClass(cls):
        cls.client.close()
        cls.cluster.close()

    def test_workers_give_the_bits_of_one_process(self):
        with tempfile.TemporaryDirectory() as folder:
            here = study.run(drill, CASES, scene=scene())
            there = study.run(drill, CASES, scene=scene(), client=self.client, out=folder + "/table.csv")
            self.assertEqual(bits(there), bits(here))
            self.assertEqual(bits(study.load(folder + "/table.csv")), bits(here))

    def test_what_a_killed_worker_had_is_done_again(self):
        here = study.run(drill, CASES, scene=scene())
        with tempfile.TemporaryDirectory() as folder:
            before = set(self.client.run(os.getpid).values())
            there = study.run(drill, CASES, scene=scene(), killed=folder + "/killed", client=self.client)
            self.assertTrue(os.path.exists(folder + "/killed"))
            self.assertEqual(bits(there), bits(here))
            end = time.monotonic() + 30
            while len(after := set(self.client.run(os.getpid).values())) < 2 and time.monotonic() < end:
                time.sleep(0.1)
            self.assertEqual(len(before & after), 1)

    def test_a_case_that_fails_there_is_told(self):
        with self.assertWarnsRegex(UserWarning, "{'x': 2}: ValueError: two is too much"):
            table = study.run(fails_at_two, {"x": [1, 2, 3]}, client=self.client)
        self.assertEqual(table["error"].tolist(), ["", "ValueError: two is too much", ""])


if __name__ == "__main__":
    unittest.main()
