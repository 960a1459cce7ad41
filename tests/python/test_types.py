# SPDX-License-Identifier: MIT
"""The stubs, by mypy where it is installed; documents and programs of the example."""

import importlib.util
import inspect
import os
import re
import subprocess
import sys
import tempfile
import unittest

import trephine as t

GOOD = """
import numpy as np
import trephine as t

bone = t.Bone(np.zeros((4, 4, 4), np.int16), (1e-3, 1e-3, 1e-3), X_WG=np.eye(4))
options: t.CoupledOptions = t.CoupledOptions(stiffness=500)
options.stiffness = 600
scene = t.Scene(bone, 300, t.tool("round-3"), options, cut=t.GeometricCut(), limits=t.device_preset("Touch").limits)
result: t.TickResult = scene.tick([0, 0, 0, 0, 0, 0, 1], spindle=True)
outcome: bool = result.status is t.Status.OK
force: float = float(scene.run(np.zeros((3, 7)), spindle=np.ones(3, bool))["force"][0, 2])
scene.stages = t.StageOptions(law=None, damping=t.Damping(linear=1))
ticks = t.Batch([scene, scene.copy()]).run(np.zeros((2, 3, 7)), threads=2)
depth, width, breadth = bone.shape
least, greatest = bone.reader().brick_range(0)
bone.X_WG = np.eye(4)
left: int = bone.restore(3)
scan: t.Bone = t.read_volume("scan.nrrd", isovalue=300)
names: list[str] = t.read_labels("scan.seg.nrrd").names
scores = t.Scores(force_limit=2)
with t.SessionLog("session.log", flush=0.1) as log:
    scene.run(np.zeros((3, 7)), log=log, scores=scores)
    scene.tick([0, 0, 0, 0, 0, 0, 1], scores=scores)
session: t.Session = t.load_session("session.log")
mean: float = t.score(session, chord=2e-3).totals["mean_force"] + scores.strokes["length"].sum()
same: bool = scene.replay(session).different == 0 and scores.add("session.log").complete
"""
WRONG = {
    "stifness": "t.CoupledOptions(stifness=1)",
    "incompatible type": "t.CoupledOptions(stiffness='much')",
    "has no attribute": "t.Status.FINE",
    "Missing positional argument": "t.Scene(t.read_volume('a'), 300)",
    "Argument 4": "t.Scene(t.read_volume('a'), 300, t.Burr(), 5)",
}


@unittest.skipUnless(importlib.util.find_spec("mypy"), "mypy is not installed")
class Types(unittest.TestCase):
    def mypy(self, program, *options, name="program.py"):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, name)
            with open(path, "w", encoding="utf-8") as file:
                file.write(program)
            return subprocess.run(
                [sys.executable, "-m", "mypy", *options, "--cache-dir", folder + "/cache", path],
                env={**os.environ, "MYPYPATH": os.path.dirname(os.path.dirname(t.__file__))},
                capture_output=True,
                text=True,
            )

    def test_a_right_program_passes(self):
        run = self.mypy(GOOD, "--strict")
        self.assertEqual(run.returncode, 0, run.stdout + run.stderr)

    def test_the_stubs_themselves_pass(self):
        with open(os.path.join(os.path.dirname(t.__file__), "__init__.pyi"), encoding="utf-8") as file:
            run = self.mypy(file.read(), "--strict", name="stubs.pyi")
        self.assertEqual(run.returncode, 0, run.stdout + run.stderr)

    def test_the_modules_in_python_pass(self):
        package = os.path.dirname(t.__file__)
        for modules in (["--strict", "-p", "trephine.report"], ["-m", "trephine.env", "-m", "trephine.study", "-m", "trephine.hdf5"]):
            with tempfile.TemporaryDirectory() as folder:
                run = subprocess.run(
                    [sys.executable, "-m", "mypy", "--cache-dir", folder, *modules],
                    env={**os.environ, "MYPYPATH": os.path.dirname(package)},
                    capture_output=True,
                    text=True,
                )
            self.assertEqual(run.returncode, 0, run.stdout + run.stderr)

    def test_wrong_programs_do_not(self):
        run = self.mypy("import trephine as t\n" + "\n".join(WRONG.values()))
        for line, word in enumerate(WRONG, 2):
            self.assertRegex(run.stdout, f"program.py:{line}: error: .*{word}")


