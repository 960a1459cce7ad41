# SPDX-License-Identifier: MIT
# trephine::itk: trephine and what adapter/itk.hpp links. For this project's own builds and, installed, for the component `itk`.

# Makes trephine::itk, with ITK's decoder and zlib and the writers of this project's tests, or sets `reason` in the
# caller to a sentence why it cannot.
function(trephine_make_itk reason)
  set(${reason} "" PARENT_SCOPE)
  if(TARGET trephine::itk)
    return()
  endif()
  if(NOT CMAKE_C_COMPILER_LOADED)
    set(${reason} "ITK's package needs C besides C++: write project(... LANGUAGES C CXX)" PARENT_SCOPE)
    return()
  endif()
  # ITK's package files print pages about GDCM's command line tools, which nobody here needs.
  set(CMAKE_MESSAGE_LOG_LEVEL ERROR)
  # Found here, used by whoever links trephine::itk, in whichever folder.
  set(CMAKE_FIND_PACKAGE_TARGETS_GLOBAL TRUE)
  find_package(ITK 5.2 QUIET COMPONENTS ITKCommon ITKIOGDCM ITKIONRRD ITKIONIFTI ITKIOMeta ITKIOImageBase)
  unset(CMAKE_MESSAGE_LOG_LEVEL)
  if(NOT ITK_FOUND)
    set(${reason} "no ITK 5.2 or newer (Debian, Ubuntu: libinsighttoolkit5-dev; or set ITK_DIR)" PARENT_SCOPE)
    return()
  endif()
  # Some distributions' ITK headers turn down every compiler but the one they were built with.
  include(CheckCXXSourceCompiles)
  set(CMAKE_REQUIRED_INCLUDES ${ITK_INCLUDE_DIRS})
  set(CMAKE_REQUIRED_QUIET TRUE)
  check_cxx_source_compiles("#include <itkMacro.h>\nint main() {}" TREPHINE_ITK_TAKES_COMPILER)
  if(NOT TREPHINE_ITK_TAKES_COMPILER)
    set(${reason} "ITK ${ITK_VERSION} is installed and its headers refuse ${CMAKE_CXX_COMPILER}" PARENT_SCOPE)
    return()
  endif()
  # Not ITK's own use file: it adds flags and include folders to every target of the folder.
  add_library(trephine::itk INTERFACE IMPORTED GLOBAL)
  target_include_directories(trephine::itk SYSTEM INTERFACE ${ITK_INCLUDE_DIRS})
  target_link_directories(trephine::itk INTERFACE ${ITK_LIBRARY_DIRS})
  target_link_libraries(trephine::itk INTERFACE trephine::trephine ${ITK_LIBRARIES})
endfunction()
