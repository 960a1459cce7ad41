// SPDX-License-Identifier: MIT
#include "front.hpp"

#include "text.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <stdexcept>

namespace pick {

void mark_front(std::vector<Measured>& measured) {
  std::vector<std::size_t> order(measured.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const Measured &x = measured[a], &y = measured[b];
    return x.p999_us != y.p999_us ? x.p999_us < y.p999_us : x.worst_share < y.worst_share;
  });
  double best = std::numeric_limits<double>::infinity();
  for (const std::size_t i : order) {
    measured[i].front = measured[i].worst_share < best;
    best = std::min(best, measured[i].worst_share);
  }
}

Choice choose(const std::vector<Measured>& measured, double budget_us) {
  if (measured.empty()) throw std::invalid_argument("choose: there are no measurements");
  Choice c{.recommended = {}, .within_limits = {}, .nearest = measured.front(), .within_budget = {}};
  for (const Measured& m : measured) {
    const bool limits = m.worst_share <= kMargin;
    const bool budget = m.p999_us <= kMargin * budget_us;
    const auto quicker = [&](const std::optional<Measured>& than) {
      if (!than || m.p999_us < than->p999_us) return true;
      return m.p999_us == than->p999_us && m.worst_share < than->worst_share;
    };
    if (limits && quicker(c.within_limits)) c.within_limits = m;
    if (limits && budget && quicker(c.recommended)) c.recommended = m;
    const auto nearer = [&](const Measured& than) {
      return m.worst_share != than.worst_share ? m.worst_share < than.worst_share : m.p999_us < than.p999_us;
    };
    if (budget && (!c.within_budget || nearer(*c.within_budget))) c.within_budget = m;
    if (nearer(c.nearest)) c.nearest = m;
  }
  return c;
}

Verdict decide(const std::vector<Choice>& choices, double budget_us) {
  std::optional<std::size_t> line, surface;
  for (std::size_t i = 0; i < choices.size(); ++i) {
    if (!choices[i].recommended) continue;
    (algorithm_of(choices[i].recommended->setting) == Algorithm::kLine ? line : surface) = i;
  }
  if (line && surface) {
    const double ratio = choices[*surface].recommended->p999_us / choices[*line].recommended->p999_us;
    return {line,
            text("both keep to limits and budget (Surface takes %.2g times Line's time). Line holds the tool on the "
                 "surface, can have friction, and its springs do not add up where the shaft lies flush on bone; "
                 "take Surface where a smooth torque, or a ball that feels the bone it mills, matters more",
                 ratio)};
  }
  const bool both_tried = choices.size() > 1;
  if (line)
    return {line, both_tried ? text("only Line keeps to the limits within %.4g us", budget_us)
                             : std::string("only Line was asked for")};
  if (surface)
    return {surface, both_tried ? text("only Surface keeps to the limits within %.4g us", budget_us)
                                : std::string("only Surface was asked for")};
  const Measured* best = nullptr;
  for (const Choice& c : choices)
    if (c.within_limits && (!best || c.within_limits->p999_us < best->p999_us)) best = &*c.within_limits;
  std::string reason = text("nothing keeps to the limits within %.4g us, a tenth to spare; ", budget_us);
  if (best)
    return {std::nullopt, reason +
                              text("the quickest that keeps to the limits takes %.3g us: %s, ", best->p999_us,
                                   title_of(algorithm_of(best->setting))) +
                              describe(best->setting)};
  return {std::nullopt, reason + "nothing that was tried keeps to the limits at any cost"};
}

}  // namespace pick
