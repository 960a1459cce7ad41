# SPDX-License-Identifier: MIT
# A session on the built-in tooth in a virtual screen: drilled by a script, recorded, and played again.
#   cmake -D program=... -D folder=... -D screen=xvfb-run -P check_session.cmake
function(play pattern)
  execute_process(
    COMMAND ${screen} -a -s "-screen 0 1024x768x24 -noreset" ${program} --size 320x240 --debug ${ARGN} WORKING_DIRECTORY ${folder}
    RESULT_VARIABLE result OUTPUT_VARIABLE out ERROR_VARIABLE err TIMEOUT 280
  )
  if(NOT result EQUAL 0 OR NOT out MATCHES "${pattern}")
    message(SEND_ERROR "live ${ARGN}: exit code ${result}, says '${out}${err}', expected ${pattern}")
  endif()
endfunction()

file(REMOVE ${folder}/before.png ${folder}/after.png ${folder}/recorded.session)
file(WRITE ${folder}/drill.session "# approach, drill, look
0.2 shot before.png
0.4 push 3
1.0 spindle on
1.2 push 1.5
2.4 push 1.5
3.4 spindle off
3.5 push -6
4.0 size 400 300
4.3 shot after.png
4.5 quit
")
play("drilled  [1-9][0-9.]* mm3" --script ${folder}/drill.session --record ${folder}/recorded.session)
foreach(picture before after)
  if(NOT EXISTS ${folder}/${picture}.png)
    message(SEND_ERROR "no ${picture}.png")
  endif()
endforeach()
file(STRINGS ${folder}/recorded.session last REGEX " quit$")
if(NOT last)
  message(SEND_ERROR "recorded.session does not say when the session ended")
endif()
play("drilled  [1-9][0-9.]* mm3" --script ${folder}/recorded.session)

# Structures: the drill takes of them, or with the veto does not; protection is recorded.
file(REMOVE ${folder}/protected.session)
file(WRITE ${folder}/protect.session "0.2 protect off
0.4 push 3
1.0 spindle on
1.2 push 3
2.4 push 3
3.6 push 3
4.6 spindle off
4.7 log
4.8 key Backspace
4.9 protect veto
6.5 quit
")
play("off  nearest -?[0-9.]+ mm to the [a-z]+.*nearest +-?[0-9.]+ mm, to the [a-z]+" --structures --script ${folder}/protect.session --record
     ${folder}/protected.session
)
file(STRINGS ${folder}/protected.session lines REGEX "protect (off|veto)")
list(LENGTH lines count)
if(NOT count EQUAL 2)
  message(SEND_ERROR "recorded: '${lines}', expected two protections")
endif()
