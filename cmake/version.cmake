# Writes version.cpp at each build: the commit changes without a new run of CMake.
#   cmake -D SOURCE=root -D VERSION=0.2.0 -D COMMIT=5ad84a7,2026-11-22 -D OUT=version.cpp -P version.cmake
# The commit is the first one known from: COMMIT (a container is built without history), git, commit.txt (an archive
# that git made). A version is "-dev" unless its commit has its tag, v0.2.0.
cmake_minimum_required(VERSION 3.24)

set(told "${COMMIT}")
set(tags "")

find_program(GIT git)
if(NOT told AND GIT AND EXISTS "${SOURCE}/.git")
  execute_process(COMMAND ${GIT} -C ${SOURCE} log -1 --abbrev=7 --format=%h,%cs
    OUTPUT_VARIABLE told OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  execute_process(COMMAND ${GIT} -C ${SOURCE} tag --points-at HEAD
    OUTPUT_VARIABLE tags OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  string(REPLACE "\n" ";" tags "${tags}")
endif()

if(NOT told AND EXISTS "${SOURCE}/cmake/commit.txt")
  file(STRINGS "${SOURCE}/cmake/commit.txt" archived LIMIT_COUNT 1)
  if(archived MATCHES "^([0-9a-f]+,[0-9-]+) ?(.*)$")
    set(told "${CMAKE_MATCH_1}")
    string(REPLACE "tag: " "" tags "${CMAKE_MATCH_2}")
    string(REPLACE ", " ";" tags "${tags}")
  endif()
endif()

set(text "${VERSION}")
if(NOT "v${VERSION}" IN_LIST tags)
  string(APPEND text "-dev")
endif()
if(told MATCHES "^[0-9A-Za-z]+,[0-9-]+$")
  string(REPLACE "," ", " told "${told}")
  string(APPEND text " (${told})")
endif()

set(source "#include \"common/core/version.h\"

namespace telesplat {

std::string version() { return \"${text}\"; }

}  // namespace telesplat
")
set(there "")
if(EXISTS "${OUT}")
  file(READ "${OUT}" there)
endif()
if(NOT source STREQUAL there)  # if equal, programs that use it are not linked again
  file(WRITE "${OUT}" "${source}")
endif()
