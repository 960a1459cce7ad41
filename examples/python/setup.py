# SPDX-License-Identifier: MIT
"""pip install --no-build-isolation ./examples/python: CMake builds the module, which takes minutes.

TREPHINE_BUILD_DIR names a build folder whose objects are used, seen from the project's root; build/python is the default.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

from setuptools import Distribution, setup
from setuptools.command.build_py import build_py

root = Path(__file__).resolve().parents[2]
build = root / os.environ.get("TREPHINE_BUILD_DIR", "build/python")
version = ".".join(re.findall(r"kVersion(?:Major|Minor|Patch) = (\d+)", (root / "include/trephine/version.hpp").read_text()))

build.mkdir(parents=True, exist_ok=True)


class BuildWithCMake(build_py):
    def run(self):
        options = ["-DCMAKE_BUILD_TYPE=Release", "-DTREPHINE_BUILD_TESTS=OFF", "-DTREPHINE_BUILD_BENCH=OFF",
                   "-DTREPHINE_BUILD_EXAMPLES=ON", "-DPython_EXECUTABLE=" + sys.executable]  # fmt: skip
        subprocess.run(["cmake", "-S", root, "-B", build, *options], check=True)
        subprocess.run(["cmake", "--build", build, "--target", "trephine_python", "--parallel", str(os.cpu_count() or 1)],
                       check=True)  # fmt: skip
        shutil.copytree(build / "examples/python/trephine", Path(self.build_lib) / "trephine", dirs_exist_ok=True,
                        ignore=shutil.ignore_patterns("__pycache__"))  # fmt: skip


class WithModule(Distribution):
    def has_ext_modules(self):
        return True


setup(
    name="trephine",
    version=version,
    description="Haptic bone drilling on CT volumes",
    license="MIT",
    python_requires=">=3.8",
    install_requires=["numpy"],
    packages=["trephine", "trephine.report"],
    package_dir={"trephine": "package"},
    distclass=WithModule,
    options={"build": {"build_base": str(build / "wheel")}, "egg_info": {"egg_base": str(build)}},
    cmdclass={"build_py": BuildWithCMake},
)
