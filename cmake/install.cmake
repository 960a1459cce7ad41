# SPDX-License-Identifier: MIT
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)

set(trephine_package_dir ${CMAKE_INSTALL_DATADIR}/cmake/trephine)
install(TARGETS trephine EXPORT trephineTargets FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(EXPORT trephineTargets NAMESPACE trephine:: DESTINATION ${trephine_package_dir})
# Headers have no word size: one installation serves every architecture. Before 1.0 a minor version may break callers.
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/trephineConfigVersion.cmake
                                 COMPATIBILITY SameMinorVersion ARCH_INDEPENDENT)
configure_file(cmake/trephineConfig.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/trephineConfig.cmake @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/trephineConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/trephineConfigVersion.cmake
        DESTINATION ${trephine_package_dir})
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/licenses/trephine)
