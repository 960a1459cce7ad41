// SPDX-License-Identifier: MIT
#include "progress_line.hpp"

#include <cstdio>

#if defined(__unix__) || defined(__APPLE__)
#include <unistd.h>
#endif

namespace pick {
namespace {

bool is_terminal() {
#if defined(__unix__) || defined(__APPLE__)
  return isatty(STDERR_FILENO) != 0;
#else
  return false;
#endif
}

double seconds(std::chrono::steady_clock::duration d) { return std::chrono::duration<double>(d).count(); }

}  // namespace

ProgressLine::ProgressLine() : terminal_(is_terminal()) {}
ProgressLine::~ProgressLine() { end_line(); }

void ProgressLine::end_line() {
  if (open_) std::fputs("\n", stderr);
  open_ = false;
}

void ProgressLine::operator()(const std::string& part, double share) {
  const auto now = Clock::now();
  const bool fresh = part != part_;
  if (fresh) {
    end_line();
    part_ = part;
    start_ = now;
  }
  const double since = seconds(now - written_);
  const bool last = share >= 1;
  if (!fresh && !last && since < (terminal_ ? 0.1 : 10.0)) return;
  // Without a terminal a line at every part's start and every ten seconds; with one, also where each part ended.
  if (!terminal_ && last && !fresh) return;
  written_ = now;
  const double took = seconds(now - start_);
  std::fprintf(stderr, "%s%-34s %3.0f %%", terminal_ ? "\r" : "", part.c_str(), 100 * share);
  if (last)
    std::fprintf(stderr, "  %.1f s            ", took);
  else if (share > 0.02 && took > 0.5)
    std::fprintf(stderr, "  about %.0f s left", took * (1 - share) / share);
  std::fputs(terminal_ ? "" : "\n", stderr);
  std::fflush(stderr);
  open_ = terminal_;
}

}  // namespace pick
