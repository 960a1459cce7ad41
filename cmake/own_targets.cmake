# SPDX-License-Identifier: MIT
# What trephine's own programs are built with. None of it reaches the library's users.
include_guard()

if(PROJECT_IS_TOP_LEVEL AND NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  message(STATUS "trephine: no build type given, taking Release")
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
endif()

# By default only with the compilers that the project is checked with: each new one warns of something more.
set(checked_compiler FALSE)
if(PROJECT_IS_TOP_LEVEL AND "${CMAKE_CXX_COMPILER_ID} ${CMAKE_CXX_COMPILER_VERSION}" MATCHES "^(GNU 12|Clang 14)\\.")
  set(checked_compiler TRUE)
endif()
option(TREPHINE_WARNINGS_AS_ERRORS "Warnings in trephine's own programs are errors" ${checked_compiler})

function(trephine_own_target target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wconversion
                                           $<$<BOOL:${TREPHINE_WARNINGS_AS_ERRORS}>:-Werror>)
  # GCC 12 takes "text" + std::string for overlapping memory when it inlines (its bug 105329).
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
    target_compile_options(${target} PRIVATE -Wno-restrict)
  endif()
  if(MINGW)
    # Templates make more sections than an object file there has room for by default.
    target_compile_options(${target} PRIVATE -Wa,-mbig-obj)
  endif()
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF)
endfunction()
