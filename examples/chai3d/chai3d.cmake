# SPDX-License-Identifier: MIT
# Makes `trephine_chai3d` where CHAI3D 3.3 is found: CHAI3D_ROOT is its build folder. Else TREPHINE_NO_CHAI3D has the reason.
# Included by the example and by its tests.
if(TARGET trephine_chai3d)
  return()
endif()
set(TREPHINE_NO_CHAI3D "CHAI3D is not given: build it, and set CHAI3D_ROOT to its build folder (examples/chai3d/README.md)")
set(CHAI3D_ROOT "" CACHE PATH "CHAI3D's build folder, which has its chai3dConfig.cmake")
find_package(chai3d CONFIG QUIET HINTS ${CHAI3D_ROOT} ENV CHAI3D_ROOT)
if(NOT chai3d_FOUND)
  if(CHAI3D_ROOT)
    set(TREPHINE_NO_CHAI3D "there is no chai3dConfig.cmake in CHAI3D_ROOT, ${CHAI3D_ROOT}: it is CHAI3D's build folder")
  endif()
  return()
endif()
if(NOT EXISTS "${CHAI3D_SOURCE_DIR}/src/chai3d.h")
  set(TREPHINE_NO_CHAI3D "CHAI3D's sources, which its package refers to, are not in ${CHAI3D_SOURCE_DIR}")
  return()
endif()
get_target_property(configuration chai3d IMPORTED_CONFIGURATIONS)
get_target_property(library chai3d IMPORTED_LOCATION_${configuration})
if(NOT EXISTS "${library}")
  set(TREPHINE_NO_CHAI3D "CHAI3D is configured but not built: ${library} is missing")
  return()
endif()

# The tests link it from another folder.
set_target_properties(chai3d PROPERTIES IMPORTED_GLOBAL TRUE)
add_library(trephine_chai3d INTERFACE)
# One Eigen for all: CHAI3D's own copy stays out. Its types never cross the library's border.
list(FILTER CHAI3D_INCLUDE_DIRS EXCLUDE REGEX "/externals/Eigen$")
target_include_directories(trephine_chai3d SYSTEM INTERFACE ${CHAI3D_INCLUDE_DIRS})
target_link_directories(trephine_chai3d INTERFACE ${CHAI3D_LIBRARY_DIRS})
target_link_libraries(trephine_chai3d INTERFACE ${CHAI3D_LIBRARIES})
# The package keeps to itself what its headers need: without it classes have other members than in the library.
target_compile_definitions(
  trephine_chai3d INTERFACE ${CHAI3D_DEFINITIONS} $<$<PLATFORM_ID:Linux>:LINUX> $<$<PLATFORM_ID:Darwin>:MACOSX>
                            $<$<PLATFORM_ID:Windows>:WIN64> $<$<PLATFORM_ID:Windows>:GLEW_STATIC>
)
