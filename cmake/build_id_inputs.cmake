# build_id_inputs(RESULT ROOT [CONFIGURE_DEPENDS]): the files that decide a sample's bits.
function(build_id_inputs result root)
  file(GLOB_RECURSE sources ${ARGN} ${root}/core/*.h ${root}/core/*.cpp ${root}/worker/render/*.h ${root}/worker/render/*.cpp)
  file(GLOB_RECURSE lists ${ARGN} ${root}/core/CMakeLists.txt ${root}/worker/render/CMakeLists.txt)
  file(GLOB flags ${ARGN} ${root}/CMakeLists.txt ${root}/worker/CMakeLists.txt ${root}/cmake/*.cmake ${root}/cmake/*.sh)
  set(${result} ${sources} ${lists} ${flags} PARENT_SCOPE)
endfunction()
