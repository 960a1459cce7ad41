# SPDX-License-Identifier: MIT
# Programs at their command line. A script that includes this sets `program`, its `name`, and `environment`: what
# `cmake -E env` changes for it. expect(CODE PATTERN ARGUMENTS...): the program ends with the code and prints the
# pattern, or where the code is an error's, says it in one line that begins with its name.
function(expect code pattern)
  execute_process(
    COMMAND ${CMAKE_COMMAND} -E env ${environment} ${program} ${ARGN}
    RESULT_VARIABLE result OUTPUT_VARIABLE out ERROR_VARIABLE err TIMEOUT 60
  )
  if(NOT result EQUAL code)
    message(SEND_ERROR "${name} ${ARGN}: exit code ${result}, expected ${code}\n${out}${err}")
  elseif(code EQUAL 0 AND NOT out MATCHES "${pattern}")
    message(SEND_ERROR "${name} ${ARGN}: says '${out}', expected ${pattern}")
  elseif(NOT code EQUAL 0 AND NOT err MATCHES "^${name}: [^\n]*${pattern}[^\n]*\n$")
    message(SEND_ERROR "${name} ${ARGN}: says '${err}', expected one line with ${pattern}")
  endif()
endfunction()