class Stubs(unittest.TestCase):
    def test_they_have_every_name(self):
        with open(os.path.join(os.path.dirname(t.__file__), "__init__.pyi"), encoding="utf-8") as file:
            stubs = file.read()
        for name in t.__all__:
            self.assertRegex(stubs, rf"(?m)^(class|def) {name}\b")
            for member, value in vars(getattr(t, name)).items() if inspect.isclass(getattr(t, name)) else ():
                if isinstance(value, property) and not member.startswith("_"):
                    self.assertRegex(stubs, rf"(?m)^    def {member}\(self\) ->")
        self.assertNotIn("::", stubs)

    def test_everything_has_a_docstring(self):
        for name in t.__all__:
            item = getattr(t, name)
            self.assertTrue(item.__doc__, name)
            for member, value in vars(item).items() if inspect.isclass(item) and not hasattr(item, "__members__") else ():
                if isinstance(value, property) and (name, member) != ("DeviceCapabilities", "name"):
                    self.assertTrue(value.__doc__, (name, member))


class Documents(unittest.TestCase):
    example = os.environ["TREPHINE_EXAMPLE"]

    def run_program(self, *arguments, folder):
        run = subprocess.run([sys.executable, "-B", *arguments], capture_output=True, text=True, cwd=folder)
        self.assertEqual(run.returncode, 0, run.stderr)
        return run.stdout

    def test_the_first_program_prints_what_the_readme_says(self):
        with open(self.example + "/README.md", encoding="utf-8") as file:
            text = file.read()
        program = re.search(r"```python\n(.*?)```", text, re.S)[1]
        prints = re.search(r"```text\n(.*?)```", text, re.S)[1]
        with tempfile.TemporaryDirectory() as folder:
            self.assertEqual(self.run_program("-c", program, folder=folder), prints)

    def test_the_scripts_run(self):
        with tempfile.TemporaryDirectory() as folder:
            out = self.run_program(self.example + "/press.py", "--csv", "press.csv", folder=folder)
            with open(folder + "/press.csv", encoding="utf-8") as file:
                rows = [line.split(",") for line in file.read().splitlines()]
            self.assertEqual(rows[0], ["depth_mm", "force_N"])
            depth, force = ([float(row[i]) for row in rows[1:]] for i in (0, 1))
            self.assertGreater(len(rows), 100)
            self.assertGreater(force[-1], 0.1)
            self.assertEqual(depth, sorted(depth))
            self.assertIn("N/m", out)
            out = self.run_program(self.example + "/compare_renderers.py", folder=folder)
            self.assertEqual(len(out.splitlines()), 4, out)
            self.assertNotIn("nan", out)
            out = self.run_program(self.example + "/drill_session.py", folder=folder)
            self.assertRegex(out, r"\A12 strokes with a mean of \d.\d\d N, \d+ mm3 gone\n-0.\d mm from the nerve, 1 breaches")
            self.assertEqual(t.load_session(folder + "/session.log").report.complete, True)
            self.assertTrue(os.path.getsize(folder + "/session.html") > 1e5)

    def test_the_study_runs_and_goes_on(self):
        arguments = [self.example + "/skull_study.py", "--workers", "0", "--places", "1", "--out", "holes.csv"]
        with tempfile.TemporaryDirectory() as folder:
            self.run_program(*arguments, "--feeds", "8", folder=folder)
            out = self.run_program(*arguments, "--feeds", "8", "12", folder=folder)
            with open(folder + "/holes.csv", encoding="utf-8") as file:
                names, *rows = [line.split(",") for line in file.read().splitlines()]
            self.assertEqual(names, "x,y,feed,thickness_mm,peak_N,removed_mm3,cutting_s,error".split(","))
            slow, fast = (dict(zip(names, row)) for row in rows)
            self.assertEqual((slow["feed"], fast["feed"]), ("0.008", "0.012"))
            self.assertLess(float(slow["peak_N"]), float(fast["peak_N"]))
            self.assertGreater(float(slow["cutting_s"]), float(fast["cutting_s"]))
            self.assertIn("12 mm/s: mean peak force", out)

    def test_the_learning_loop_runs(self):
        program = [self.example + "/learning_loop.py", "--generations", "2", "--population", "2", "--seconds", "1"]
        with tempfile.TemporaryDirectory() as folder:
            out = self.run_program(*program, folder=folder)
            self.assertEqual(out, self.run_program(*program, folder=folder))
        head, first, second = out.splitlines()
        self.assertIn("mean reward", head)
        self.assertNotEqual(first.split()[3:], second.split()[3:])


if __name__ == "__main__":
    unittest.main()
