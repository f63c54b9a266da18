# cmake -D TYPE=static|shared ... -P check_package.cmake: see CMakeLists.txt beside it.
cmake_minimum_required(VERSION 3.25)

function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE code OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT code EQUAL 0)
    list(JOIN ARGN " " command)
    message(FATAL_ERROR "${command}\nended with ${code}:\n${output}")
  endif()
endfunction()

set(library_build ${BUILD})
if(NOT (TYPE STREQUAL "static" AND STATIC_BUILD))
  set(library_build ${WORK}/library)
  if(TYPE STREQUAL "shared")
    set(shared ON)
  else()
    set(shared OFF)
  endif()
  run(${CMAKE_COMMAND} -S ${SOURCE} -B ${library_build} -G ${GENERATOR} -D CMAKE_BUILD_TYPE=Debug
      -D BUILD_SHARED_LIBS=${shared} -D PORTHOLE_BUILD_APPS=OFF -D PORTHOLE_BUILD_TESTS=OFF
      -D CMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER})
  run(${CMAKE_COMMAND} --build ${library_build} --parallel 2)
endif()

# A new prefix and a new build each time: nothing left over can stand in for what is missing.
file(REMOVE_RECURSE ${WORK}/prefix ${WORK}/user)
run(${CMAKE_COMMAND} --install ${library_build} --prefix ${WORK}/prefix)

set(options -D CHECK_HEADERS=ON)
if(TYPE STREQUAL "shared")
  set(options "")
  foreach(package embree TBB draco meshoptimizer PNG nlohmann_json PkgConfig)
    list(APPEND options -D CMAKE_DISABLE_FIND_PACKAGE_${package}=ON)
  endforeach()
endif()
run(${CMAKE_COMMAND} -S ${SOURCE}/tests/package/user -B ${WORK}/user -G ${GENERATOR}
    -D CMAKE_BUILD_TYPE=Debug -D CMAKE_PREFIX_PATH=${WORK}/prefix ${options})
run(${CMAKE_COMMAND} --build ${WORK}/user)
run(${WORK}/user/user ${SOURCE}/examples/gearbox/gearbox.glb)
