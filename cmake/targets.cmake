# Two precompiled headers, each compiled once: what half of all sources include, and the same with GoogleTest.
# All code is position-independent in one way, so that libraries and programs share them.
add_library(telesplat_common_headers STATIC ${PROJECT_SOURCE_DIR}/cmake/common_headers.cpp)
target_link_libraries(telesplat_common_headers PUBLIC spdlog::spdlog fmt::fmt glm::glm)
if(TELESPLAT_PCH)
  target_precompile_headers(telesplat_common_headers PRIVATE ${PROJECT_SOURCE_DIR}/cmake/common_headers.h)
endif()
if(TELESPLAT_TESTS)
  add_library(telesplat_test_headers STATIC EXCLUDE_FROM_ALL ${PROJECT_SOURCE_DIR}/cmake/common_headers.cpp)
  target_include_directories(telesplat_test_headers PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(telesplat_test_headers PUBLIC spdlog::spdlog fmt::fmt glm::glm GTest::gtest)
  target_compile_options(telesplat_test_headers PRIVATE ${TELESPLAT_TEST_FLAGS})
  if(TELESPLAT_PCH)
    target_precompile_headers(telesplat_test_headers PRIVATE ${PROJECT_SOURCE_DIR}/cmake/test_headers.h)
  endif()
endif()

# telesplat_headers(TARGET common|test): compiles TARGET with a precompiled header
function(telesplat_headers target which)
  target_link_libraries(${target} PRIVATE spdlog::spdlog fmt::fmt glm::glm)
  if(TELESPLAT_PCH)
    target_precompile_headers(${target} REUSE_FROM telesplat_${which}_headers)
  endif()
endfunction()

# telesplat_library(NAME sources... [DEPS targets...] [PRIVATE_DEPS targets...])
#   static library telesplat_NAME, alias telesplat::NAME; headers are included from the repository's root.
function(telesplat_library name)
  cmake_parse_arguments(ARG "" "" "DEPS;PRIVATE_DEPS" ${ARGN})
  if(ARG_UNPARSED_ARGUMENTS)
    add_library(telesplat_${name} STATIC ${ARG_UNPARSED_ARGUMENTS})
    target_include_directories(telesplat_${name} PUBLIC ${PROJECT_SOURCE_DIR})
    target_link_libraries(telesplat_${name} PUBLIC ${ARG_DEPS} PRIVATE ${ARG_PRIVATE_DEPS})
    telesplat_headers(telesplat_${name} common)
  else()
    add_library(telesplat_${name} INTERFACE)
    target_include_directories(telesplat_${name} INTERFACE ${PROJECT_SOURCE_DIR})
    target_link_libraries(telesplat_${name} INTERFACE ${ARG_DEPS})
  endif()
  add_library(telesplat::${name} ALIAS telesplat_${name})
endfunction()

# telesplat_program(NAME sources... [DEPS targets...])   executable NAME in build/bin
function(telesplat_program name)
  cmake_parse_arguments(ARG "" "" "DEPS" ${ARGN})
  add_executable(${name} ${ARG_UNPARSED_ARGUMENTS})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE ${ARG_DEPS} telesplat::version)
  telesplat_headers(${name} common)
endfunction()

# telesplat_tests_of(LABEL PROGRAM)   the target tests_LABEL builds PROGRAM, too
function(telesplat_tests_of label program)
  if(NOT TARGET tests_${label})
    add_custom_target(tests_${label})
  endif()
  add_dependencies(tests_${label} ${program})
endfunction()

# telesplat_test(LABEL NAME sources... [DEPS targets...] [TIMEOUT seconds] [SERIAL])
#   one GoogleTest executable, each of its cases a CTest test with LABEL. Its working directory is the repository's
#   root. SERIAL: its cases measure time or need the whole machine, so no other test runs beside them.
function(telesplat_test label name)
  cmake_parse_arguments(ARG "SERIAL" "TIMEOUT" "DEPS" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 60)
  endif()
  if(TELESPLAT_SANITIZE)
    math(EXPR ARG_TIMEOUT "4 * ${ARG_TIMEOUT}")  # sanitized programs are slow
  endif()
  if(ARG_SERIAL)
    set(serial RUN_SERIAL TRUE)
  endif()
  add_executable(${name} ${ARG_UNPARSED_ARGUMENTS})
  telesplat_tests_of(${label} ${name})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE ${ARG_DEPS} GTest::gtest GTest::gtest_main)
  target_compile_options(${name} PRIVATE ${TELESPLAT_TEST_FLAGS})
  telesplat_headers(${name} test)
  gtest_discover_tests(${name} WORKING_DIRECTORY ${PROJECT_SOURCE_DIR} DISCOVERY_TIMEOUT 60
    PROPERTIES LABELS ${label} TIMEOUT ${ARG_TIMEOUT} ${serial})
endfunction()

# telesplat_fuzz(NAME CORPUS folder [DEPS targets...])   of NAME_fuzz.cpp and corpus/folder
#   with TELESPLAT_FUZZ a libFuzzer program; always a CTest test (label unit) that replays the corpus, and what becomes
#   of its files when they are damaged.
function(telesplat_fuzz stem)
  cmake_parse_arguments(ARG "" "CORPUS" "DEPS" ${ARGN})
  set(name ${stem}_fuzz)
  set(source ${CMAKE_CURRENT_SOURCE_DIR}/${name}.cpp)
  if(TELESPLAT_FUZZ)
    telesplat_program(${name} ${source} DEPS ${ARG_DEPS} -fsanitize=fuzzer)
    file(APPEND ${TELESPLAT_FUZZ_TARGETS} "${name} ${CMAKE_CURRENT_SOURCE_DIR}/corpus/${ARG_CORPUS}\n")
  endif()
  telesplat_program(${name}_replay ${source} ${PROJECT_SOURCE_DIR}/tests/fuzz/replay_main.cpp DEPS ${ARG_DEPS})
  telesplat_tests_of(unit ${name}_replay)
  add_test(NAME fuzz_corpus.${name} COMMAND ${name}_replay ${CMAKE_CURRENT_SOURCE_DIR}/corpus/${ARG_CORPUS})
  set_tests_properties(fuzz_corpus.${name} PROPERTIES LABELS unit TIMEOUT 60)
endfunction()
