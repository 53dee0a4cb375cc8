#include "services/data/inspect.h"

#include <fmt/format.h>

#include <filesystem>

#include "services/data/base/mapped_file.h"
#include "services/data/mesh/reader.h"
#include "services/data/open_mesh.h"

namespace telesplat::data {

Result<MeshFileFacts> inspect_mesh(const std::string& path, const MeshOptions& options, const Progress& progress) {
  const auto store = open_mesh(path, options, progress);
  if (!store) return store.error();
  MeshFileFacts facts;
  facts.info = (*store)->info();
  std::error_code error;
  facts.file_bytes = std::filesystem::file_size(path, error);
  facts.chunks = (*store)->chunks().size();
  for (const geometry::ChunkInfo& chunk : (*store)->chunks()) facts.chunk_bytes += chunk.bytes;
  return facts;
}

std::string describe(const MeshFileFacts& facts) {
  const MeshStoreInfo& i = facts.info;
  const auto size = i.box_data.size();
  const auto room = i.box_room.size();
  std::string out;
  out += fmt::format("file        {}\n", i.source);
  out += fmt::format("format      {}, {} bytes, content {:016x}\n", i.format, facts.file_bytes, i.content_hash);
  out += fmt::format("triangles   {} ({} degenerate ones left out)\n", i.triangles, i.degenerate_dropped);
  out += fmt::format("vertices    {}\n", i.vertices);
  out += fmt::format("box         ({}, {}, {}) .. ({}, {}, {}), in the file's units\n", i.box_data.lo.x,
                     i.box_data.lo.y, i.box_data.lo.z, i.box_data.hi.x, i.box_data.hi.y, i.box_data.hi.z);
  out += fmt::format("size        {} x {} x {}\n", size.x, size.y, size.z);
  out += fmt::format("in the room {:.3f} x {:.3f} x {:.3f} m, {} up\n", room.x, room.y, room.z, i.up);
  out += fmt::format("normals     {}\n", i.had_normals ? "in the file" : "computed");
  out += fmt::format("colours     {}\n", i.had_colours ? "in the file" : "none: neutral");
  out += fmt::format("chunks      {}, {:.1f} MB{}\n", facts.chunks, static_cast<double>(facts.chunk_bytes) * 1e-6,
                     i.from_cache ? ", from the cache" : "");
  return out;
}

bool is_mesh_file(const std::string& path) {
  const auto file = MappedFile::open(path);
  return file.ok() && !detect_format((*file)->text(), path).format.empty();
}

}  // namespace telesplat::data
