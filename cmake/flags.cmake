# Flags that every target shares. The numerical ones are part of the law of determinism: no contraction, no fast-math. Nobody
# reads errno or traps of arithmetic (after -fno-fast-math, which would reset it). GCC 12's superword vectoriser forgets the
# rounding of double -> float -> double within a function, so that two compilations of one formula may differ: it stays off.
# An unused function is an error: where files are compiled together, it may be one whose calls now find another file's.
add_library(ls_flags INTERFACE)
target_include_directories(ls_flags INTERFACE ${CMAKE_SOURCE_DIR})
target_compile_options(ls_flags INTERFACE
  -Wall -Wextra -Wpedantic -Wno-missing-field-initializers -Werror=unused-function -march=${LIGHTSHAFT_ARCH} -ffp-contract=off -fno-fast-math -fno-math-errno -fno-trapping-math -fno-tree-slp-vectorize)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(aarch64|arm64)$")
  target_compile_options(ls_flags INTERFACE -fsigned-char)  # as on x86
endif()
if(LIGHTSHAFT_ARCH STREQUAL "x86-64-v3" AND NOT LIGHTSHAFT_SANITIZE)
  # The loader, not a SIGILL in a static initialiser, tells the user that the CPU is too old.
  add_link_options(-Wl,-z,x86-64-v3)
endif()
if(LIGHTSHAFT_SANITIZE)
  # UndefinedBehaviorSanitizer does not check null pointers and object sizes, which AddressSanitizer traps when they are used,
  # nor virtual tables. It checks alignment, pointer arithmetic and null arguments only in targets with ls_reads_bytes: for all
  # targets, these checks would make one compile 1.4 times as long (docs/decisions/0025-files-compiled-together.md).
  # The options belong to the directory, not to ls_flags, so that the options of a target come later and override them.
  add_compile_options(-fsanitize=${LIGHTSHAFT_SANITIZE} -fno-sanitize=null,object-size,vptr
                      -fno-sanitize=alignment,pointer-overflow,nonnull-attribute,returns-nonnull-attribute
                      -fno-omit-frame-pointer -fno-sanitize-recover=all)
  target_link_options(ls_flags INTERFACE -fsanitize=${LIGHTSHAFT_SANITIZE})
  find_program(MOLD mold)
  if(MOLD)
    add_link_options(-fuse-ld=mold)
  endif()
endif()

# For the renderer's inner loops: no symbol is replaced at load time, so that calls within a file may be inlined although
# the code is position independent.
add_library(ls_hot_flags INTERFACE)
target_compile_options(ls_hot_flags INTERFACE -fno-semantic-interposition -fvisibility=hidden)

# Where CMAKE_UNITY_BUILD is on (the presets but dev and fuzz), all files of a target are compiled as one: most of a build's
# time is reading and instantiating the same headers again. The price: names in unnamed namespaces of one target may not
# clash. A target whose names do clash is compiled eight files at a time (ls_few_files_together).
# The renderer's loops stay by themselves, so that what is inlined into one file does not depend on its neighbours; in a
# sanitizer's build nobody counts instructions.
function(ls_each_file_by_itself target)
  if(NOT LIGHTSHAFT_SANITIZE)
    set_target_properties(${target} PROPERTIES UNITY_BUILD OFF)
  endif()
endfunction()
function(ls_few_files_together target)
  set_target_properties(${target} PROPERTIES UNITY_BUILD_BATCH_SIZE 8)
endfunction()

# Sanitizer builds compile at -O0, in half of the time that -O1 takes. Not so the libraries whose loops the tests wait for.
function(ls_optimise_under_sanitizers target)
  if(LIGHTSHAFT_SANITIZE)
    target_compile_options(${target} PRIVATE -O1)
  endif()
endfunction()

