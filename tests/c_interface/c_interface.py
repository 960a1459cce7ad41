# SPDX-License-Identifier: MIT
"""The C interface through ctypes: c_interface.py folder-of-trephine_c.py library"""

import array
import ctypes
import math
import os
import subprocess
import sys
import threading

folder, path = sys.argv[1:]
sys.path.insert(0, folder)
import trephine_c as t  # noqa: E402

library = t.Library(path)
side = 40
hounsfield = array.array("h", [1200] * (side**3 // 2) + [-1000] * (side**3 // 2))
spacing = (0.5e-3,) * 3
surface = (19 + 900 / 2200) * 0.5e-3


def refused(code, word, call):
    try:
        call()
    except t.Error as error:
        assert error.code == code and word in str(error), (error.code, str(error))
    else:
        raise AssertionError(f"not refused: {word}")


for algorithm, radius in ((t.LINE, 0), (t.SURFACE, 1.5e-3), (t.COUPLED, 1.5e-3)):
    bone = t.Grid(library, (side,) * 3, spacing, hounsfield)
    scene = t.Scene(bone, algorithm=algorithm, isovalue=300, force_limit=2.5)
    reader = t.Reader(bone)
    assert reader.bricks == (5, 5, 5) and sorted(reader.changed()) == list(range(125))

    # A mesher's thread follows while this one drills; ctypes lets go of Python's lock for each call.
    seen, done = {}, threading.Event()

    def follow():
        while True:
            last = done.is_set()
            for brick in reader.changed():
                seen[brick] = reader.copy(brick)
            if last:
                return

    mesher = threading.Thread(target=follow)
    mesher.start()
    for tick in range(600):
        pose = t.Pose((10e-3, 10e-3, surface + radius + 2e-4 - 3e-6 * tick))
        result = scene.tick(pose, tick >= 300, 1e-3)
        assert result.status == t.STATUS_OK, result.status
        assert math.hypot(*result.force) <= 2.5
        if tick == 299:
            assert result.tip and result.force[2] > 0.3, result.force[2]
            assert result.removed_total_mm3 == 0
    done.set()
    mesher.join()
    assert result.removed_total_mm3 > 1
    assert 0 < len(seen) < 125
    for brick, voxels in seen.items():
        assert reader.copy(brick) == voxels, brick
    bone.restore()
    assert reader.changed()
    assert all(max(reader.copy(b)) <= 1200 for b in range(125))
    del bone  # the scene keeps it alive
    assert scene.tick(t.Pose((10e-3, 10e-3, 18e-3)), False, 1e-3).contacts == 0

bone = t.Grid(library, (side,) * 3, spacing, hounsfield)
refused(2, "isovalue", lambda: t.Scene(bone))
refused(2, "bytes", lambda: t.Grid(library, (side,) * 3, spacing, hounsfield[1:]))
refused(2, "spacing", lambda: t.Grid(library, (side,) * 3, (math.nan, 1, 1), hounsfield))
refused(3, "struct_size", lambda: t.Scene(bone, isovalue=300, struct_size=20))
refused(1, "null", lambda: library.scene_reset(None))
scene = t.Scene(bone, isovalue=300)
result = scene.tick(t.Pose((math.nan, 0, 0)), True, 1e-3)
assert result.status == t.STATUS_BAD_INPUT and list(result.force) == [0, 0, 0]

# Tools by name.
bone = t.Grid(library, (side,) * 3, spacing, hounsfield)
refused(2, "twist-1 to 6", lambda: t.Scene(bone, algorithm=t.COUPLED, isovalue=300, tool_name="nail-3"))
for algorithm, name in ((t.LINE, "Line"), (t.SURFACE, "Surface"), (t.COUPLED, "Coupled")):
    for stiffness in (-1, math.nan, math.inf):
        refused(2, name, lambda: t.Scene(bone, algorithm=algorithm, isovalue=300, stiffness=stiffness))
refused(2, "take a Burr", lambda: t.Scene(bone, algorithm=t.LINE, isovalue=300, tool_name="disc-6"))
scene = t.Scene(bone, algorithm=t.COUPLED, isovalue=300, tool_name="disc-6")
for tick in range(300):
    result = scene.tick(t.Pose((10e-3, 10e-3, surface + 3e-3 + 1e-4 - 3e-6 * tick)), True, 1e-3)
disc = result.removed_total_mm3
assert 0.9 < disc / (math.pi * 9 * 0.8) < 1.2, disc  # mm3 of a flat hole
scene.set_tool("twist-2")
refused(2, "twist-1 to 6", lambda: scene.set_tool("twist"))
result = scene.tick(t.Pose((10e-3, 10e-3, surface + 3e-3)), True, 1e-3)
assert result.removed_total_mm3 == disc and result.contacts == 0

# Milling by the law of cutting: a drill at 1000 turns a minute, of whose thrust the device gets a sixtieth.
bone = t.Grid(library, (side,) * 3, spacing, hounsfield)
refused(2, "TREPHINE_COUPLED", lambda: t.Scene(bone, algorithm=t.LINE, isovalue=300, milling=t.MILL_BY_LAW))
refused(2, "force_scale", lambda: t.Scene(bone, algorithm=t.COUPLED, isovalue=300, milling=t.MILL_BY_LAW, force_scale=0))
scene = t.Scene(bone, algorithm=t.COUPLED, isovalue=300, milling=t.MILL_BY_LAW, tool_name="twist-3.2",
                spindle_speed=t.rpm(1000), force_scale=1 / 60, cortical_density=1200, stiffness=2000)
for tick in range(2000):
    result = scene.tick(t.Pose((10e-3, 10e-3, surface + 1.7e-3 - 2e-6 * tick)), True, 1e-3)
assert 50 < result.thrust < 200 and abs(60 * result.force[2] / result.thrust - 1) < 0.05, result.thrust
assert 0.02 < result.spindle_torque < 0.2, result.spindle_torque
assert abs(result.spindle_speed - t.rpm(1000)) < 1e-9 and abs(result.feed - 2e-3) < 0.6e-3, result.feed
plain = t.Scene(bone, algorithm=t.COUPLED, isovalue=300)
assert plain.tick(t.Pose((10e-3, 10e-3, surface + 1e-3)), True, 1e-3).thrust == 0

# Structures: a box that must stay, and one that may break.
labels = bytearray(side**3)
for k in range(9, 18):
    for j in range(16, 25):
        for i in range(16, 25):
            labels[(k * side + j) * side + i] = 1 if k < 13 else 2 if k > 13 and i > 21 else 0
structures = t.Structures(library, (side,) * 3, spacing, labels)
assert structures.count == 2
structures.set(0, stiffness=500, veto_margin=0.3e-3)
structures.set(1, guard=t.GUARD_WARN, veto=t.VETO_WATCH)
refused(2, "no structure 2", lambda: structures.set(2))
refused(2, "veto", lambda: structures.set(1, veto=7))
assert structures.name(0) == "structure 1"
structures.set_name(0, "nervus facialis, rechts \u00df")
assert structures.name(0) == "nervus facialis, rechts \u00df"
refused(2, "one line", lambda: structures.set_name(0, ""))
refused(2, "reach", lambda: t.Structures(library, (side,) * 3, spacing, labels, reach=0))
bone = t.Grid(library, (side,) * 3, spacing, hounsfield)
scene = t.Scene(bone, algorithm=t.COUPLED, isovalue=300)
assert scene.tick(t.Pose((10e-3, 10e-3, 15e-3)), False, 1e-3).nearest == -1
scene.set_structures(structures)
pushes, refused_mm3, taken_mm3 = [], 0, 0
for tick in range(1000):
    result = scene.tick(t.Pose((10e-3, 10e-3, 13e-3 - 5.5e-6 * tick)), True, 1e-3)
    pushes.append(result.push_force[2])
    refused_mm3 += result.refused_mm3
    taken_mm3 += result.taken_mm3
assert result.nearest == 1 and result.warns and -1e-3 < result.distance < 0, result.distance
assert max(pushes) > 0.2 and refused_mm3 > 0 and taken_mm3 > 0, (max(pushes), refused_mm3, taken_mm3)
totals = [scene.totals(s) for s in range(2)]
assert abs(totals[0].refused_mm3 - refused_mm3) < 1e-9 and abs(totals[1].taken_mm3 - taken_mm3) < 1e-9
assert totals[1].breaches == 1 and totals[1].refused_mm3 == 0, totals[1].breaches
# Labels as they are, a guard with a budget, made on a thread while the scene ticks.
raw = t.Structures(library, (side,) * 3, spacing, labels, raw=True)
raw.set(0, stiffness=500)
refused(2, "smoothing", lambda: (raw.set_guard(smoothing=-1), t.Protection(scene, raw)))
raw.set_guard(ramp_time=0.01, linear_budget=20, angular_budget=0.01)
made = []
builder = threading.Thread(target=lambda: made.append(t.Protection(scene, raw)))
builder.start()
while builder.is_alive():
    scene.tick(t.Pose((10e-3, 10e-3, 7.5e-3)), True, 1e-3)
scene.exchange(made[0])
for tick in range(20):
    result = scene.tick(t.Pose((10e-3, 10e-3, 7.5e-3)), True, 1e-3)
assert 0 < result.push_force[2] < 0.1, result.push_force[2]
assert made[0].totals(1).breaches == 1 and scene.totals(0).refused_mm3 < refused_mm3
scene.exchange(made[0])
scene.set_push(False)
for tick in range(300):
    result = scene.tick(t.Pose((10e-3, 10e-3, 7.5e-3)), True, 1e-3)
assert result.push_force[2] == 0 and result.nearest == 1
scene.set_structures(None)
assert scene.tick(t.Pose((10e-3, 10e-3, 7.5e-3)), True, 1e-3).nearest == -1

# Modules of older and newer headers than the library's.
size = t.SceneOptions.rotational_stiffness.offset
made = t.SceneOptions(rotational_stiffness=-1)
library.scene_options_init(ctypes.byref(made), size)
assert made.struct_size == size and made.rotational_stiffness == -1 and made.stiffness > 0
made.isovalue = 300
made.algorithm = t.COUPLED
handle = ctypes.c_void_p()
library.scene_create(bone.handle, ctypes.byref(made), ctypes.byref(handle))
library.scene_destroy(handle)
too_new = ctypes.sizeof(t.SceneOptions) + 8
refused(3, "not older than the header", lambda: library.scene_options_init(ctypes.byref(made), too_new))
made.struct_size = too_new
refused(3, "not older than the header", lambda: library.scene_create(bone.handle, ctypes.byref(made), ctypes.byref(handle)))

# The module as the program that a newcomer runs.
out = subprocess.run([sys.executable, folder + "/trephine_c.py", path], capture_output=True, text=True, check=True).stdout
assert out.count("mm3") == 10 and "nan" not in out, out
# Started beside the library, as in a build folder.
beside, name = os.path.split(os.path.abspath(path))
subprocess.run([sys.executable, os.path.abspath(folder) + "/trephine_c.py", name], cwd=beside, capture_output=True, check=True)
# What is no library, or another one: one line and a failure.
other = getattr(__import__("_ctypes"), "__file__", None)  # none where it is built in
for wrong in filter(None, ("/nonexistent.so", __file__, other)):
    run = subprocess.run([sys.executable, folder + "/trephine_c.py", wrong], capture_output=True, text=True)
    assert run.returncode == 1 and run.stderr.count("\n") == 1, run.stderr
    assert run.stderr.startswith("trephine_c.py: ") and wrong in run.stderr, run.stderr
print("the C interface works from Python")
