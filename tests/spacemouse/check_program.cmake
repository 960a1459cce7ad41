# SPDX-License-Identifier: MIT
# What spacemouse_drill says on its command line and where no driver answers: cmake -D program=... -P check_program.cmake
set(name spacemouse_drill)
set(environment SPNAV_SOCKET=/nonexistent/socket)
include(${CMAKE_CURRENT_LIST_DIR}/../support/expect_program.cmake)

expect(0 "usage: spacemouse_drill" --help)
expect(2 "expected --help or --seconds" --seconds)
expect(2 "expected --help or --seconds" --seconds soon)
expect(2 "expected --help or --seconds" --seconds nan)
expect(2 "expected --help or --seconds" drill)
# A driver that runs here would be asked in vain for the socket above, and found at its own.
if(NOT EXISTS /var/run/spnav.sock)
  expect(1 "install and start spacenavd" --seconds 1)
endif()
