# SPDX-License-Identifier: MIT
# What trephine's own programs are built with. None of it reaches the library's users.
include_guard()

if(PROJECT_IS_TOP_LEVEL AND NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  message(STATUS "trephine: no build type given, taking Release")
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
endif()

option(TREPHINE_WARNINGS_AS_ERRORS "Warnings in trephine's own programs are errors" ${PROJECT_IS_TOP_LEVEL})

function(trephine_own_target target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wconversion
                                           $<$<BOOL:${TREPHINE_WARNINGS_AS_ERRORS}>:-Werror>)
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF)
endfunction()
