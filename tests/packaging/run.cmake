# SPDX-License-Identifier: MIT
# What the checks of packages share. They run in `work`, a folder that is made anew.
file(REMOVE_RECURSE ${work})
file(MAKE_DIRECTORY ${work})

# Runs a command and sets `output` to what it prints; ends the check with that if the command fails.
function(run)
  execute_process(COMMAND ${ARGN} WORKING_DIRECTORY ${work} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT status EQUAL 0)
    list(JOIN ARGN " " command)
    message(FATAL_ERROR "${command}\nended with ${status}:\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

# A package that only works where it was installed would name that place, or one of these.
function(check_relocatable package)
  file(GLOB_RECURSE package_files ${package}/*.cmake)
  foreach(file IN LISTS package_files)
    file(READ ${file} text)
    foreach(place IN LISTS ARGN)
      string(FIND "${text}" "${place}" at)
      if(NOT at EQUAL -1)
        message(FATAL_ERROR "${file} names ${place}: not relocatable")
      endif()
    endforeach()
  endforeach()
endfunction()
