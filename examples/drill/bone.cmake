# SPDX-License-Identifier: MIT
# What reads, makes and looks over the bone, as a library: the drill and other programs of this project use it.
include_guard(GLOBAL)

set(bone_folder ${CMAKE_CURRENT_LIST_DIR})
add_library(drill_bone STATIC)
foreach(part bone read_bone skull_file spot structure_labels temporal_bone)
  target_sources(drill_bone PRIVATE ${bone_folder}/${part}.cpp)
endforeach()
trephine_own_target(drill_bone)
set_target_properties(drill_bone PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 0)
target_include_directories(drill_bone PUBLIC ${bone_folder})
target_link_libraries(drill_bone PUBLIC trephine::trephine)
# read_itk.cpp includes ITK's headers, so it is only compiled where there are any.
if(TARGET trephine::itk)
  target_sources(drill_bone PRIVATE ${bone_folder}/read_itk.cpp)
  target_compile_definitions(drill_bone PUBLIC TREPHINE_EXAMPLE_HAS_ITK)
  target_link_libraries(drill_bone PRIVATE trephine::itk)
endif()
