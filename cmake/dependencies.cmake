# SPDX-License-Identifier: MIT
# Where dependencies come from: a target that is already there, else an installed package, else a download pinned by hash.
include_guard()
include(CheckCXXSourceCompiles)
include(FetchContent)

# Declares a header-only library that is neither a target yet nor installed: `target` becomes its downloaded folder.
# Nothing of the library's own build files runs, so it brings no targets, tests, options or install rules along.
function(trephine_fetch_headers target name url sha256)
  message(STATUS "trephine: ${name} is not installed, fetching ${url}")
  # A SOURCE_SUBDIR that does not exist keeps FetchContent from adding the library's CMakeLists.txt.
  FetchContent_Declare(trephine_${name} URL ${url} URL_HASH SHA256=${sha256} SOURCE_SUBDIR no-build-files
                       DOWNLOAD_EXTRACT_TIMESTAMP FALSE)
  FetchContent_MakeAvailable(trephine_${name})
  add_library(${target} INTERFACE IMPORTED GLOBAL)
  target_include_directories(${target} SYSTEM INTERFACE ${trephine_${name}_SOURCE_DIR})
endfunction()

function(trephine_need_eigen)
  if(TARGET Eigen3::Eigen)
    return()
  endif()
  find_package(Eigen3 QUIET NO_MODULE)
  if(TARGET Eigen3::Eigen)
    # Not as an argument of find_package: a request for 3.4 would turn down newer majors.
    if(Eigen3_VERSION VERSION_LESS 3.4)
      message(FATAL_ERROR "trephine needs Eigen 3.4 or newer and found ${Eigen3_VERSION} in ${Eigen3_DIR}. "
                          "Install a newer one (Debian, Ubuntu: libeigen3-dev) or set Eigen3_DIR.")
    endif()
    # Found here, used by whoever links trephine, in whichever folder.
    set_target_properties(Eigen3::Eigen PROPERTIES IMPORTED_GLOBAL TRUE)
    return()
  endif()
  trephine_fetch_headers(Eigen3::Eigen eigen https://gitlab.com/libeigen/eigen/-/archive/3.4.0/eigen-3.4.0.tar.gz
                         8586084f71f9bde545ee7fa6d00288b264a2b7ac3607b974e54d13e7162c1c72)
endfunction()

function(trephine_need_doctest)
  if(TARGET doctest::doctest)
    return()
  endif()
  find_package(doctest QUIET)
  if(TARGET doctest::doctest)
    set_target_properties(doctest::doctest PROPERTIES IMPORTED_GLOBAL TRUE)
    return()
  endif()
  trephine_fetch_headers(doctest::doctest doctest https://github.com/doctest/doctest/archive/v2.4.9.tar.gz
                         19b2df757f2f3703a5e63cee553d85596875f06d91a3333acd80a969ef210856)
endfunction()
