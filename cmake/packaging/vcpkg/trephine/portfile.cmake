# SPDX-License-Identifier: MIT
# An overlay port of the sources that it lies in:
#   vcpkg install trephine --overlay-ports=cmake/packaging/vcpkg
get_filename_component(SOURCE_PATH "${CMAKE_CURRENT_LIST_DIR}/../../../.." ABSOLUTE)
set(VCPKG_BUILD_TYPE release) # headers only

vcpkg_cmake_configure(
  SOURCE_PATH "${SOURCE_PATH}" OPTIONS -DTREPHINE_BUILD_TESTS=OFF -DTREPHINE_BUILD_EXAMPLES=OFF
                                       -DTREPHINE_BUILD_BENCH=OFF -DTREPHINE_INSTALL=ON
)
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(CONFIG_PATH share/cmake/trephine)
vcpkg_fixup_pkgconfig()
# vcpkg wants the licence in a place of its own and no folders that stay empty.
file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/share/licenses" "${CURRENT_PACKAGES_DIR}/share/cmake"
     "${CURRENT_PACKAGES_DIR}/lib"
)
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE")
