# SPDX-License-Identifier: MIT
# What the program says on its command line: cmake -D program=... -P check_program.cmake
set(name force_dimension_drill)
set(environment)
include(${CMAKE_CURRENT_LIST_DIR}/../support/expect_program.cmake)

expect(0 "not affiliated.*--device NAME.*--seconds S" --help)
expect(2 "unknown option '--sekonds'" --sekonds 3)
expect(2 "--seconds needs a value" --seconds)
expect(2 "'soon' is not a number from 0.1 to 86400" --seconds soon)
expect(2 "'nan' is not a number" --seconds nan)
expect(2 "--device needs a value" --device)
expect(2 "--device needs a value" --device "")
expect(1 "cannot open device 'delta.3'. there is omega.3, omega.6, sigma.7, lambda.7, lambda.7 left" --device delta.3)
