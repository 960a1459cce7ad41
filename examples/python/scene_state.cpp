// SPDX-License-Identifier: MIT
#include "scene.hpp"

#include <memory>
#include <utility>
#include <vector>

using namespace trephine_python;

namespace {

/// What makes the scene again: its arguments, and its structures or None.
py::tuple state_of(const PythonScene& self) {
  self.bone->require_idle();
  py::object structures = py::none();
  if (const auto& s = self.structures) structures = py::make_tuple(s->distances, s->each, s->options);
  return py::make_tuple(self.bone, self.isovalue, self.tool, self.renderer, self.scene.stages(), structures);
}

ScenePointer scene_of_state(const py::tuple& state) {
  auto made = std::make_shared<PythonScene>(state[0].cast<BonePointer>(), state[1].cast<double>(),
                                            state[2].cast<SceneTool>(), state[3].cast<compiled::RendererOptions>(),
                                            state[4].cast<compiled::StageOptions>());
  if (state[5].is_none()) return made;
  const auto structures = state[5].cast<py::tuple>();
  made->set_structures({structures[0].cast<StructuresPointer>(), structures[1].cast<std::vector<ProtectedStructure>>(),
                        structures[2].cast<ProtectionOptions>()});
  return made;
}

}  // namespace

void trephine_python::bind_state(py::class_<PythonScene, ScenePointer>& scene) {
  scene.def(py::pickle(&state_of, &scene_of_state));
}
