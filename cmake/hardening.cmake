# What finds mistakes and what makes them harmless: sanitizers, the standard library's assertions, hardened binaries.
if(TELESPLAT_ASSERTIONS)
  add_compile_definitions(_GLIBCXX_ASSERTIONS)
endif()

if(TELESPLAT_SANITIZE)
  add_compile_options(-fsanitize=${TELESPLAT_SANITIZE} -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${TELESPLAT_SANITIZE})
  if(TELESPLAT_SANITIZE MATCHES undefined)
    # What is found ends the program. Left out: what AddressSanitizer tells as well, and costs most to compile.
    add_compile_options(-fno-sanitize-recover=all -fno-sanitize=null,object-size,vptr)
  endif()
  if(TELESPLAT_SANITIZE MATCHES address AND CMAKE_CXX_COMPILER_ID MATCHES Clang)
    # Functions of very many accesses check them by calls, so that none takes minutes to compile.
    add_compile_options("SHELL:-mllvm -asan-instrumentation-with-call-threshold=300")
  endif()
  # One instruction set: the others are the same source, and take most of the time of the kernels' sources.
  # Sources that must know: a sanitizer maps terabytes of shadow, and is slow.
  add_compile_definitions(HWY_COMPILE_ONLY_STATIC TELESPLAT_SANITIZED)
elseif(TELESPLAT_HARDEN)
  # Fortified copies need an optimised build; sanitizers check the same, and better.
  add_compile_options($<$<NOT:$<CONFIG:Debug>>:-U_FORTIFY_SOURCE> $<$<NOT:$<CONFIG:Debug>>:-D_FORTIFY_SOURCE=3>
    -fstack-protector-strong)
  add_link_options(-Wl,-z,relro,-z,now)
  # All code alike, so that it can share precompiled headers. Shared libraries say -fPIC themselves.
  add_compile_options($<$<NOT:$<STREQUAL:$<TARGET_PROPERTY:TYPE>,SHARED_LIBRARY>>:-fPIE>)
  add_link_options($<$<STREQUAL:$<TARGET_PROPERTY:TYPE>,EXECUTABLE>:-pie>)
endif()

# telesplat_kernels(sources...)   in sanitized builds, gives those of these sources that are vector kernels SSE4.2
#   Compiled for the oldest x86 alone, Highway emulates vectors by loops: a kernel took 200 s to compile, now 5 s.
function(telesplat_kernels)
  if(NOT TELESPLAT_SANITIZE OR NOT CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
    return()
  endif()
  foreach(source ${ARGN})
    cmake_path(ABSOLUTE_PATH source OUTPUT_VARIABLE path)
    if(EXISTS ${path} AND NOT IS_DIRECTORY ${path})
      file(STRINGS ${path} kernels REGEX "hwy/foreach_target.h" LIMIT_COUNT 1)
      if(kernels)  # a precompiled header is of another instruction set
        set_property(SOURCE ${source} APPEND PROPERTY COMPILE_OPTIONS -msse4.2 -maes -mpclmul)
        set_property(SOURCE ${source} PROPERTY SKIP_PRECOMPILE_HEADERS ON)
      endif()
    endif()
  endforeach()
endfunction()

# telesplat_margins(TARGET)   its rows have pixels before the first: row[x - 1] where x, which has no sign, is 0
#   The sum is right, as numbers of the machine wrap around; AddressSanitizer sees where it leads.
function(telesplat_margins target)
  if(TELESPLAT_SANITIZE MATCHES undefined)
    target_compile_options(${target} PRIVATE -fno-sanitize=pointer-overflow)
  endif()
endfunction()
