# SPDX-License-Identifier: MIT
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)

set(trephine_package_dir ${CMAKE_INSTALL_DATADIR}/cmake/trephine)
install(TARGETS trephine EXPORT trephineTargets FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(EXPORT trephineTargets NAMESPACE trephine:: DESTINATION ${trephine_package_dir})
# Headers have no word size: without the library one installation serves every architecture.
set(trephine_arch ARCH_INDEPENDENT)
if(TREPHINE_BUILD_COMPILED)
  set(trephine_arch)
  install(TARGETS trephine_compiled EXPORT trephineCompiledTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
  install(EXPORT trephineCompiledTargets NAMESPACE trephine:: DESTINATION ${trephine_package_dir})
endif()
# Before 1.0 a minor version may break callers.
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/trephineConfigVersion.cmake
                                 COMPATIBILITY SameMinorVersion ${trephine_arch})
configure_file(cmake/trephineConfig.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/trephineConfig.cmake @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/trephineConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/trephineConfigVersion.cmake
        DESTINATION ${trephine_package_dir})
install(FILES cmake/itk.cmake DESTINATION ${trephine_package_dir} RENAME trephineItk.cmake)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/licenses/trephine)

# For builds without CMake. It finds the headers from its own place, unless the folders asked for are absolute.
set(trephine_pc_dir ${CMAKE_INSTALL_DATADIR}/pkgconfig)
if(IS_ABSOLUTE "${CMAKE_INSTALL_DATADIR}" OR IS_ABSOLUTE "${CMAKE_INSTALL_INCLUDEDIR}")
  set(trephine_pc_prefix ${CMAKE_INSTALL_PREFIX})
  set(trephine_pc_includedir ${CMAKE_INSTALL_FULL_INCLUDEDIR})
else()
  file(RELATIVE_PATH trephine_pc_prefix /${trephine_pc_dir} /)
  string(REGEX REPLACE "/$" "" trephine_pc_prefix "\${pcfiledir}/${trephine_pc_prefix}")
  set(trephine_pc_includedir "\${prefix}/${CMAKE_INSTALL_INCLUDEDIR}")
endif()
configure_file(cmake/packaging/trephine.pc.in ${CMAKE_CURRENT_BINARY_DIR}/trephine.pc @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/trephine.pc DESTINATION ${trephine_pc_dir})
