// SPDX-License-Identifier: MIT
#include "front.hpp"

#include "text.hpp"

#include <algorithm>
#include <array>
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
  // In the order of preference.
  constexpr std::array kOrder{Algorithm::kCoupled, Algorithm::kLine, Algorithm::kSurface};
  constexpr std::array kWhy{
      "the coupled tool stays on the surface, what it feels is bounded by the coupling whatever touches, and it can "
      "have friction",
      "Line holds the tool on the surface, can have friction, and its springs do not add up where the shaft lies flush "
      "on bone; take Surface where a smooth torque, or a ball that feels the bone it mills, matters more",
      ""};
  std::vector<std::size_t> fit;
  std::size_t why = 0;
  for (std::size_t k = 0; k < kOrder.size(); ++k)
    for (std::size_t i = 0; i < choices.size(); ++i) {
      if (!choices[i].recommended || algorithm_of(choices[i].recommended->setting) != kOrder[k]) continue;
      if (fit.empty()) why = k;
      fit.push_back(i);
    }
  const auto title = [&](std::size_t i) { return title_of(algorithm_of(choices[i].recommended->setting)); };
  if (fit.size() == 1)
    return {fit[0], choices.size() > 1 ? text("only %s keeps to the limits within %.4g us", title(fit[0]), budget_us)
                                       : text("only %s was asked for", title(fit[0]))};
  if (fit.size() > 1) {
    std::string times;
    for (std::size_t n = 1; n < fit.size(); ++n)
      times += text("%s%s takes %.2g times its time", n == 1 ? "" : ", ", title(fit[n]),
                    choices[fit[n]].recommended->p999_us / choices[fit[0]].recommended->p999_us);
    return {fit[0], text("%s keep to limits and budget (%s). ", fit.size() == 2 ? "two" : "all three", times.c_str()) +
                        kWhy[why]};
  }
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
