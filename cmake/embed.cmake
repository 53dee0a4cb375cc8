# Writes a C++ source that holds files as texts, so that a program does not need the files when it runs.
#   cmake -D OUT=page_files.cpp -D HEADER=tools/x/page_files.h -D NAMESPACE=telesplat::x -D "FILES=name=path|name=path"
#     -P embed.cmake
# The header declares for each name: extern const std::string_view name;
cmake_minimum_required(VERSION 3.24)

set(mark telesplat_embed)
file(WRITE "${OUT}.part" "// Made by cmake/embed.cmake.\n#include \"${HEADER}\"\n\nnamespace ${NAMESPACE} {\n")
string(REPLACE "|" ";" files "${FILES}")
foreach(entry IN LISTS files)
  string(REGEX MATCH "^([^=]+)=(.*)$" found "${entry}")
  set(name "${CMAKE_MATCH_1}")
  file(READ "${CMAKE_MATCH_2}" text)
  string(FIND "${text}" ")${mark}\"" at)
  if(NOT at EQUAL -1)
    message(FATAL_ERROR "${CMAKE_MATCH_2}: holds the mark that ends texts")
  endif()
  # In parts, because compilers guarantee only 64 KiB a literal.
  file(APPEND "${OUT}.part" "\nconst std::string_view ${name} =")
  string(LENGTH "${text}" left)
  set(begin 0)
  while(begin LESS left)
    string(SUBSTRING "${text}" ${begin} 15000 part)
    file(APPEND "${OUT}.part" "\n    R\"${mark}(${part})${mark}\"")
    math(EXPR begin "${begin} + 15000")
  endwhile()
  file(APPEND "${OUT}.part" " \"\";\n")
endforeach()
file(APPEND "${OUT}.part" "\n}  // namespace ${NAMESPACE}\n")
file(RENAME "${OUT}.part" "${OUT}")
