# SPDX-License-Identifier: MIT
"""compile_cost.py --build FOLDER --out FOLDER: what compiling costs.

Writes compile_cost.csv: processor seconds and peak memory of a minimal program (-O2 -c) against a renderer's own header
and against everything.hpp, by g++ and clang++; and by a g++ that collects garbage more often than at doubled memory."""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), os.pardir, "common"))
import results

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))
INCLUDE = os.path.join(ROOT, "include")

PROGRAM = """trephine::TickResult tick(trephine::VoxelGrid<std::uint8_t>& bone, const trephine::TickInput& input);
trephine::TickResult tick(trephine::VoxelGrid<std::uint8_t>& bone, const trephine::TickInput& input) {
  using namespace trephine;
  HapticScene scene{bone, 100, @renderer@};
  return scene.tick(input, 1e-3);
}
"""
COMPILED = """trephine::TickResult tick(const trephine::compiled::Bone& bone, const trephine::TickInput& input);
trephine::TickResult tick(const trephine::compiled::Bone& bone, const trephine::TickInput& input) {
  return trephine::compiled::Scene(bone, 100, trephine::Burr{}).tick(input, 1e-3);
}
"""
SCENES = {
    "line": ("render/line/line_approx_renderer.hpp", "LineApproxRenderer{ToolDiscretization{Burr{}, LineCounts{}}}"),
    "surface": ("render/surface/surface_approx_renderer.hpp", "SurfaceApproxRenderer{ToolDiscretization{Burr{}, SurfaceCounts::thesis()}}"),
    "coupled": ("render/coupled/coupled_tool_renderer.hpp", "CoupledToolRenderer{Burr{}}"),
}


def includes(*headers):
    return "".join(f"#include <{h}>\n" for h in headers)


def programs():
    """(what, header, source)"""
    yield "program", "none", "int main() {}\n"
    yield "program", "Eigen/Core and Geometry", includes("Eigen/Core", "Eigen/Geometry") + "int main() {}\n"
    for name, (header, renderer) in SCENES.items():
        body = PROGRAM.replace("@renderer@", renderer)
        yield f"{name} scene", "its own headers", includes(f"trephine/{header}", "trephine/stage/haptic_scene.hpp") + body
        yield f"{name} scene", "everything.hpp", includes("trephine/everything.hpp") + body
    yield "compiled scene", "compiled/scene.hpp", includes("trephine/compiled/scene.hpp") + COMPILED


def cost(command):
    """Processor seconds and peak memory [MB] of a command, of which the compiler proper is a child."""
    script = ("import resource, subprocess, sys\n"
              "code = subprocess.run(sys.argv[1:]).returncode\n"
              "used = resource.getrusage(resource.RUSAGE_CHILDREN)\n"
              "print(code, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024)\n")
    run = subprocess.run([sys.executable, "-c", script] + command, capture_output=True, text=True, check=True)
    code, seconds, memory = run.stdout.split()
    if code != "0":
        raise RuntimeError(" ".join(command) + "\n" + run.stderr)
    return float(seconds), float(memory)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--build", required=True)
    parser.add_argument("--out", required=True)
    arguments = parser.parse_args()
    table = results.opened(parser, arguments.out, "compile_cost.csv")
    with open(os.path.join(arguments.build, "bench", "include_dirs.txt"), encoding="utf-8") as file:
        folders = [line.strip() for line in file if line.strip() and os.path.isdir(os.path.join(line.strip(), "Eigen"))]
    common = ["-std=c++20", "-I", INCLUDE] + [f for folder in folders for f in ("-isystem", folder)]

    with tempfile.TemporaryDirectory() as scratch, table as out:
        print("compiler,what,header,cpu_s,peak_MB", file=out)
        source = os.path.join(scratch, "program.cpp")
        for compiler in ("g++", "g++ --param=ggc-min-expand=10", "clang++"):
            command = compiler.split()
            if not shutil.which(command[0]):
                continue
            for what, header, text in programs():
                with open(source, "w", encoding="utf-8") as file:
                    file.write(text)
                seconds, memory = cost(command + common + ["-O2", "-c", "-o", source + ".o", source])
                print(f"compile_cost: {compiler:8} {what:14} {header:25} {seconds:5.1f} s {memory:5.0f} MB", file=sys.stderr)
                print(f"{compiler},{what},{header},{seconds:.2f},{memory:.0f}", file=out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
