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

# Optional: sets TREPHINE_HAS_ITK for the caller and makes `trephine::itk` with the decoder and the zlib that
# adapter/itk.hpp uses, and the writers of its tests.
function(trephine_want_itk)
  if(NOT TARGET trephine::itk)
    # ITK's package files print pages about GDCM's command line tools, which nobody here needs.
    set(CMAKE_MESSAGE_LOG_LEVEL ERROR)
    find_package(ITK 5.2 QUIET COMPONENTS ITKCommon ITKIOGDCM ITKIONRRD ITKIONIFTI ITKIOMeta ITKIOImageBase)
    unset(CMAKE_MESSAGE_LOG_LEVEL)
    if(ITK_FOUND)
      # Some distributions' ITK headers turn down every compiler but the one they were built with.
      set(CMAKE_REQUIRED_INCLUDES ${ITK_INCLUDE_DIRS})
      set(CMAKE_REQUIRED_QUIET TRUE)
      check_cxx_source_compiles("#include <itkMacro.h>\nint main() {}" TREPHINE_ITK_TAKES_COMPILER)
      if(NOT TREPHINE_ITK_TAKES_COMPILER)
        message(STATUS "trephine: ITK ${ITK_VERSION} is installed and its headers refuse ${CMAKE_CXX_COMPILER}: not used")
      endif()
    endif()
    if(ITK_FOUND AND TREPHINE_ITK_TAKES_COMPILER)
      # Not ITK's own use file: it adds flags and include folders to every target of the folder.
      add_library(trephine_itk INTERFACE)
      add_library(trephine::itk ALIAS trephine_itk)
      target_include_directories(trephine_itk SYSTEM INTERFACE ${ITK_INCLUDE_DIRS})
      target_link_directories(trephine_itk INTERFACE ${ITK_LIBRARY_DIRS})
      target_link_libraries(trephine_itk INTERFACE ${ITK_LIBRARIES})
    endif()
  endif()
  if(TARGET trephine::itk)
    set(TREPHINE_HAS_ITK TRUE PARENT_SCOPE)
  else()
    set(TREPHINE_HAS_ITK FALSE PARENT_SCOPE)
  endif()
endfunction()
