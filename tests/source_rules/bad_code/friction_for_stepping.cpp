// SPDX-License-Identifier: MIT
// says: TranslateRotate{}, Coulomb{0.2, 0.15}}
#include <trephine/render/line/line_approx_renderer.hpp>

using namespace trephine;

auto renderer() {
  return LineApproxRenderer{ToolDiscretization{Burr{}, LineCounts{}}, LineOptions{}, Coulomb{0.3, 0.2}};
}
