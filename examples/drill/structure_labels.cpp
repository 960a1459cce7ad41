// SPDX-License-Identifier: MIT
#include "structure_labels.hpp"

#include "read_itk.hpp"

#include <stdexcept>

namespace drill {

AnyLabels load_labels(const std::string& path, [[maybe_unused]] std::vector<std::string>& notes) {
#ifdef TREPHINE_EXAMPLE_HAS_ITK
  return read_label_file(path, notes);
#else
  throw std::runtime_error("--labels " + path +
                           ": this build cannot read it, ITK is missing (Debian: libinsighttoolkit5-dev); build again "
                           "with it");
#endif
}

}  // namespace drill
