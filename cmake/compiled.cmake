# SPDX-License-Identifier: MIT
# The static library trephine::compiled: the scene of compiled/scene.hpp, in a unit for each type of voxel, and structures
# in one more. Only what links it builds it, unless TREPHINE_BUILD_COMPILED is on.
set(trephine_compiled_units)
foreach(trephine_density uint8_t int8_t uint16_t int16_t float)
  string(REGEX REPLACE "^(u?int)" "std::\\1" trephine_type ${trephine_density})
  set(trephine_unit ${CMAKE_CURRENT_BINARY_DIR}/compiled/${trephine_density}.cpp)
  file(CONFIGURE OUTPUT ${trephine_unit} CONTENT "#include <trephine/compiled/library.hpp>

template struct trephine::compiled::BoneMaker<@trephine_type@>;
" @ONLY)
  list(APPEND trephine_compiled_units ${trephine_unit})
endforeach()
set(trephine_unit ${CMAKE_CURRENT_BINARY_DIR}/compiled/structures.cpp)
file(CONFIGURE OUTPUT ${trephine_unit} CONTENT "#include <trephine/compiled/structure_library.hpp>

template struct trephine::compiled::StructuresMaker<>;
" @ONLY)
list(APPEND trephine_compiled_units ${trephine_unit})
set(trephine_all)
if(NOT TREPHINE_BUILD_COMPILED)
  set(trephine_all EXCLUDE_FROM_ALL)
endif()
add_library(trephine_compiled STATIC ${trephine_all} ${trephine_compiled_units})
add_library(trephine::compiled ALIAS trephine_compiled)
target_link_libraries(trephine_compiled PUBLIC trephine)
# Without optimisation a tick takes longer than a millisecond, so a program that is built so still gets an optimised one.
if(CMAKE_CXX_COMPILER_ID MATCHES "GNU|Clang")
  target_compile_options(trephine_compiled PRIVATE $<$<OR:$<CONFIG:Debug>,$<STREQUAL:$<CONFIG>,>>:-O2>)
endif()
# Shared libraries link it too, and export nothing of it.
set_target_properties(
  trephine_compiled PROPERTIES EXPORT_NAME compiled POSITION_INDEPENDENT_CODE ON CXX_EXTENSIONS OFF
                               CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON
)
if(MINGW)
  # Templates make more sections than an object file there has room for by default.
  target_compile_options(trephine_compiled PRIVATE -Wa,-mbig-obj)
endif()
