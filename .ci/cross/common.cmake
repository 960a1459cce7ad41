# SPDX-License-Identifier: MIT
# What cross builds share: programs are the host's, libraries the target's. Eigen and doctest are headers alone, so the
# host's serve; headers.cmake hands them over.
set(CMAKE_FIND_ROOT_PATH ${cross_root})
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(CMAKE_PROJECT_trephine_INCLUDE ${CMAKE_CURRENT_LIST_DIR}/headers.cmake)
