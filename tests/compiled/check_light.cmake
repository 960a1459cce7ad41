# SPDX-License-Identifier: MIT
# How much of trephine a program reads that includes compiled/scene.hpp: no grid, no renderer and no scene, and few
# lines beside the stages that own the options. Counts do not depend on the machine, as seconds would.
cmake_policy(VERSION 3.24)
set(most_lines 3000)

execute_process(COMMAND ${CXX} -std=c++20 -MM -I${include} -isystem ${eigen} ${include}/trephine/compiled/scene.hpp
                OUTPUT_VARIABLE rule ERROR_VARIABLE errors RESULT_VARIABLE status)
if(NOT status EQUAL 0)
  message(FATAL_ERROR "${CXX} -MM ended with ${status}:\n${errors}")
endif()
string(REGEX MATCHALL "[^ \n\\]+/trephine/[^ \n\\]+\\.hpp" headers "${rule}")
list(LENGTH headers count)
if(count LESS 5)
  message(FATAL_ERROR "found ${count} headers in: ${rule}")
endif()
set(lines 0)
foreach(header IN LISTS headers)
  if(header MATCHES "/(device|adapter)/|/voxel_grid|_renderer\\.hpp$|/compiled/library\\.hpp$|/stage/(haptic_scene|cutting|cutting_force)\\.hpp$")
    message(FATAL_ERROR "compiled/scene.hpp includes ${header}")
  endif()
  file(STRINGS ${header} text)
  list(LENGTH text of_header)
  math(EXPR lines "${lines} + ${of_header}")
endforeach()
message("${count} headers of trephine, ${lines} lines")
if(lines GREATER most_lines)
  message(FATAL_ERROR "more than ${most_lines} lines")
endif()
