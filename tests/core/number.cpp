// SPDX-License-Identifier: MIT
#include "support/near.hpp"

#include <trephine/core/number.hpp>
#include <trephine/tool/named_tools.hpp>

#include <doctest/doctest.h>

#include <clocale>
#include <locale>
#include <string>

namespace {

using namespace trephine;
using namespace trephine::test;

struct Comma : std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

// A host with a decimal comma, in C++ always and in C where the system has such a locale.
class CommaHost {
 public:
  CommaHost() : in_cpp_(std::locale::global(std::locale(std::locale::classic(), new Comma))) {
    for (const char* name : {"de_DE.UTF-8", "de_DE.utf8", "de-DE", "fr_FR.UTF-8"})
      if (std::setlocale(LC_ALL, name) != nullptr) break;
  }
  ~CommaHost() {
    std::locale::global(in_cpp_);
    std::setlocale(LC_ALL, "C");
  }
  CommaHost(const CommaHost&) = delete;
  CommaHost& operator=(const CommaHost&) = delete;

 private:
  std::locale in_cpp_;
};

void numbers_are_read_and_written() {
  CHECK(parse_number("2.5") == 2.5);
  CHECK(parse_number("-1e-3") == -1e-3);
  CHECK(parse_number("1234567.25") == 1234567.25);
  CHECK(parse_number("0.1") == 0.1);
  for (const char* none :
       {"", " ", "2.5 ", " 2.5", "2,5", "1.234.567", "2.5mm", "e", ".", "nan", "inf", "1e999", "0x10", "--2"})
    CHECK_MESSAGE(!parse_number(none), std::string(none));
  CHECK(number_text(2.5) == "2.5");
  CHECK(number_text(1234567.25, 9) == "1234567.25");
  CHECK(number_text(20) == "20");
}

TEST_CASE("numbers have a decimal point in every locale") {
  numbers_are_read_and_written();
  const CommaHost host;
  numbers_are_read_and_written();
}

TEST_CASE("tools have their names in every locale") {
  const CommaHost host;
  CHECK(tool_by_name("twist-2.5").tool.burr().tip_radius == near(1.25e-3, 1e-12));
  std::string message;
  try {
    (void)tool_by_name("twist-2,5");
  } catch (const std::invalid_argument& e) {
    message = e.what();
  }
  CHECK(message.find("round-0.6 to 7") != std::string::npos);
}

TEST_CASE("a refused value is told with a decimal point in every locale") {
  const CommaHost host;
  std::string message;
  try {
    refuse("Type", "rule", 1234.5);
  } catch (const std::invalid_argument& e) {
    message = e.what();
  }
  CHECK(message == "trephine::Type: rule, got 1234.5");
}

}  // namespace
