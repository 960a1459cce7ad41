// SPDX-License-Identifier: MIT
#include "stability/rows.hpp"

#include <limits>

namespace trephine::bench {

StabilityRow at_most(const std::string& scenario, const std::string& name, const std::string& renderer,
                     const std::string& options, double measured, double limit, const std::string& unit,
                     double reference) {
  return {scenario, name, renderer, options, measured, reference, unit, limit, measured <= limit};
}

StabilityRow told(const std::string& scenario, const std::string& name, const std::string& renderer,
                  const std::string& options, double measured, const std::string& unit, double reference) {
  return {scenario, name, renderer, options, measured, reference, unit, std::numeric_limits<double>::quiet_NaN(), true};
}

}  // namespace trephine::bench
