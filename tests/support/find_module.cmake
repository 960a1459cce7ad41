# SPDX-License-Identifier: MIT
# Find modules against fake installations of an SDK's layouts. A script that includes this is run as
#   cmake -D module=DIR -D work=DIR -D generator=NAME -D make_program=FILE -P SCRIPT
# and sets the module's `package`, its `target`, the `headers` that show an SDK, and the `variables` of the environment
# that point to one. The fakes hold empty files of our own; a Windows target is asked for by name, nothing is compiled.
file(REMOVE_RECURSE ${work})

# make_installation(FOLDER LIBRARY): with the SDK's headers.
function(make_installation dir library)
  foreach(header IN LISTS headers)
    file(WRITE ${dir}/include/${header} "/* fake */\n")
  endforeach()
  file(WRITE ${dir}/${library} "")
endfunction()

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
find_package(${package})
find_package(${package})  # twice is no error
if(NOT ${package}_FOUND)
  message("seen nothing")
  return()
endif()
foreach(property IMPORTED_LOCATION INTERFACE_INCLUDE_DIRECTORIES INTERFACE_COMPILE_DEFINITIONS INTERFACE_LINK_LIBRARIES)
  get_target_property(value ${target} ${property})
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
  list(TRANSFORM variables PREPEND --unset=)
  execute_process(
    COMMAND ${CMAKE_COMMAND} -E env ${variables} ${environment} ${CMAKE_COMMAND} -S ${work}/project -B ${work}/build${count}
            -G ${generator} -D CMAKE_MAKE_PROGRAM=${make_program} -D module=${module} -D package=${package} -D target=${target}
            ${system_argument} ${ARGN}
    RESULT_VARIABLE result OUTPUT_VARIABLE out ERROR_VARIABLE out
  )
  string(REGEX MATCH "seen[^\n]*" seen "${out}")
  string(REPLACE "${work}/" "" seen "${seen}")
  if(NOT result EQUAL 0 OR NOT seen STREQUAL "seen ${what}")
    message(SEND_ERROR "${environment} ${ARGN}: '${seen}', expected 'seen ${what}'\n${out}")
  endif()
endfunction()
