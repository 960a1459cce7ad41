// SPDX-License-Identifier: MIT
#include "csv.hpp"

#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace drill {

Csv::Csv(const std::string& path, const std::string& header) : path_(path), file_(std::fopen(path.c_str(), "w")) {
  if (!file_) throw std::runtime_error("cannot write " + path_ + ": " + std::strerror(errno));
  put(header.c_str());
  put("\n");
}

void Csv::close() {
  const bool good = std::ferror(file_.get()) == 0;
  if (std::fclose(file_.release()) != 0 || !good)
    throw std::runtime_error("cannot write " + path_ + ": the disk did not take it all");
}

}  // namespace drill
