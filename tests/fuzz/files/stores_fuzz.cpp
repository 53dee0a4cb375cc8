// Reads any bytes as a data server's input other than meshes and headers of volumes: chunks of a store, a store,
// output of the importing program, glTF with its pictures, packed voxels and voxels in words. The first byte chooses.
#include <cstdlib>

#include "common/geometry/chunk_code.h"
#include "services/data/gltf/reader.h"
#include "services/data/import/process.h"
#include "services/data/mesh/reader.h"
#include "services/data/mesh/store_file.h"
#include "services/data/volume/formats/header.h"
#include "services/data/volume/formats/import_stream.h"
#include "services/data/volume/volume.h"
#include "services/data/vtk/reader.h"
#include "tests/support/files/memory_file.h"

namespace telesplat::data {
namespace {

using Bytes = std::span<const uint8_t>;

// Adds up a chunk's numbers, to check that they can be read.
uint64_t use(const geometry::MeshChunkView& chunk) {
  uint64_t sum = 0;
  for (const uint32_t i : chunk.indices) {
    if (i >= chunk.vertices()) std::abort();
    sum += chunk.normals[i] + chunk.colours[i] + uint64_t(std::abs(chunk.positions_room[3 * i + 2]) < 1);
  }
  return sum;
}
void chunk(Bytes bytes) {
  if (const auto chunk = geometry::decode_chunk(std::as_bytes(bytes)); chunk.ok()) use(chunk->view);
}
void store(Bytes bytes) {
  const test::MemoryFile file(bytes);
  const auto content = read_store(file.descriptor(), "fuzz");
  if (content.ok() && content->offsets.size() != content->chunks.size()) std::abort();
}
void report(Bytes bytes) {
  const test::MemoryFile file(bytes);
  const auto mesh = read_import_report(file.descriptor(), "fuzz", "vtu");
  if (mesh.ok()) (void)validate_mesh(*mesh, "fuzz");
  const auto heights = read_heights_report(file.descriptor(), "fuzz");
  if (heights.ok() && heights->heights.size() != size_t(heights->width) * size_t(heights->height)) std::abort();
}
void stream(Bytes bytes) {
  const test::MemoryFile file(bytes);
  (void)receive_volume(file.descriptor(), 1 << 20, "fuzz", nullptr);
}
void vtk_file(Bytes bytes) {
  struct NoFiles : Companions {
    Result<std::string_view> read(const std::string& named) override { return Error{named}; }
  } companions;
  const std::string_view content(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const auto mesh = vtk::read_mesh(content, "fuzz", companions, "");
  if (mesh.ok()) (void)validate_mesh(*mesh, "fuzz");
  (void)vtk::read_image_header(content, "fuzz", companions, "");
}
void gltf(Bytes bytes) {
  const std::string_view content(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  companion_files(content, "gltf", "fuzz/fuzz.gltf");
  struct Alone : Companions {
    Result<std::string_view> read(const std::string& named) override { return Error{named + " is not there"}; }
  } companions;
  const auto mesh = read_gltf(content, "fuzz", companions, 1000);
  if (mesh.ok()) (void)validate_mesh(*mesh, "fuzz");
}
void companions(Bytes bytes) {
  const std::string_view content(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  companion_files(content, "obj", "fuzz/fuzz.obj");
  companion_files(content, "glb", "fuzz/fuzz.glb");
}
void payload(Bytes bytes) {
  const test::MemoryFile file(bytes);
  const std::string_view content(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  for (auto header : {parse_nrrd(content, "fuzz"), parse_metaimage(content, "fuzz"), parse_nifti(content, "fuzz")}) {
    if (!header.ok() || !check_header(*header, bytes.size(), "fuzz").ok() || header->voxel_bytes() > 1 << 20) continue;
    header->data_path = file.path();
    auto voxels = read_payload(*header, file.path(), nullptr);
    if (!voxels.ok()) continue;
    if (voxels->size() != header->voxel_bytes()) std::abort();
    (void)make_volume(*header, *std::move(voxels), "fuzz");
  }
}

}  // namespace
}  // namespace telesplat::data

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace telesplat::data;
  constexpr void (*kReaders[])(Bytes) = {chunk, store, report, stream, vtk_file, gltf, companions, payload};
  if (size == 0) return 0;
  kReaders[data[0] % std::size(kReaders)]({data + 1, size - 1});
  return 0;
}
