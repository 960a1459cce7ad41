# SPDX-License-Identifier: MIT
"""Runs the Conan recipe with few lines in Conan's place: check_conan_recipe.py source version work

That it finds its sources, reads the version and packages what it should; Conan itself is not needed.
"""

import fnmatch
import importlib.util
import os
import shutil
import sys
import types

source, version, work = sys.argv[1:]


class ConanFile:
    def __init__(self):
        self.requires = lambda reference, **options: self.required.append(reference)
        self.required = []
        self.properties = {}
        self.cpp_info = types.SimpleNamespace(set_property=self.properties.__setitem__)
        self.info = types.SimpleNamespace(clear=lambda: None)


def copy(conanfile, pattern, src, dst):
    for folder, _, files in os.walk(src):
        for name in files:
            path = os.path.relpath(os.path.join(folder, name), src)
            if fnmatch.fnmatch(path, pattern):
                os.makedirs(os.path.dirname(os.path.join(dst, path)), exist_ok=True)
                shutil.copy(os.path.join(src, path), os.path.join(dst, path))


def module(name, **members):
    made = types.ModuleType(name)
    vars(made).update(members)
    sys.modules[name] = made


asked = []
module("conan", ConanFile=ConanFile)
module("conan.tools")
module("conan.tools.build", check_min_cppstd=lambda conanfile, standard: asked.append(standard))
module("conan.tools.files", copy=copy, load=lambda conanfile, path: open(path, encoding="utf-8").read())

folder = os.path.join(source, "cmake", "packaging", "conan")
spec = importlib.util.spec_from_file_location("conanfile", os.path.join(folder, "conanfile.py"))
recipe = importlib.util.module_from_spec(spec)
spec.loader.exec_module(recipe)

shutil.rmtree(work, ignore_errors=True)
r = recipe.TrephineRecipe()
r.recipe_folder = folder
r.export_sources_folder = r.source_folder = os.path.join(work, "sources")
r.package_folder = os.path.join(work, "package")
r.set_version()
assert r.version == version, r.version
r.export_sources()
r.requirements()
assert [name.split("/")[0] for name in r.required] == ["eigen"], r.required
r.validate()
assert asked == [20]
r.package()
r.package_id()
r.package_info()
assert r.properties["cmake_target_name"] == "trephine::trephine"


def headers(root):
    found = [os.path.relpath(os.path.join(at, f), root) for at, _, files in os.walk(root) for f in files]
    return sorted(found)


# Documents stand beside the headers and stay behind.
ours = [name for name in headers(os.path.join(source, "include")) if name.endswith(".hpp")]
theirs = headers(os.path.join(r.package_folder, "include"))
assert ours and ours == theirs, (ours, theirs)
assert os.listdir(os.path.join(r.package_folder, "licenses")) == ["LICENSE"]
