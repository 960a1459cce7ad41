# SPDX-License-Identifier: MIT
# What the program says on its command line: cmake -D program=... -P check_program.cmake
set(name openhaptics_drill)
set(environment)
include(${CMAKE_CURRENT_LIST_DIR}/../support/expect_program.cmake)

expect(0 "usage: .*--seconds S.*not affiliated|not affiliated.*--seconds S" --help)
expect(2 "unknown option '--sekonds'" --sekonds 3)
expect(2 "--seconds needs a value" --seconds)
expect(2 "'soon' is not a number from 0.1 to 86400" --seconds soon)
expect(2 "'nan' is not a number" --seconds nan)
expect(2 "'0' is not a number from 0.05 to 2" --scale 0)
expect(2 "'both' is none of line, surface and coupled" --algorithm both)
expect(2 "--tool: .*round-0.6 to 7, diamond-0.6 to 7, match-head-1.5 to 5, .*reamer-4 to 14, got nail-3" --tool nail-3)
expect(2 "use --algorithm coupled" --tool disc-6 --algorithm line)
expect(2 "--device needs a value" --device)
expect(1 "main.plist: cannot be opened" --skull /nonexistent)
expect(1 "cannot open device 'No such device': .*cable" --device "No such device")
