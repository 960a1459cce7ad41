# SPDX-License-Identifier: MIT
# FindForceDimension.cmake against fake installations of its layouts:
#   cmake -D module=DIR -D work=DIR -D generator=NAME -D make_program=FILE -P check_find_module.cmake
# The fakes hold empty files of our own; a Windows target is asked for by name, nothing is compiled for it.
file(REMOVE_RECURSE ${work})

function(make_installation dir library)
  file(WRITE ${dir}/include/dhdc.h "/* fake */\n")
  file(WRITE ${dir}/include/drdc.h "/* fake */\n")
  file(WRITE ${dir}/${library} "")
endfunction()
cmake_host_system_information(RESULT processor QUERY OS_PLATFORM)
set(unpacked lib/release/lin-${processor}-gcc)
make_installation(${work}/static ${unpacked}/libdrd.a)
make_installation(${work}/shared ${unpacked}/libdrd.so)
make_installation(${work}/installed lib/libdrd.so)
make_installation(${work}/other lib/release/lin-none-gcc/libdrd.so)
make_installation(${work}/windows lib/drdms64.lib)
file(WRITE ${work}/half/include/drdc.h "/* no library */\n")
make_installation("${work}/with space" lib/libdrd.so)

# What a project sees: a line that starts with "seen".
file(WRITE ${work}/project/CMakeLists.txt [[
cmake_minimum_required(VERSION 3.24)
project(consumer NONE)
list(APPEND CMAKE_MODULE_PATH ${module})
# Without a language the platform's file names are not set up.
if(CMAKE_SYSTEM_NAME STREQUAL "Windows")
  set(WIN32 TRUE)
  unset(UNIX)
  set(CMAKE_FIND_LIBRARY_PREFIXES "")
  set(CMAKE_FIND_LIBRARY_SUFFIXES .lib)
else()
  set(CMAKE_FIND_LIBRARY_PREFIXES lib)
  set(CMAKE_FIND_LIBRARY_SUFFIXES .so .a)
endif()
find_package(ForceDimension)
find_package(ForceDimension)  # twice is no error
if(NOT ForceDimension_FOUND)
  message("seen nothing")
  return()
endif()
foreach(property IMPORTED_LOCATION INTERFACE_INCLUDE_DIRECTORIES INTERFACE_COMPILE_DEFINITIONS INTERFACE_LINK_LIBRARIES)
  get_target_property(value ForceDimension::DRD ${property})
  if(value)
    string(APPEND seen " ${value}")
  endif()
endforeach()
message("seen${seen}")
]])

set(count 0)
# expect(WHAT system environment arguments...): the consumer must see WHAT, relative to the installations' folder.
function(expect what system environment)
  math(EXPR count "${count} + 1")
  set(count ${count} PARENT_SCOPE)
  set(system_argument)
  if(NOT system STREQUAL "")
    set(system_argument -D CMAKE_SYSTEM_NAME=${system})
  endif()
  execute_process(
    COMMAND ${CMAKE_COMMAND} -E env --unset=ForceDimension_ROOT ${environment} ${CMAKE_COMMAND} -S ${work}/project
            -B ${work}/build${count} -G ${generator} -D CMAKE_MAKE_PROGRAM=${make_program} -D module=${module}
            ${system_argument} ${ARGN}
    RESULT_VARIABLE result OUTPUT_VARIABLE out ERROR_VARIABLE out
  )
  string(REGEX MATCH "seen[^\n]*" seen "${out}")
  string(REPLACE "${work}/" "" seen "${seen}")
  if(NOT result EQUAL 0 OR NOT seen STREQUAL "seen ${what}")
    message(SEND_ERROR "${environment} ${ARGN}: '${seen}', expected 'seen ${what}'\n${out}")
  endif()
endfunction()

set(static "static/${unpacked}/libdrd.a static/include LINUX usb-1.0;pthread;dl;rt")
expect("${static}" "" "" -D ForceDimension_ROOT=${work}/static)
expect("${static}" "" ForceDimension_ROOT=${work}/static)
expect("shared/${unpacked}/libdrd.so shared/include LINUX" "" ForceDimension_ROOT=${work}/shared)
expect("installed/lib/libdrd.so installed/include LINUX" "" ForceDimension_ROOT=${work}/installed)
expect("with space/lib/libdrd.so with space/include LINUX" "" "ForceDimension_ROOT=${work}/with space")
expect("windows/lib/drdms64.lib windows/include WIN64" Windows ForceDimension_ROOT=${work}/windows)
expect(nothing "" ForceDimension_ROOT=${work}/other)
expect(nothing "" ForceDimension_ROOT=${work}/half)
expect(nothing "" ForceDimension_ROOT=${work}/nowhere)
