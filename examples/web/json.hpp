// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <concepts>
#include <cstdio>
#include <string>
#include <string_view>

namespace web {

/// Writes JSON from left to right, as its calls come; numbers in nine digits, and those that are none as null.
class Json {
 public:
  /// An object of what `members` writes, by `member`.
  template <std::invocable Members>
  void object(Members&& members) {
    enclosed('{', '}', members);
  }
  /// An array of what `elements` writes.
  template <std::invocable Elements>
  void array(Elements&& elements) {
    enclosed('[', ']', elements);
  }
  template <std::invocable Value>
  void member(std::string_view name, Value&& value) {
    key(name);
    value();
  }
  void member(std::string_view name, std::string_view value) {
    key(name);
    write(value);
  }
  void member(std::string_view name, const char* value) { member(name, std::string_view(value)); }
  void member(std::string_view name, const std::string& value) { member(name, std::string_view(value)); }
  void member(std::string_view name, bool value) {
    key(name);
    text_ += value ? "true" : "false";
  }
  template <class Number>
    requires std::is_arithmetic_v<Number>
  void member(std::string_view name, Number value) {
    key(name);
    write(static_cast<double>(value));
  }
  void element(std::string_view value) {
    comma();
    write(value);
  }
  void element(double value) {
    comma();
    write(value);
  }
  template <std::invocable Value>
  void element(Value&& value) {
    comma();
    value();
  }
  void null() { text_ += "null"; }

  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  template <class Content>
  void enclosed(char begin, char end, Content& content) {
    text_ += begin;
    first_ = true;
    content();
    text_ += end;
    first_ = false;
  }
  void comma() {
    if (!first_) text_ += ',';
    first_ = false;
  }
  void key(std::string_view name) {
    comma();
    write(name);
    text_ += ':';
  }
  void write(double value) {
    if (!std::isfinite(value)) return null();
    char number[32];
    std::snprintf(number, sizeof number, "%.9g", value);
    text_ += number;
  }
  void write(std::string_view value) {
    text_ += '"';
    for (const char c : value) {
      if (c == '"' || c == '\\') {
        text_ += '\\';
        text_ += c;
      } else if (static_cast<unsigned char>(c) < 0x20) {
        char escaped[8];
        std::snprintf(escaped, sizeof escaped, "\\u%04x", static_cast<unsigned>(c));
        text_ += escaped;
      } else {
        text_ += c;
      }
    }
    text_ += '"';
  }

  std::string text_;
  bool first_ = true;
};

}  // namespace web
