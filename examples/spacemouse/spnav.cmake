# SPDX-License-Identifier: MIT
# Makes `trephine_spnav` where libspnav is installed (Debian: libspnav-dev). Included by the example and by its tests.
if(TARGET trephine_spnav)
  return()
endif()
find_path(TREPHINE_SPNAV_INCLUDE spnav.h)
find_library(TREPHINE_SPNAV_LIBRARY spnav)
# Its header includes X11's, which it may have been built for.
find_path(TREPHINE_X11_INCLUDE X11/Xlib.h)
mark_as_advanced(TREPHINE_SPNAV_INCLUDE TREPHINE_SPNAV_LIBRARY TREPHINE_X11_INCLUDE)
if(TREPHINE_SPNAV_INCLUDE AND TREPHINE_SPNAV_LIBRARY AND TREPHINE_X11_INCLUDE)
  add_library(trephine_spnav INTERFACE)
  target_include_directories(trephine_spnav SYSTEM INTERFACE ${TREPHINE_SPNAV_INCLUDE} ${TREPHINE_X11_INCLUDE})
  target_link_libraries(trephine_spnav INTERFACE ${TREPHINE_SPNAV_LIBRARY})
endif()
