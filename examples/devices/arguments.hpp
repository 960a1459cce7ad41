// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/number.hpp>

#include <initializer_list>
#include <map>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>

namespace devices {

/// A wrong argument, in one line.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A command line of `--name value` pairs and `--name` flags. Every member throws UsageError for what it refuses.
class Arguments {
 public:
  Arguments(int argc, const char* const* argv, std::initializer_list<std::string> with_value,
            std::initializer_list<std::string> flags) {
    const auto is_in = [](const std::initializer_list<std::string>& names, const std::string& name) {
      for (const std::string& n : names)
        if (n == name) return true;
      return false;
    };
    for (int i = 1; i < argc; ++i) {
      const std::string name = argv[i];
      if (is_in(flags, name)) {
        values_[name] = "";
        continue;
      }
      if (!is_in(with_value, name)) throw UsageError("unknown option '" + name + "'; --help lists what there is");
      if (++i == argc || *argv[i] == '\0') throw UsageError(name + " needs a value");
      values_[name] = argv[i];
    }
  }

  [[nodiscard]] bool has(const std::string& name) const { return values_.count(name) > 0; }
  [[nodiscard]] std::string text(const std::string& name, const std::string& otherwise) const {
    const auto found = values_.find(name);
    return found == values_.end() ? otherwise : found->second;
  }
  [[nodiscard]] double number(const std::string& name, double otherwise, double least, double most) const {
    return has(name) ? checked(name, text(name, {}), least, most) : otherwise;
  }
  [[nodiscard]] unsigned short port(unsigned short least) const {
    const double port = number("--port", 10001, least, 65535);
    const auto whole = static_cast<unsigned short>(port);
    if (whole != port) throw UsageError("--port: '" + text("--port", {}) + "' is no whole number");
    return whole;
  }
  static double checked(const std::string& name, const std::string& text, double least, double most) {
    const std::optional<double> v = trephine::parse_number(text);
    if (v && *v >= least && *v <= most) return *v;
    std::ostringstream s;
    s << name << ": '" << text << "' is not a number from " << least << " to " << most;
    throw UsageError(s.str());
  }

 private:
  std::map<std::string, std::string> values_;
};

}  // namespace devices
