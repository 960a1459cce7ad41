// SPDX-License-Identifier: MIT
#include "studies/arguments.hpp"
#include "studies/study.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <iostream>

/// The report's studies: bench_studies --out DIR [--quick] [--skull FOLDER] [NAME...]
int main(int argc, char** argv) {
  using namespace trephine::bench;
  StudyOptions options{.folder = "build/report"};
  std::vector<std::string> wanted;
  if (!read_arguments(argc, argv, "bench_studies", {{"--quick", &options.quick}},
                      {{"--out", &options.folder}, {"--skull", &options.skull}}, &wanted))
    return 2;
  for (const auto& name : wanted) {
    bool known = false;
    for (const Study& s : studies()) known = known || name == s.name;
    if (known) continue;
    std::cerr << "bench_studies: there is no study '" << name << "'\n";
    return 2;
  }
  std::filesystem::create_directories(options.folder);
  try {
    for (const Study& s : studies()) {
      if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), s.name) == wanted.end()) continue;
      std::fprintf(stderr, "studies: %s: %s\n", s.name, s.asks);
      const auto begin = std::chrono::steady_clock::now();
      s.run(options);
      std::fprintf(stderr, "studies: %s: %.1f s\n", s.name,
                   std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    }
  } catch (const std::exception& e) {
    std::cerr << "bench_studies: " << e.what() << '\n';
    return 1;
  }
}
