# SPDX-License-Identifier: MIT
# FindOpenHaptics.cmake against fake installations of its layouts:
#   cmake -D module=DIR -D work=DIR -D generator=NAME -D make_program=FILE -P check_find_module.cmake
# The fakes hold empty files of our own; a Windows target is asked for by name, nothing is compiled for it.
file(REMOVE_RECURSE ${work})

function(make_installation dir library)
  file(WRITE ${dir}/include/HD/hd.h "/* fake */\n")
  file(WRITE ${dir}/${library} "")
endfunction()
make_installation(${work}/linux lib/libHD.so)
make_installation(${work}/linux64 lib64/libHD.so)
make_installation(${work}/windows lib/x64/Release/hd.lib)
file(WRITE ${work}/half/include/HD/hd.h "/* no library */\n")
make_installation("${work}/with space" lib/libHD.so)

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
find_package(OpenHaptics)
find_package(OpenHaptics)  # twice is no error
if(NOT OpenHaptics_FOUND)
  message("seen nothing")
  return()
endif()
foreach(property IMPORTED_LOCATION INTERFACE_INCLUDE_DIRECTORIES INTERFACE_COMPILE_DEFINITIONS)
  get_target_property(value OpenHaptics::HD ${property})
  string(APPEND seen " ${value}")
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
    COMMAND ${CMAKE_COMMAND} -E env --unset=OH_SDK_BASE --unset=3DTOUCH_BASE --unset=OpenHaptics_ROOT ${environment}
            ${CMAKE_COMMAND} -S ${work}/project -B ${work}/build${count} -G ${generator}
            -D CMAKE_MAKE_PROGRAM=${make_program} -D module=${module} ${system_argument} ${ARGN}
    RESULT_VARIABLE result OUTPUT_VARIABLE out ERROR_VARIABLE out
  )
  string(REGEX MATCH "seen[^\n]*" seen "${out}")
  string(REPLACE "${work}/" "" seen "${seen}")
  if(NOT result EQUAL 0 OR NOT seen STREQUAL "seen ${what}")
    message(SEND_ERROR "${environment} ${ARGN}: '${seen}', expected 'seen ${what}'\n${out}")
  endif()
endfunction()

set(linux "linux/lib/libHD.so linux/include linux=1")
set(windows "windows/lib/x64/Release/hd.lib windows/include WIN32")
expect("${linux}" "" "" -D OpenHaptics_ROOT=${work}/linux)
expect("${linux}" "" OpenHaptics_ROOT=${work}/linux)
expect("${linux}" "" OH_SDK_BASE=${work}/linux)
expect("${linux}" "" 3DTOUCH_BASE=${work}/linux)
expect("${linux}" "" OH_SDK_BASE=${work}/windows -D OpenHaptics_ROOT=${work}/linux)
expect("linux64/lib64/libHD.so linux64/include linux=1" "" OH_SDK_BASE=${work}/linux64)
expect("with space/lib/libHD.so with space/include linux=1" "" "OH_SDK_BASE=${work}/with space")
expect("${windows}" Windows "" -D OpenHaptics_ROOT=${work}/windows)
expect("${windows}" Windows OH_SDK_BASE=${work}/windows)
expect("${windows}" Windows 3DTOUCH_BASE=${work}/windows)
expect(nothing "" OH_SDK_BASE=${work}/half)
expect(nothing "" OH_SDK_BASE=${work}/nowhere)
