# SPDX-License-Identifier: MIT
# cmake -D program=... -D arguments=... -D expected=FILE -P check_output.cmake
execute_process(COMMAND ${program} ${arguments} RESULT_VARIABLE code OUTPUT_VARIABLE out ERROR_VARIABLE err)
file(READ ${expected} text)
if(NOT code EQUAL 0 OR NOT err STREQUAL "" OR NOT out STREQUAL text)
  message(FATAL_ERROR "exit code ${code}; printed:\n${out}${err}\nexpected:\n${text}")
endif()
