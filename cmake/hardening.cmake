# Finds mistakes, and makes them harmless: sanitizers, the standard library's assertions, hardened binaries.
if(TELESPLAT_ASSERTIONS)
  add_compile_definitions(_GLIBCXX_ASSERTIONS)
endif()

if(TELESPLAT_SANITIZE)
  add_compile_options(-fsanitize=${TELESPLAT_SANITIZE} -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${TELESPLAT_SANITIZE})
  if(TELESPLAT_SANITIZE MATCHES undefined)
    # A finding ends the program. Left out: checks that AddressSanitizer makes as well, and that cost most to compile.
    add_compile_options(-fno-sanitize-recover=all -fno-sanitize=null,object-size,vptr)
  endif()
  if(TELESPLAT_SANITIZE MATCHES address AND CMAKE_CXX_COMPILER_ID MATCHES Clang)
    # Functions with very many memory accesses check them by calls, which compile faster: some took minutes.
    add_compile_options("SHELL:-mllvm -asan-instrumentation-with-call-threshold=300")
  endif()
  # Uses one instruction set: the others are the same source, and take most of its compile time.
  # For sources that need to know: a sanitizer maps terabytes of shadow memory, and is slow.
  add_compile_definitions(HWY_COMPILE_ONLY_STATIC TELESPLAT_SANITIZED)
elseif(TELESPLAT_HARDEN)
  # Fortified copies need an optimised build; sanitizers make the same checks, and better.
  add_compile_options($<$<NOT:$<CONFIG:Debug>>:-U_FORTIFY_SOURCE> $<$<NOT:$<CONFIG:Debug>>:-D_FORTIFY_SOURCE=3>
    -fstack-protector-strong)
  add_link_options(-Wl,-z,relro,-z,now)
  # All code in the same way, so that it can share precompiled headers. Shared libraries set -fPIC themselves.
  add_compile_options($<$<NOT:$<STREQUAL:$<TARGET_PROPERTY:TYPE>,SHARED_LIBRARY>>:-fPIE>)
  add_link_options($<$<STREQUAL:$<TARGET_PROPERTY:TYPE>,EXECUTABLE>:-pie>)
endif()

# Instruction sets of vector kernels. all: each machine uses the newest that it has. one: only AVX2, if this machine has
# it, and the oldest, which compile in a third of the time.
set(TELESPLAT_SIMD all CACHE STRING "Instruction sets of vector kernels: all or one")
set_property(CACHE TELESPLAT_SIMD PROPERTY STRINGS all one)
if(TELESPLAT_SIMD STREQUAL "one" AND EXISTS /proc/cpuinfo)
  file(STRINGS /proc/cpuinfo has_avx2 REGEX "^flags.* avx2" LIMIT_COUNT 1)
  if(has_avx2)
    set(TELESPLAT_SIMD_LEFT_OUT "HWY_DISABLED_TARGETS=(HWY_SSSE3|HWY_SSE4|HWY_AVX3|HWY_AVX3_DL)")
  endif()
endif()

# telesplat_kernels(sources...)   sets the instruction sets of those sources that are vector kernels
#   Sanitized builds use SSE4.2: for the oldest x86 Highway would emulate vectors by loops, and a kernel took 200 s to
#   compile, now 5 s.
function(telesplat_kernels)
  foreach(source ${ARGN})
    cmake_path(ABSOLUTE_PATH source OUTPUT_VARIABLE path)
    if(EXISTS ${path} AND NOT IS_DIRECTORY ${path})
      file(STRINGS ${path} kernels REGEX "hwy/foreach_target.h" LIMIT_COUNT 1)
      if(kernels)
        set_property(SOURCE ${source} PROPERTY SKIP_UNITY_BUILD_INCLUSION ON)
        if(TELESPLAT_SIMD_LEFT_OUT)
          set_property(SOURCE ${source} APPEND PROPERTY COMPILE_DEFINITIONS "${TELESPLAT_SIMD_LEFT_OUT}")
        endif()
        if(TELESPLAT_SANITIZE AND CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
          # The precompiled header has another instruction set.
          set_property(SOURCE ${source} APPEND PROPERTY COMPILE_OPTIONS -msse4.2 -maes -mpclmul)
          set_property(SOURCE ${source} PROPERTY SKIP_PRECOMPILE_HEADERS ON)
        endif()
      endif()
    endif()
  endforeach()
endfunction()

# telesplat_margins(TARGET)   allows row[x - 1] with an unsigned x = 0, in rows with pixels before the first
#   The address is right, since unsigned sums wrap around; AddressSanitizer still checks it.
function(telesplat_margins target)
  if(TELESPLAT_SANITIZE MATCHES undefined)
    target_compile_options(${target} PRIVATE -fno-sanitize=pointer-overflow)
  endif()
endfunction()
