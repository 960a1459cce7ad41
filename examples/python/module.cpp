// SPDX-License-Identifier: MIT
#include "bind.hpp"

#include <trephine/version.hpp>

#include <string>

using namespace trephine_python;

PYBIND11_MODULE(_trephine, m) {
  // So that classes are shown as the package's.
  const py::object name = m.attr("__name__");
  m.attr("__name__") = "trephine";
  bind_options(m);
  bind_tools(m);
  bind_bone(m);
  bind_structures(m);
  bind_session(m);
  bind_scores(m);
  bind_recording(m);
  bind_scene(m);
  bind_batch(m);
  m.attr("__version__") =
      std::to_string(kVersionMajor) + "." + std::to_string(kVersionMinor) + "." + std::to_string(kVersionPatch);
  m.attr("__name__") = name;
}
