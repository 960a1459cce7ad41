# SPDX-License-Identifier: MIT
# No symbol of an object file names one of these.
#   cmake -D nm=NM -D object=FILE "-D names=A;B" -P no_symbols.cmake
cmake_policy(VERSION 3.24)
execute_process(COMMAND ${nm} -C ${object} OUTPUT_VARIABLE symbols COMMAND_ERROR_IS_FATAL ANY)
if(NOT symbols MATCHES "tick")
  message(FATAL_ERROR "${object} has no tick in it")
endif()
foreach(name IN LISTS names)
  # As a type or function of the library's, with what may follow a name.
  if(symbols MATCHES "trephine::(aligned_[0-9]+::)?(detail::)?${name}[<:( ]")
    message(SEND_ERROR "${object} has symbols of ${name}")
  endif()
endforeach()
