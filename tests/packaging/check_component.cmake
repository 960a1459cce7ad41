# SPDX-License-Identifier: MIT
# Builds and runs `component`_consumer/ against an installed and then moved package with that component, and configures
# it against this folder. `option` is what makes the component. A library is the one that `archive_dir` holds: built
# once, for all tests.
cmake_policy(VERSION 3.24)
include(${CMAKE_CURRENT_LIST_DIR}/run.cmake)

set(common -G ${generator} -D CMAKE_BUILD_TYPE=None -D CMAKE_C_COMPILER=${CC} -D CMAKE_CXX_COMPILER=${CXX}
           -D CMAKE_CXX_FLAGS=${CXX_FLAGS})
if(archive_dir)
  set(archive -D CMAKE_ARCHIVE_OUTPUT_DIRECTORY=${archive_dir})
endif()
if(Eigen3_DIR)
  list(APPEND common -D Eigen3_DIR=${Eigen3_DIR})
endif()
run(${CMAKE_COMMAND} -S ${source} -B ${work}/trephine ${common} -D ${option}=ON -D TREPHINE_BUILD_TESTS=OFF
    -D TREPHINE_BUILD_EXAMPLES=OFF -D TREPHINE_BUILD_BENCH=OFF ${archive})
run(${CMAKE_COMMAND} --install ${work}/trephine --prefix ${work}/installed)
file(RENAME ${work}/installed ${work}/moved)
check_relocatable(${work}/moved ${source} ${work} ${archive_dir})

set(consumer ${source}/tests/packaging/${component}_consumer)
run(${CMAKE_COMMAND} -S ${consumer} -B ${work}/build ${common} -D version=${version} -D CMAKE_PREFIX_PATH=${work}/moved)
run(${CMAKE_COMMAND} --build ${work}/build)
run(${work}/build/${component}_consumer)
if(NOT output MATCHES "N, [0-9.e+-]+ mm3" OR output MATCHES "nan")
  message(FATAL_ERROR "the consumer says: ${output}")
endif()

run(${CMAKE_COMMAND} -S ${consumer} -B ${work}/added ${common} -D trephine_source=${source})
