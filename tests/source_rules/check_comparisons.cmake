# SPDX-License-Identifier: MIT
# Numbers are compared by support/near.hpp, which states its bound: doctest's Approx adds one to the size that it takes a
# share of, so that 1e-6 of a millimetre passes for zero.
#   cmake -D tests=DIR [-D expect=FILE] -P check_comparisons.cmake
file(GLOB_RECURSE sources RELATIVE ${tests} ${tests}/*.cpp ${tests}/*.hpp)
set(broken)
foreach(source IN LISTS sources)
  file(STRINGS ${tests}/${source} lines REGEX "(^|[^A-Za-z])Approx *[({]")
  if(lines AND NOT source MATCHES "^source_rules/")
    list(APPEND broken ${source})
  endif()
endforeach()
if(NOT "${broken}" STREQUAL "${expect}")
  message(FATAL_ERROR "doctest::Approx in '${broken}', expected in '${expect}': use near or within (support/near.hpp)")
endif()
list(LENGTH sources count)
message("${count} files of tests checked")
