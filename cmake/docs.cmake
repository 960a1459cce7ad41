# SPDX-License-Identifier: MIT
# The target `docs`: the reference of the public headers, in docs/html of the build folder. Not part of `all`.
find_program(TREPHINE_DOXYGEN doxygen)
mark_as_advanced(TREPHINE_DOXYGEN)
if(TREPHINE_DOXYGEN)
  configure_file(cmake/Doxyfile.in ${CMAKE_CURRENT_BINARY_DIR}/Doxyfile @ONLY)
  file(MAKE_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}/docs)
  add_custom_target(docs COMMAND ${TREPHINE_DOXYGEN} ${CMAKE_CURRENT_BINARY_DIR}/Doxyfile VERBATIM)
endif()
