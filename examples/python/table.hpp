// SPDX-License-Identifier: MIT
#pragma once

#include "bind.hpp"

#include <cstdint>
#include <functional>
#include <type_traits>

namespace trephine_python {

/// A column of a table: its name, and a member or a function of a row.
template <class Get>
struct Column {
  const char* name;
  Get get;
};
template <class Get>
Column(const char*, Get) -> Column<Get>;

/// A dict of arrays with a row for each of `rows`; 64-bit counts are int64, as NumPy's own.
template <class Rows, class... Gets>
[[nodiscard]] py::dict table(const Rows& rows, const Column<Gets>&... columns) {
  py::dict made;
  const auto add = [&](const auto& column) {
    using Value = std::decay_t<decltype(std::invoke(column.get, *rows.begin()))>;
    using Number = std::conditional_t<std::is_same_v<Value, std::size_t> || std::is_same_v<Value, std::uint64_t>,
                                      std::int64_t, Value>;
    py::array_t<Number> array(static_cast<py::ssize_t>(rows.size()));
    Number* to = array.mutable_data();
    for (const auto& row : rows) *to++ = static_cast<Number>(std::invoke(column.get, row));
    made[column.name] = array;
  };
  (add(columns), ...);
  return made;
}

}  // namespace trephine_python
