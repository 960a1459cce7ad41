# SPDX-License-Identifier: MIT
# Figures of documents that a simulated run finds anew, on any machine:
#   cmake -D program=DRILL -D collect=COMMAND -D out=FOLDER -D skull=FOLDER -P figures_now.cmake
# The temporal bone is made by formulas. The skull is drilled where examples/run has fetched it.
function(find_anew sources)
  execute_process(COMMAND ${program} --no-pictures ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE said ERROR_VARIABLE said)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "drill ${ARGN}: ${said}")
  endif()
  execute_process(COMMAND ${collect} ${sources} RESULT_VARIABLE result ERROR_VARIABLE said)
  if(NOT result EQUAL 0)
    message(SEND_ERROR "${said}If the new figures are right, write them with --write in place of --check, and then the documents'.")
  endif()
endfunction()

find_anew(temporal=${out}/temporal --phantom temporal --structures --out ${out}/temporal)
if(EXISTS ${skull}/main.plist)
  find_anew(drill=${out}/skull --skull ${skull} --out ${out}/skull)
  find_anew(structures=${out}/spared --skull ${skull} --structures --out ${out}/spared)
else()
  message(STATUS "no skull in ${skull}: examples/run fetches it, and then its figures are found anew too")
endif()
