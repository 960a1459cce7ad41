# SPDX-License-Identifier: MIT
# What robot_bridge says on its command line: cmake -D program=... -P check_program.cmake
set(name robot_bridge)
set(environment)
include(${CMAKE_CURRENT_LIST_DIR}/../support/expect_program.cmake)

expect(0 "usage: robot_bridge" --help)
expect(0 "listens at 127.0.0.1:[1-9]" --port 0 --seconds 0.1)
expect(0 "listens at 0.0.0.0:.*beware" --port 0 --address 0.0.0.0 --seconds 0.1)
expect(2 "unknown option '--adress'" --adress 127.0.0.1)
expect(2 "--address: 'localhost' is no IPv4 address" --address localhost)
expect(2 "--address: '::1' is no IPv4 address" --address ::1)
expect(2 "--port: '65536' is not a number from 0 to 65535" --port 65536)
expect(2 "--port: '1.5' is not a whole number" --port 1.5)
expect(2 "--seconds: 'nan' is not a number from 0.1 to 86400" --seconds nan)
expect(2 "--simulate needs a value" --simulate)
expect(2 "--simulate is for a loopback address" --simulate 1 --address 0.0.0.0)
expect(1 "bind: Cannot assign requested address" --address 192.0.2.1 --seconds 0.1)
