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
  # One instruction set: the others are the same source, and take most of the time of the kernels' sources.
  add_compile_definitions(HWY_COMPILE_ONLY_STATIC)
elseif(TELESPLAT_HARDEN)
  # Fortified copies need an optimised build; sanitizers check the same, and better.
  add_compile_options($<$<NOT:$<CONFIG:Debug>>:-U_FORTIFY_SOURCE> $<$<NOT:$<CONFIG:Debug>>:-D_FORTIFY_SOURCE=3>
    -fstack-protector-strong)
  add_link_options(-Wl,-z,relro,-z,now)
  # All code alike, so that it can share precompiled headers. Shared libraries say -fPIC themselves.
  add_compile_options($<$<NOT:$<STREQUAL:$<TARGET_PROPERTY:TYPE>,SHARED_LIBRARY>>:-fPIE>)
  add_link_options($<$<STREQUAL:$<TARGET_PROPERTY:TYPE>,EXECUTABLE>:-pie>)
endif()
