# SPDX-License-Identifier: MIT
# Installs trephine, moves it and compiles with nothing but what pkg-config says; see CMakeLists.txt.
cmake_policy(VERSION 3.24)

function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE errors
                  OUTPUT_STRIP_TRAILING_WHITESPACE)
  if(NOT status EQUAL 0)
    list(JOIN ARGN " " command)
    message(FATAL_ERROR "${command}\nended with ${status}:\n${output}${errors}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE ${work})
run(${CMAKE_COMMAND} --install ${build} --prefix ${work}/installed)
file(RENAME ${work}/installed ${work}/moved)
file(READ ${work}/moved/share/pkgconfig/trephine.pc text)
foreach(place ${source} ${build} ${work})
  string(FIND "${text}" "${place}" at)
  if(NOT at EQUAL -1)
    message(FATAL_ERROR "trephine.pc names ${place}: not relocatable")
  endif()
endforeach()

set(ENV{PKG_CONFIG_PATH} ${work}/moved/share/pkgconfig)
run(${pkg_config} --modversion trephine)
if(NOT output STREQUAL version)
  message(FATAL_ERROR "trephine.pc says version ${output}, expected ${version}")
endif()
run(${pkg_config} --validate trephine)
run(${pkg_config} --cflags trephine)
separate_arguments(flags UNIX_COMMAND "${output} ${CXX_FLAGS}")
# The headers' own tests have seen them work: here it is enough that they and Eigen's are found.
run(${CXX} -std=c++20 ${flags} -fsyntax-only ${source}/tests/packaging/consumer/second.cpp)
