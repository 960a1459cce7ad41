# SPDX-License-Identifier: MIT
# Finds the HD library of an installed OpenHaptics SDK (trephine is not affiliated with it and contains nothing of it).
#
# Makes the imported target OpenHaptics::HD, with the SDK's headers as system headers, and sets
#   OpenHaptics_FOUND, OpenHaptics_INCLUDE_DIR (holds HD/hd.h), OpenHaptics_HD_LIBRARY
# Looks in OpenHaptics_ROOT (variable or environment), then where the environment's OH_SDK_BASE and 3DTOUCH_BASE point
# (the SDK's installer sets them), then in the system's folders. Layouts:
#   Linux    include/HD/hd.h   lib/libHD.so, lib64/libHD.so, usr/lib/libHD.so
#   Windows  include/HD/hd.h   lib/x64/Release/hd.lib
#
# A machine without the device's driver may lack what the shared library itself needs; linking there takes
# -Wl,--allow-shlib-undefined, which is left to the caller.
set(_openhaptics_hints ENV OH_SDK_BASE ENV 3DTOUCH_BASE)

find_path(
  OpenHaptics_INCLUDE_DIR
  NAMES HD/hd.h
  HINTS ${_openhaptics_hints}
  PATH_SUFFIXES include usr/include
  DOC "Folder that holds HD/hd.h"
)
find_library(
  OpenHaptics_HD_LIBRARY
  NAMES HD hd
  HINTS ${_openhaptics_hints}
  PATH_SUFFIXES lib lib64 usr/lib usr/lib64 lib/x64/Release
  DOC "OpenHaptics' HD library"
)
unset(_openhaptics_hints)

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(OpenHaptics REQUIRED_VARS OpenHaptics_HD_LIBRARY OpenHaptics_INCLUDE_DIR)
mark_as_advanced(OpenHaptics_INCLUDE_DIR OpenHaptics_HD_LIBRARY)

if(OpenHaptics_FOUND AND NOT TARGET OpenHaptics::HD)
  add_library(OpenHaptics::HD UNKNOWN IMPORTED)
  set_target_properties(
    OpenHaptics::HD PROPERTIES IMPORTED_LOCATION "${OpenHaptics_HD_LIBRARY}" INTERFACE_INCLUDE_DIRECTORIES
                                                                             "${OpenHaptics_INCLUDE_DIR}"
  )
  # The SDK's headers choose their platform by macros that strict C++ modes of the compilers do not define.
  if(WIN32)
    set_property(TARGET OpenHaptics::HD PROPERTY INTERFACE_COMPILE_DEFINITIONS WIN32)
  else()
    set_property(TARGET OpenHaptics::HD PROPERTY INTERFACE_COMPILE_DEFINITIONS linux=1)
  endif()
endif()
