# SPDX-License-Identifier: MIT
# Finds an unpacked Force Dimension SDK (trephine is not affiliated with it and contains nothing of it).
#
# Makes the imported target ForceDimension::DRD, whose library holds DHD and DRD, with the SDK's headers as system headers,
# and sets
#   ForceDimension_FOUND, ForceDimension_INCLUDE_DIR (holds dhdc.h and drdc.h), ForceDimension_DRD_LIBRARY
# Looks in ForceDimension_ROOT (variable or environment), then in the system's folders. Layouts:
#   Linux    include/drdc.h   lib/release/lin-*-gcc/libdrd.so or libdrd.a, lib/libdrd.so
#   macOS    include/drdc.h   lib/release/mac-*-clang/libdrd.a
#   Windows  include/drdc.h   lib/drdms64.lib; MinGW: bin/drd64.dll
set(_force_dimension_folders lib lib64 bin)
foreach(_force_dimension_system lin-x86_64-gcc lin-aarch64-gcc lin-armv7l-gcc mac-x86_64-clang mac-arm64-clang)
  # The SDK of one system may be unpacked over another's.
  if(NOT CMAKE_SYSTEM_PROCESSOR OR _force_dimension_system MATCHES "-${CMAKE_SYSTEM_PROCESSOR}-")
    list(APPEND _force_dimension_folders lib/release/${_force_dimension_system})
  endif()
endforeach()

find_path(
  ForceDimension_INCLUDE_DIR
  NAMES drdc.h
  PATH_SUFFIXES include
  DOC "Folder that holds dhdc.h and drdc.h"
)
find_library(
  ForceDimension_DRD_LIBRARY
  NAMES drd drdms64 drd64
  PATH_SUFFIXES ${_force_dimension_folders}
  DOC "Force Dimension's DRD library"
)
unset(_force_dimension_folders)
unset(_force_dimension_system)

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(ForceDimension REQUIRED_VARS ForceDimension_DRD_LIBRARY ForceDimension_INCLUDE_DIR)
mark_as_advanced(ForceDimension_INCLUDE_DIR ForceDimension_DRD_LIBRARY)

if(ForceDimension_FOUND AND NOT TARGET ForceDimension::DRD)
  add_library(ForceDimension::DRD UNKNOWN IMPORTED)
  set_target_properties(
    ForceDimension::DRD PROPERTIES IMPORTED_LOCATION "${ForceDimension_DRD_LIBRARY}" INTERFACE_INCLUDE_DIRECTORIES
                                                                                     "${ForceDimension_INCLUDE_DIR}"
  )
  # The headers ask for the platform by a macro of their own.
  if(WIN32)
    set_property(TARGET ForceDimension::DRD PROPERTY INTERFACE_COMPILE_DEFINITIONS WIN64)
  elseif(APPLE)
    set_property(TARGET ForceDimension::DRD PROPERTY INTERFACE_COMPILE_DEFINITIONS MACOSX)
  else()
    set_property(TARGET ForceDimension::DRD PROPERTY INTERFACE_COMPILE_DEFINITIONS LINUX)
    if(ForceDimension_DRD_LIBRARY MATCHES "\\.a$")
      set_property(TARGET ForceDimension::DRD PROPERTY INTERFACE_LINK_LIBRARIES usb-1.0 pthread dl rt)
    endif()
  endif()
endif()
