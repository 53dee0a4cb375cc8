#include "tests/fuzz/mesh_reader_fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace telesplat::data;
  const std::string_view content(reinterpret_cast<const char*>(data), size);
  FolderCompanions none("/nonexistent/fuzz");
  auto mesh = read_ply(content, "fuzz", nullptr, none);
  const std::string array = mesh.ok() && !mesh->arrays.empty() ? mesh->arrays.back().name : "";
  use(std::move(mesh));
  if (!array.empty()) use(read_ply(content, "fuzz", nullptr, none, array));
  return 0;
}
