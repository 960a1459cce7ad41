# SPDX-License-Identifier: MIT
# Two translation units that share a bone and a pose link and agree under the same alignment, and do not link where one
# aligns more, as with -mavx: its types then have another layout.
#   cmake -D "compile=COMPILER;ARGUMENT;..." -D source=DIR -D work=DIR -P check_alignment.cmake
cmake_policy(VERSION 3.24)
file(MAKE_DIRECTORY ${work})
set(aligned_16 -DEIGEN_MAX_STATIC_ALIGN_BYTES=16)
set(aligned_32 -DEIGEN_MAX_STATIC_ALIGN_BYTES=32)
execute_process(COMMAND ${compile} ${aligned_16} -c ${source}/main.cpp -o ${work}/main.o COMMAND_ERROR_IS_FATAL ANY)
foreach(unit aligned_16 aligned_32)
  execute_process(COMMAND ${compile} ${${unit}} -c ${source}/height.cpp -o ${work}/${unit}.o COMMAND_ERROR_IS_FATAL ANY)
endforeach()
execute_process(COMMAND ${compile} ${work}/main.o ${work}/aligned_16.o -o ${work}/program COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${work}/program COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${compile} ${work}/main.o ${work}/aligned_32.o -o ${work}/mixed RESULT_VARIABLE status ERROR_VARIABLE said)
if(status EQUAL 0 OR NOT said MATCHES "height_above")
  message(FATAL_ERROR "units of two alignments ended with ${status}:\n${said}")
endif()
