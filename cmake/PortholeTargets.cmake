# Dependencies (each missing one names its Debian package) and the helpers of this project.

macro(porthole_require package debian)
  find_package(${package} QUIET)
  if(NOT ${package}_FOUND)
    message(FATAL_ERROR "porthole needs ${package}: apt-get install ${debian} (or run scripts/install-deps)")
  endif()
endmacro()

macro(porthole_find_dependencies)
  porthole_require(embree libembree-dev)
  porthole_require(Threads libc6-dev)
  porthole_require(nlohmann_json nlohmann-json3-dev)
  porthole_require(draco libdraco-dev)
  porthole_require(meshoptimizer libmeshoptimizer-dev)
  porthole_require(PNG libpng-dev)
  porthole_require(libjpeg-turbo libturbojpeg0-dev)
  find_package(PkgConfig REQUIRED)
  pkg_check_modules(webp REQUIRED IMPORTED_TARGET libwebp)
endmacro()

# Flags that every file of this project is compiled with; not exported.
add_library(porthole_flags INTERFACE)
target_compile_options(porthole_flags INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion
                       $<$<BOOL:${PORTHOLE_WERROR}>:-Werror> -ffp-contract=off -mavx2 -mno-fma)
if(PORTHOLE_SANITIZE)
  target_compile_options(porthole_flags INTERFACE -fsanitize=${PORTHOLE_SANITIZE} -fno-omit-frame-pointer
                         -fno-sanitize-recover=all)
  target_link_options(porthole_flags INTERFACE -fsanitize=${PORTHOLE_SANITIZE})
endif()

# porthole_folder(NAME [SOURCES ...] [FOLDERS porthole folders it includes] [LIBRARIES ...])
# One folder of src/porthole as an object library, so that a test can link a folder and what
# lies under it and nothing else.
function(porthole_folder name)
  cmake_parse_arguments(arg "" "" "SOURCES;FOLDERS;LIBRARIES" ${ARGN})
  add_library(porthole_${name} OBJECT ${arg_SOURCES})
  set_target_properties(porthole_${name} PROPERTIES POSITION_INDEPENDENT_CODE ON)
  target_include_directories(porthole_${name} PUBLIC ${PROJECT_SOURCE_DIR}/src)
  list(TRANSFORM arg_FOLDERS PREPEND porthole_)
  target_link_libraries(porthole_${name} PUBLIC ${arg_FOLDERS} ${arg_LIBRARIES} PRIVATE $<BUILD_INTERFACE:porthole_flags>)
endfunction()

# porthole_test(NAME SOURCES ... [FOLDERS ...] [LIBRARIES ...] [LABELS ...])
# A GoogleTest program that links the given folders only (folders name each other's objects
# through LIBRARIES porthole for a test of the whole library).
function(porthole_test name)
  cmake_parse_arguments(arg "" "" "SOURCES;FOLDERS;LIBRARIES;LABELS" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  foreach(folder ${arg_FOLDERS})
    target_sources(${name} PRIVATE $<TARGET_OBJECTS:porthole_${folder}>)
    target_link_libraries(${name} PRIVATE porthole_${folder})
  endforeach()
  target_link_libraries(${name} PRIVATE ${arg_LIBRARIES} porthole_flags GTest::gtest GTest::gtest_main)
  add_test(NAME ${name} COMMAND ${name})
  set_tests_properties(${name} PROPERTIES LABELS "${arg_LABELS}" TIMEOUT 1200)
endfunction()
