# SPDX-License-Identifier: MIT
# What chai3d_drill says on its command line and where there is no device: cmake -D program=... -P check_program.cmake
set(name chai3d_drill)
set(environment)
include(${CMAKE_CURRENT_LIST_DIR}/../support/expect_program.cmake)

expect(0 "usage: chai3d_drill" --help)
expect(2 "--seconds takes a number" --seconds)
expect(2 "--seconds takes a number" --seconds nan)
expect(2 "--picture takes the name" --picture)
expect(2 "unknown argument 'drill'" drill)
