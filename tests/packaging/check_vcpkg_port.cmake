# SPDX-License-Identifier: MIT
# Runs the vcpkg port with plain CMake in place of vcpkg's own functions: that its files are where it says, that it
# configures and installs, and what the package then holds. vcpkg itself is not needed.
cmake_policy(VERSION 3.24)
set(port ${source}/cmake/packaging/vcpkg/trephine)
file(READ ${port}/vcpkg.json json)
string(JSON port_version GET "${json}" version-semver)
string(JSON port_name GET "${json}" name)
if(NOT port_version STREQUAL version OR NOT port_name STREQUAL "trephine")
  message(FATAL_ERROR "vcpkg.json is of ${port_name} ${port_version}, expected trephine ${version}")
endif()

set(CURRENT_PACKAGES_DIR ${work}/packages)
function(vcpkg_cmake_configure)
  cmake_parse_arguments(PARSE_ARGV 0 arg "" "SOURCE_PATH" "OPTIONS")
  execute_process(COMMAND ${CMAKE_COMMAND} -S ${arg_SOURCE_PATH} -B ${work}/build -G ${generator}
                          -D CMAKE_C_COMPILER=${CC} -D CMAKE_CXX_COMPILER=${CXX} -D Eigen3_DIR=${Eigen3_DIR}
                          -D CMAKE_INSTALL_PREFIX=${CURRENT_PACKAGES_DIR} ${arg_OPTIONS}
                  OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
endfunction()
function(vcpkg_cmake_install)
  execute_process(COMMAND ${CMAKE_COMMAND} --build ${work}/build --target install OUTPUT_QUIET
                  COMMAND_ERROR_IS_FATAL ANY)
endfunction()
function(vcpkg_cmake_config_fixup)
  cmake_parse_arguments(PARSE_ARGV 0 arg "" "CONFIG_PATH" "")
  file(RENAME ${CURRENT_PACKAGES_DIR}/${arg_CONFIG_PATH} ${CURRENT_PACKAGES_DIR}/share/trephine)
endfunction()
function(vcpkg_fixup_pkgconfig)
endfunction()
function(vcpkg_install_copyright)
  cmake_parse_arguments(PARSE_ARGV 0 arg "" "" "FILE_LIST")
  file(COPY_FILE ${arg_FILE_LIST} ${CURRENT_PACKAGES_DIR}/share/trephine/copyright)
endfunction()

file(REMOVE_RECURSE ${work})
include(${port}/portfile.cmake)
file(GLOB top RELATIVE ${CURRENT_PACKAGES_DIR} ${CURRENT_PACKAGES_DIR}/*)
file(GLOB shared RELATIVE ${CURRENT_PACKAGES_DIR}/share ${CURRENT_PACKAGES_DIR}/share/*)
file(GLOB packaged RELATIVE ${CURRENT_PACKAGES_DIR}/share/trephine ${CURRENT_PACKAGES_DIR}/share/trephine/*)
set(expected copyright trephineConfig.cmake trephineConfigVersion.cmake trephineItk.cmake trephineTargets.cmake)
if(NOT top STREQUAL "include;share" OR NOT shared STREQUAL "pkgconfig;trephine" OR NOT packaged STREQUAL expected
   OR NOT EXISTS ${CURRENT_PACKAGES_DIR}/include/trephine/trephine.hpp)
  message(FATAL_ERROR "the package holds: ${top}; in share: ${shared}; in share/trephine: ${packaged}")
endif()
