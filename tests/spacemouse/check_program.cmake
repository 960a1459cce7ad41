# SPDX-License-Identifier: MIT
# What spacemouse_drill says on its command line and where no driver answers: cmake -D program=... -P check_program.cmake
function(expect code pattern)
  execute_process(
    COMMAND ${CMAKE_COMMAND} -E env SPNAV_SOCKET=/nonexistent/socket ${program} ${ARGN}
    RESULT_VARIABLE result OUTPUT_VARIABLE out ERROR_VARIABLE err TIMEOUT 60
  )
  if(NOT result EQUAL code)
    message(SEND_ERROR "spacemouse_drill ${ARGN}: exit code ${result}, expected ${code}\n${out}${err}")
  elseif(code EQUAL 0 AND NOT out MATCHES "${pattern}")
    message(SEND_ERROR "spacemouse_drill ${ARGN}: says '${out}', expected ${pattern}")
  elseif(NOT code EQUAL 0 AND NOT err MATCHES "^spacemouse_drill: [^\n]*${pattern}[^\n]*\n$")
    message(SEND_ERROR "spacemouse_drill ${ARGN}: says '${err}', expected one line with ${pattern}")
  endif()
endfunction()

expect(0 "usage: spacemouse_drill" --help)
expect(2 "expected --help or --seconds" --seconds)
expect(2 "expected --help or --seconds" --seconds soon)
expect(2 "expected --help or --seconds" --seconds nan)
expect(2 "expected --help or --seconds" drill)
# A driver that runs here would be asked in vain for the socket above, and found at its own.
if(NOT EXISTS /var/run/spnav.sock)
  expect(1 "install and start spacenavd" --seconds 1)
endif()
