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
    # Functions of very many accesses check them by calls: a kernel takes 15 s to compile instead of 200 s.
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

# telesplat_lighten(sources...)   the checks of vector kernels that cost most to compile, and that others make up for
#   Loads and stores of vectors take any address, and AddressSanitizer sees where pointers lead.
function(telesplat_lighten)
  if(NOT TELESPLAT_SANITIZE MATCHES undefined)
    return()
  endif()
  foreach(source ${ARGN})
    cmake_path(ABSOLUTE_PATH source OUTPUT_VARIABLE path)
    if(EXISTS ${path} AND NOT IS_DIRECTORY ${path})
      file(STRINGS ${path} kernels REGEX "hwy/foreach_target.h" LIMIT_COUNT 1)
      if(kernels)
        set_property(SOURCE ${source} APPEND PROPERTY COMPILE_OPTIONS -fno-sanitize=alignment,pointer-overflow)
      endif()
    endif()
  endforeach()
endfunction()
