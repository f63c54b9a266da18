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
  find_package(PkgConfig REQUIRED)
  # By pkg-config: the package file of Debian's libturbojpeg0-dev also names libjpeg62-turbo,
  # which it does not install.
  pkg_check_modules(turbojpeg REQUIRED IMPORTED_TARGET libturbojpeg)
  pkg_check_modules(webp REQUIRED IMPORTED_TARGET libwebp)
endmacro()

# Flags that every file of this project is compiled with; not exported.
add_library(porthole_flags INTERFACE)
target_compile_options(porthole_flags INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -Wno-missing-field-initializers
                       $<$<BOOL:${PORTHOLE_WERROR}>:-Werror> -ffp-contract=off -mavx2 -mno-fma
                       -fno-semantic-interposition)
if(PORTHOLE_SANITIZE)
  target_compile_options(porthole_flags INTERFACE -fsanitize=${PORTHOLE_SANITIZE} -fno-omit-frame-pointer
                         -fno-sanitize-recover=all
                         -Wno-maybe-uninitialized) # GCC 12 sees it in std::regex, under sanitizers only
  target_link_options(porthole_flags INTERFACE -fsanitize=${PORTHOLE_SANITIZE})
  if(PORTHOLE_SANITIZE MATCHES thread)
    target_link_options(porthole_flags INTERFACE
      "$<$<STREQUAL:$<TARGET_PROPERTY:TYPE>,EXECUTABLE>:-Wl,--version-script=${CMAKE_CURRENT_LIST_DIR}/executable.map>")
  endif()
endif()

# porthole_folder(NAME [SOURCES ...] [FOLDERS porthole folders it includes] [LIBRARIES ...])
# One folder of src/porthole as an object library, so that a test can link a folder and what
# lies under it and nothing else.
function(porthole_folder name)
  cmake_parse_arguments(arg "" "" "SOURCES;FOLDERS;LIBRARIES" ${ARGN})
  add_library(porthole_${name} OBJECT ${arg_SOURCES})
  set_target_properties(porthole_${name} PROPERTIES POSITION_INDEPENDENT_CODE ON)
  target_include_directories(porthole_${name} PUBLIC ${PROJECT_SOURCE_DIR}/src)
  set_property(GLOBAL APPEND PROPERTY PORTHOLE_FOLDERS porthole_${name})
  set_property(GLOBAL APPEND PROPERTY PORTHOLE_LIBRARIES ${arg_LIBRARIES})
  list(TRANSFORM arg_FOLDERS PREPEND porthole_)
  target_link_libraries(porthole_${name} PUBLIC ${arg_FOLDERS} ${arg_LIBRARIES} PRIVATE $<BUILD_INTERFACE:porthole_flags>)
endfunction()

# porthole_library(HEADERS ...)
# The one library that users link: the objects of every porthole_folder before it. What they
# link is private: the installed shared library needs nothing but the given headers.
function(porthole_library)
  cmake_parse_arguments(arg "" "" "HEADERS" ${ARGN})
  get_property(folders GLOBAL PROPERTY PORTHOLE_FOLDERS)
  get_property(libraries GLOBAL PROPERTY PORTHOLE_LIBRARIES)
  list(REMOVE_DUPLICATES libraries)
  list(FILTER libraries EXCLUDE REGEX "^nlohmann_json") # headers only: nothing to link

  add_library(porthole)
  add_library(porthole::porthole ALIAS porthole)
  foreach(folder ${folders})
    target_sources(porthole PRIVATE $<TARGET_OBJECTS:${folder}>)
  endforeach()
  target_sources(porthole PUBLIC FILE_SET HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR}/src FILES ${arg_HEADERS})
  target_compile_features(porthole PUBLIC cxx_std_20)
  target_link_libraries(porthole PRIVATE ${libraries} $<BUILD_INTERFACE:porthole_flags>)
  set_target_properties(porthole PROPERTIES LINKER_LANGUAGE CXX VERSION ${PROJECT_VERSION}
                        SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
  if(PORTHOLE_INSTALL)
    porthole_install()
  endif()
endfunction()

# Installs the library and its headers, and the package that find_package(porthole) finds.
function(porthole_install)
  include(GNUInstallDirs)
  include(CMakePackageConfigHelpers)
  set(package ${CMAKE_INSTALL_LIBDIR}/cmake/porthole)
  install(TARGETS porthole EXPORT porthole-targets FILE_SET HEADERS)
  install(EXPORT porthole-targets NAMESPACE porthole:: DESTINATION ${package})
  get_target_property(PORTHOLE_LIBRARY_TYPE porthole TYPE)
  configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/porthole-config.cmake.in
                                ${PROJECT_BINARY_DIR}/porthole-config.cmake INSTALL_DESTINATION ${package})
  write_basic_package_version_file(${PROJECT_BINARY_DIR}/porthole-config-version.cmake
                                   COMPATIBILITY SameMinorVersion)
  install(FILES ${PROJECT_BINARY_DIR}/porthole-config.cmake ${PROJECT_BINARY_DIR}/porthole-config-version.cmake
          DESTINATION ${package})
  install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
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
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR}/tests)
  target_compile_definitions(${name} PRIVATE PORTHOLE_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  target_link_libraries(${name} PRIVATE ${arg_LIBRARIES} porthole_flags GTest::gtest GTest::gtest_main)
  add_test(NAME ${name} COMMAND ${name})
  set_tests_properties(${name} PROPERTIES LABELS "${arg_LABELS}" TIMEOUT 1200)
endfunction()
