# The C library's mathematical functions, linked into the programs from its archive where that is possible: programs then give
# the same bits on systems whose shared library rounds otherwise (cmake/libm.sh). Sanitizers watch the shared library's functions.
if(LIGHTSHAFT_ARCH MATCHES "^x86-64-v[34]$" AND NOT LIGHTSHAFT_SANITIZE AND NOT LIGHTSHAFT_FUZZ AND NOT CMAKE_CROSSCOMPILING)
  execute_process(COMMAND ${CMAKE_CXX_COMPILER} -print-file-name=libm.a OUTPUT_VARIABLE libm OUTPUT_STRIP_TRAILING_WHITESPACE)
  set(own_libm ${CMAKE_BINARY_DIR}/libls_m.a)
  execute_process(COMMAND ${CMAKE_CURRENT_LIST_DIR}/libm.sh ${libm} ${own_libm} ${CMAKE_NM} ${CMAKE_OBJCOPY} ${CMAKE_AR} ${CMAKE_C_COMPILER}
                  RESULT_VARIABLE failed ERROR_VARIABLE why)
  if(failed)
    message(WARNING "Programs take mathematical functions from the system that they run on, and may render other bits there: ${why}")
  else()
    target_link_libraries(ls_flags INTERFACE ${own_libm})
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${CMAKE_CURRENT_LIST_DIR}/libm.sh ${libm})
  endif()
endif()
