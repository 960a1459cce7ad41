# SPDX-License-Identifier: MIT
# Target trephine_robots: what the bridge is built with, where Boost's headers and nlohmann-json are installed.
include_guard(GLOBAL)
find_path(TREPHINE_BOOST_INCLUDE boost/asio/ip/udp.hpp)
find_path(TREPHINE_NLOHMANN_INCLUDE nlohmann/json.hpp)
mark_as_advanced(TREPHINE_BOOST_INCLUDE TREPHINE_NLOHMANN_INCLUDE)
if(NOT TREPHINE_BOOST_INCLUDE OR NOT TREPHINE_NLOHMANN_INCLUDE)
  return()
endif()
find_package(Threads REQUIRED)
add_library(trephine_robots INTERFACE)
target_include_directories(trephine_robots SYSTEM INTERFACE ${TREPHINE_BOOST_INCLUDE} ${TREPHINE_NLOHMANN_INCLUDE})
target_link_libraries(trephine_robots INTERFACE trephine::trephine Threads::Threads "$<$<PLATFORM_ID:Windows>:ws2_32;mswsock>")
