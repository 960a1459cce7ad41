# SPDX-License-Identifier: MIT
"""Conan 2 recipe of the sources that it lies in:  conan create cmake/packaging/conan"""

import os
import re

from conan import ConanFile
from conan.tools.build import check_min_cppstd
from conan.tools.files import copy, load


class TrephineRecipe(ConanFile):
    name = "trephine"
    description = "Haptic bone drilling on CT volumes: forces, torques and carving at 1 kHz and more"
    license = "MIT"
    package_type = "header-library"
    settings = "os", "arch", "compiler", "build_type"
    no_copy_source = True

    def _root(self):
        return os.path.normpath(os.path.join(self.recipe_folder, "..", "..", ".."))

    def set_version(self):
        header = load(self, os.path.join(self._root(), "include", "trephine", "version.hpp"))
        self.version = ".".join(re.findall(r"kVersion(?:Major|Minor|Patch) = (\d+)", header))

    def export_sources(self):
        for pattern in ("include/*", "LICENSE"):
            copy(self, pattern, self._root(), self.export_sources_folder)

    def requirements(self):
        self.requires("eigen/3.4.0", transitive_headers=True)

    def validate(self):
        check_min_cppstd(self, 20)

    def package(self):
        copy(self, "*.hpp", os.path.join(self.source_folder, "include"), os.path.join(self.package_folder, "include"))
        copy(self, "LICENSE", self.source_folder, os.path.join(self.package_folder, "licenses"))

    def package_id(self):
        self.info.clear()

    def package_info(self):
        self.cpp_info.set_property("cmake_file_name", "trephine")
        self.cpp_info.set_property("cmake_target_name", "trephine::trephine")
        self.cpp_info.set_property("pkg_config_name", "trephine")
        self.cpp_info.bindirs = []
        self.cpp_info.libdirs = []