# For targets that read files of others through pointers to numbers: nothing but UndefinedBehaviorSanitizer finds a
# misaligned read. A test that compiles such sources itself needs it, too.
function(ls_reads_bytes target)
  if(LIGHTSHAFT_SANITIZE MATCHES undefined)
    target_compile_options(${target} PRIVATE -fsanitize=undefined -fno-sanitize=null,object-size,vptr)
  endif()
endfunction()

# Code that waits for people, disks and sockets: compiled at -O1 where the rest is at -O3, in two thirds of the time.
function(ls_seldom_run target)
  if(CMAKE_BUILD_TYPE STREQUAL "Release")
    target_compile_options(${target} PRIVATE -O1)
  endif()
endfunction()

# ls_library(NAME [SOURCES files...] [LINK libs...]): a static library of all .cpp files in this folder and its subfolders.
function(ls_library name)
  cmake_parse_arguments(ARG "" "" "LINK;SOURCES" ${ARGN})
  if(NOT ARG_SOURCES)
    file(GLOB ARG_SOURCES CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp ${CMAKE_CURRENT_SOURCE_DIR}/*/*.cpp)
  endif()
  if(ARG_SOURCES)
    add_library(${name} STATIC ${ARG_SOURCES})
    target_link_libraries(${name} PUBLIC ls_flags ${ARG_LINK})
  else()
    add_library(${name} INTERFACE)
    target_link_libraries(${name} INTERFACE ls_flags ${ARG_LINK})
  endif()
endfunction()

# ls_test(NAME [LOOPS] [BOTH] [SANITIZED filter] [LINK libs...] [LABELS labels...]): a GoogleTest binary of all *_test.cpp files in this folder and its subfolders.
# LOOPS: the tests' own loops take most of their time. The target tests-LABEL builds all tests of a label. Unit tests that a
# whole test run asks under AddressSanitizer (asan) are not asked again in the release build, which has the label `release`
# for the others, unless BOTH: what they test is arithmetic, which depends on how it was optimised. SANITIZED: the
# GoogleTest filter of the tests that a sanitizer build runs; the loops of the others would take minutes there.
function(ls_test name)
  cmake_parse_arguments(ARG "LOOPS;BOTH" "SANITIZED" "LINK;LABELS;SOURCES" ${ARGN})
  if("unit" IN_LIST ARG_LABELS AND (ARG_BOTH OR NOT "asan" IN_LIST ARG_LABELS))
    list(APPEND ARG_LABELS release)
  endif()
  if(NOT ARG_SOURCES)
    file(GLOB ARG_SOURCES CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/*/*_test.cpp)
  endif()
  if(ARG_SOURCES)
    add_executable(${name} ${ARG_SOURCES})
    target_link_libraries(${name} PRIVATE ${ARG_LINK} GTest::gtest_main GTest::gmock ls_flags)
    # What is tested keeps its own flags. A test's own code is compiled at -O0, in three quarters of the time of -O1.
    if(ARG_LOOPS AND NOT LIGHTSHAFT_SANITIZE)
      target_compile_options(${name} PRIVATE -O1)
    else()
      target_compile_options(${name} PRIVATE -O0)
    endif()
    if(LIGHTSHAFT_SANITIZE MATCHES undefined)
      target_compile_options(${name} PRIVATE -fno-sanitize=undefined)  # of the tests' own code; a third of its compile time
    endif()
    set(filter)
    if(ARG_SANITIZED AND LIGHTSHAFT_SANITIZE)
      set(filter "--gtest_filter=${ARG_SANITIZED}")
    endif()
    add_test(NAME ${name} COMMAND ${name} ${filter})
    set_tests_properties(${name} PROPERTIES LABELS "${ARG_LABELS}" TIMEOUT 3600)
    foreach(label ${ARG_LABELS})
      if(NOT TARGET tests-${label})
        add_custom_target(tests-${label})
      endif()
      add_dependencies(tests-${label} ${name})
    endforeach()
  endif()
endfunction()
