# SPDX-License-Identifier: MIT
"""features.py --build FOLDER --out FOLDER [--quick]: what a scene pays for what it lists, and what it does not list.

FOLDER/bench is where bench_features was built. Counts the code of each scene's object file, looks for symbols of what a
scene does not list (and ends with 1 where it finds any), then runs bench_features, which writes features.csv."""

import argparse
import os
import re
import subprocess
import sys

# What no object file may name, and the scenes that list it.
NAMES = {
    "LineApproxRenderer": ["line_*"],
    "SurfaceApproxRenderer": ["surface_*"],
    "CoupledToolRenderer": ["coupled_*"],
    "BoneSurface": ["coupled_*"],
    "Coulomb": ["friction"],
    "TorqueOnly": ["shaft_torque", "shaft_torque_force_only"],
    "ForceOnly": ["force_only", "shaft_torque_force_only", "translation"],
    "Milling": ["carving", "all_stages"],
    "SphereCutter": ["carving", "all_stages"],
    "DrillCutter": [],
    "MillingVibration": ["vibration", "all_stages"],
    "HuntCrossley": ["hunt_crossley", "all_stages"],
    "Damping": ["damping", "all_stages"],
    "FirstOrderFilter": ["filter", "all_stages"],
    "PassivityController": ["passivity", "all_stages"],
    "WrenchRateLimit": ["rate_limit", "all_stages"],
    "DeviceLimits": ["limits", "all_stages"],
    "EmptySpaceSkipping": ["skip_far"],
    "ClearanceMap": ["skip_far"],
    "GridReader": ["skip_far"],
    "Remote": [],
    "ServoLoop": ["loop", "recorder"],
    "Recorder": ["recorder"],
    "SimulatedDevice": [],
}


def lists(scene, owners):
    renderer, name = scene.split("_", 1)
    return name in owners or renderer + "_*" in owners


def output(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def text_bytes(path):
    """The sections of code alone, without tables for exceptions and constants, and without the study's own: how a scene
    is registered."""
    sections = sum(int(line.split()[1]) for line in output("size", "-A", path).splitlines() if line.startswith(".text"))
    own = sum(int(line.split()[1], 16) for line in output("nm", "-S", path).splitlines() if "_GLOBAL__sub_I" in line)
    return sections - own


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--build", required=True)
    parser.add_argument("--out", required=True)
    parser.add_argument("--quick", action="store_true")
    arguments = parser.parse_args()
    folder = os.path.join(arguments.build, "bench")
    with open(os.path.join(folder, "features", "objects.txt"), encoding="utf-8") as file:
        objects = [line.strip() for line in file if "/features/" in line]

    found = 0
    text = os.path.join(folder, "features", "text_bytes.txt")
    with open(text, "w", encoding="utf-8") as file:
        for path in objects:
            scene = os.path.basename(path).split(".")[0]
            file.write(f"{scene} {text_bytes(path)}\n")
            symbols = output("nm", "-C", path)
            for name, owners in NAMES.items():
                there = re.search(rf"trephine::(detail::)?{name}[<:( ,>]", symbols) is not None
                if there and not lists(scene, owners):
                    print(f"features: {scene} does not list {name}, but its object file names it", file=sys.stderr)
                    found += 1
                if not there and name in ("Milling", "Damping", "Coulomb", "ServoLoop") and lists(scene, owners):
                    print(f"features: {scene} lists {name}, which this check does not see", file=sys.stderr)
                    found += 1
    print(f"features: {len(objects)} scenes, {len(NAMES)} names each: {found} found where they are not listed", file=sys.stderr)
    program = os.path.join(folder, "bench_features")
    subprocess.run([program, "--out", arguments.out, "--text", text] + (["--quick"] if arguments.quick else []), check=True)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
