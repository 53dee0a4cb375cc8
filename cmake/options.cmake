# Language level, warnings, sanitizers and fuzzing, for every target.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()

# A first picture needs none of these options (the preset first).
option(TELESPLAT_IMPORT "Build telesplat-import, which reads what GDAL, GDCM and packers of glTF read" ON)
option(TELESPLAT_DISPLAYS "Build telesplat-display: windows and headsets" ON)
option(TELESPLAT_LAB "Build telesplat-lab" ON)
option(TELESPLAT_TESTS "Build the tests and benchmarks" ON)
option(TELESPLAT_PCH "Compile common headers once" ON)
option(TELESPLAT_FUZZ "Build the libFuzzer targets (needs clang)" OFF)
set(TELESPLAT_COMMIT "" CACHE STRING "HASH,DATE of the sources, where neither git nor an archive of git's tells them")
set(TELESPLAT_SANITIZE "" CACHE STRING "Sanitizers, as in -fsanitize=")
option(TELESPLAT_ASSERTIONS "Check what the standard library can check at little cost: indices, empty containers" ON)
option(TELESPLAT_HARDEN "What compiler and linker can do against what is exploited: checked copies, guarded stacks" ON)

# -ffp-contract=off: packer and viewers must compute identical points with any instruction set. GCC 12 warns wrongly
# about std::string's own code (GCC bugs 105329, 105651, 105562), and about equal names in sources that are compiled
# together; clang makes the same checks.
add_compile_options(-Wall -Wextra -Wno-missing-field-initializers
  "$<$<CXX_COMPILER_ID:GNU>:-Wno-restrict;-Wno-stringop-overflow;-Wno-array-bounds;-Wno-maybe-uninitialized>"
  "$<$<CXX_COMPILER_ID:GNU>:-Wno-stringop-overread;-Wno-subobject-linkage>"
  -ffp-contract=off -fno-math-errno)
include(cmake/hardening.cmake)
if(TELESPLAT_FUZZ AND NOT CMAKE_CXX_COMPILER_ID MATCHES Clang)
  message(FATAL_ERROR "TELESPLAT_FUZZ needs clang: tools/setup --developer")
endif()

# Test cases run once: optimising them takes longer than it saves. The code under test is optimised. GoogleTest's macros
# have an else of their own.
set(TELESPLAT_TEST_FLAGS -O1 -Wno-dangling-else)
if(TELESPLAT_SANITIZE)
  set(TELESPLAT_TEST_FLAGS -O0 -Wno-dangling-else)  # code under test is optimised, test cases need not be
endif()

# Compiles several sources at once (the preset release): a clean build takes half of the time.
set(CMAKE_UNITY_BUILD_BATCH_SIZE 10)

find_program(CCACHE ccache)
if(CCACHE)
  # With precompiled headers ccache must ignore macros and times in them.
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros ${CCACHE})
  add_compile_options($<$<COMPILE_LANG_AND_ID:CXX,GNU>:-fpch-preprocess>)
  # clang writes the headers' times into a precompiled header, which would make each one different.
  add_compile_options("$<$<COMPILE_LANG_AND_ID:CXX,Clang>:SHELL:-Xclang -fno-pch-timestamp>")
endif()

# Uses a faster linker, if it is installed.
find_program(MOLD mold)
if(MOLD)
  add_link_options(-fuse-ld=mold)
endif()
