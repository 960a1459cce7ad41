# SPDX-License-Identifier: MIT
# cmake -D program=... -D arguments=... -D option=--out -D work=FOLDER -P check_unwritable.cmake
# A program that cannot write where it should says so in one line before its work, and ends with 2. Permissions do not
# stop root, so the places are below a file and in /proc.
file(MAKE_DIRECTORY ${work})
file(WRITE ${work}/a_file "here\n")
set(places ${work}/a_file/below ${work}/a_file)
if(file STREQUAL "1")
  set(places ${work}/a_file/below)
endif()
if(EXISTS /proc/self)
  list(APPEND places /proc/trephine /proc)
endif()
foreach(place IN LISTS places)
  execute_process(COMMAND ${program} ${arguments} ${option} ${place} RESULT_VARIABLE code OUTPUT_VARIABLE out
                  ERROR_VARIABLE err TIMEOUT 60)
  string(REPLACE "${option} ${place}: " "PLACE: " said "${err}")  # no path in an expression: build-g++/ is none
  if(NOT code EQUAL 2 OR NOT said MATCHES "^[^\n]*PLACE: cannot be (made|written) [(][^\n]+\n$")
    message(SEND_ERROR "${option} ${place}: exit code ${code}, expected 2 and one line, got:\n${out}${err}")
  endif()
endforeach()
file(READ ${work}/a_file left)
if(NOT left STREQUAL "here\n")
  message(SEND_ERROR "the file in the way was changed")
endif()
