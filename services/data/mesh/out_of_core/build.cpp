#include "services/data/mesh/out_of_core/build.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>
#include <utility>

#include "common/parallel/in_parallel.h"
#include "services/data/base/numbering.h"
#include "services/data/mesh/out_of_core/partition.h"
#include "services/data/mesh/store_file.h"

namespace telesplat::data {
namespace {

constexpr uint64_t kSampled = 1 << 20;  // centroids of a survey, about
// Vertices and triangles to guess by. The corners of triangles are few: vertices that come often seem to lie on a grid.
constexpr uint64_t kGuessedBy = 1 << 16, kTrianglesGuessedBy = 1 << 12;
constexpr size_t kBytesWhileMade = 100;  // memory that a part takes while it is made

bool is_finite(const glm::dvec3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

// Findings in a part of a block.
struct Seen {
  geometry::DBox box;
  uint64_t none = 0, not_finite = 0;
  uint64_t wrong = ~uint64_t{0};  // the first corner that does not exist
};

Seen join(Seen a, const Seen& b) {
  a.box.extend(b.box);
  a.none += b.none, a.not_finite += b.not_finite;
  a.wrong = std::min(a.wrong, b.wrong);
  return a;
}

Seen look(const RandomMesh& mesh, std::span<const uint32_t> corners) {
  const auto turn = [&](const tbb::blocked_range<size_t>& range, Seen seen) {
    for (size_t i = 3 * range.begin(); i < 3 * range.end(); i += 3) {
      if (corners[i] == RandomMesh::kNoTriangle) {
        ++seen.none;
        continue;
      }
      bool finite = true;
      glm::dvec3 p[3];
      for (size_t k = 0; k < 3; ++k) {
        if (corners[i + k] >= mesh.vertices()) {
          seen.wrong = std::min<uint64_t>(seen.wrong, i + k);
          return seen;
        }
        p[k] = mesh.position(corners[i + k]);
        finite &= is_finite(p[k]);
      }
      seen.not_finite += !finite;
      for (int k = 0; k < 3 && finite; ++k) seen.box.extend(p[k]);
    }
    return seen;
  };
  return sum_in_parallel(tbb::blocked_range<size_t>(0, corners.size() / 3, 1 << 14), Seen{}, turn, join);
}

// A part of the mesh as it is read, and which of its triangles are its own.
struct ReadPart {
  Mesh mesh;
  std::vector<bool> own;
  uint64_t degenerate = 0;  // own triangles that are left out
};

class PartReader {
 public:
  PartReader(const RandomMesh& mesh, const Placing& placing) : mesh_(mesh), placing_(placing) {}
  const RandomMesh& mesh() const { return mesh_; }
  /// own, around: ascending triangles.
  ReadPart read(const std::vector<uint32_t>& own, const std::vector<uint32_t>& around) const;

 private:
  void read_vertices(const std::vector<uint64_t>& vertices, Mesh& out) const;

  const RandomMesh& mesh_;
  const Placing& placing_;
};

void PartReader::read_vertices(const std::vector<uint64_t>& vertices, Mesh& out) const {
  const RandomMesh::Facts& facts = mesh_.facts();
  out.positions.reserve(vertices.size());
  for (const uint64_t v : vertices) {
    const glm::dvec3 p = mesh_.position(v);
    out.positions.push_back(is_finite(p) ? p : placing_.centre);
    if (facts.normals) out.normals.push_back(mesh_.normal(v));
    if (facts.colours) out.colours.push_back(mesh_.colour(v));
    if (facts.scalars) out.scalars.push_back(mesh_.scalar(v));
  }
}

// Triangles of both lists keep their order in the file, so that sums over those around a vertex are those of the whole
// mesh.
ReadPart PartReader::read(const std::vector<uint32_t>& own, const std::vector<uint32_t>& around) const {
  ReadPart out;
  out.mesh.format = mesh_.facts().format;
  Numbering<uint64_t> number(own.size());
  std::vector<uint32_t> read;
  read.reserve(3 * (own.size() + around.size()));
  std::vector<bool> is_own;
  for (size_t i = 0, j = 0; i < own.size() || j < around.size();) {
    is_own.push_back(j == around.size() || (i < own.size() && own[i] < around[j]));
    uint32_t corners[3];
    mesh_.corners(is_own.back() ? own[i++] : around[j++], 1, corners);
    for (const uint32_t vertex : corners) read.push_back(number(vertex));
  }
  read_vertices(number.keys(), out.mesh);
  std::vector<glm::vec3> room;
  room.reserve(out.mesh.positions.size());
  for (const glm::dvec3& p : out.mesh.positions) room.push_back(placing_.room(p));
  for (size_t t = 0; t < is_own.size(); ++t) {
    const uint32_t* corners = &read[3 * t];
    bool finite = true;
    for (int k = 0; k < 3; ++k) finite &= is_finite(mesh_.position(number.keys()[corners[k]]));
    const bool degenerate = finite && area_vector(room, corners) == glm::dvec3(0);
    out.degenerate += degenerate && is_own[t];
    if (degenerate || !finite) continue;
    out.mesh.indices.insert(out.mesh.indices.end(), corners, corners + 3);
    out.own.push_back(is_own[t]);
  }
  return out;
}

// Leaves the triangles of other parts out.
void keep_own(PlacedMesh& placed, const std::vector<bool>& own) {
  size_t kept = 0;
  for (size_t t = 0; t < own.size(); ++t) {
    if (!own[t]) continue;
    std::copy_n(&placed.indices[3 * t], 3, &placed.indices[3 * kept]);
    ++kept;
  }
  placed.indices.resize(3 * kept);
}

// Where the leaves of each part begin; then their number.
std::vector<size_t> first_leaves(const ScratchLists& own, size_t parts, const OutOfCoreOptions& options) {
  std::vector<size_t> out{0};
  for (size_t part = 0; part < parts; ++part)
    out.push_back(out.back() + std::max<size_t>(options.leaves, (own.size(part) + options.leaf_triangles - 1) /
                                                                    options.leaf_triangles));
  return out;
}

// Writes the leaves of all parts, a few parts at a time.
class PartWriter {
 public:
  PartWriter(const RandomMesh& mesh, const Placing& placing, const Partition& partition, StoreWriter& out,
             const OutOfCoreOptions& options)
      : reader_(mesh, placing),
        placing_(placing),
        partition_(partition),
        out_(out),
        options_(options),
        first_(first_leaves(partition.own, partition.around.size(), options)) {}

  Status write(const Progress& progress) {
    const size_t parts = partition_.around.size();
    const size_t of_part = options_.leaf_triangles * options_.leaves * kBytesWhileMade;
    const size_t at_once =
        std::clamp<size_t>(options_.memory_bytes / of_part, 1, std::max(1u, std::thread::hardware_concurrency()));
    std::vector<Status> done(parts, ok_status());
    for (size_t begin = 0; begin < parts; begin += at_once) {
      progress(kWritingTheStore, static_cast<double>(begin) / static_cast<double>(parts));
      const size_t end = std::min(begin + at_once, parts);
      in_parallel(begin, end, [&](size_t part) { done[part] = write(part); });
      for (size_t part = begin; part < end; ++part)
        if (!done[part]) return done[part];
      reader_.mesh().drop_pages();
    }
    return ok_status();
  }
  /// Number of triangles without an area, which are left out.
  uint64_t degenerate() const { return degenerate_; }

 private:
  Status write(size_t part) {
    const auto own = partition_.own.take(part);
    if (!own) return own.error();
    ReadPart read = reader_.read(*own, partition_.around[part]);
    degenerate_ += read.degenerate;
    PlacedMesh placed = place(std::move(read.mesh), placing_, options_.store.crease_deg);
    keep_own(placed, read.own);
    const size_t triangles = placed.indices.size() / 3;
    if (triangles == 0) return ok_status();
    out_.write_leaves(first_[part], placed,
                      plan_chunk_count(placed, std::min(first_[part + 1] - first_[part], triangles)), [](double) {});
    return ok_status();
  }

  const PartReader reader_;
  const Placing& placing_;
  const Partition& partition_;
  StoreWriter& out_;
  const OutOfCoreOptions& options_;
  const std::vector<size_t> first_;  // leaves of each part
  std::atomic<uint64_t> degenerate_ = 0;
};

// Completes what is known before the parts are written.
void describe(const RandomMesh& mesh, const Survey& seen, const Placing& placing, const std::string& path,
              MeshStoreInfo& info) {
  const RandomMesh::Facts& facts = mesh.facts();
  info.format = facts.format, info.arrays = facts.arrays, info.coordinates = facts.coordinates;
  info.vertices = facts.vertices - facts.unused;
  info.had_normals = facts.normals, info.had_colours = facts.colours;
  info.box_data = seen.box_data;
  info.up = placing.up, info.up_reason = placing.up_reason;
  for (const std::string& note : facts.notes) info.notes.push_back(without_name(note, path));
  if (seen.not_finite > 0)
    info.notes.push_back(fmt::format("{} of {} triangles are left out: a coordinate of theirs is no finite number",
                                     seen.not_finite, seen.triangles));
}

}  // namespace

std::string without_name(const std::string& note, const std::string& path) {
  return note.starts_with(path + ": ") ? note.substr(path.size() + 2) : note;
}

Result<std::optional<Survey>> survey(const RandomMesh& mesh, const std::string& name, const ReadProgress& progress) {
  Survey out;
  if (mesh.triangles() == 0) return Error{fmt::format("{}: holds no triangles ({} vertices)", name, mesh.vertices())};
  const uint64_t step = std::max<uint64_t>(mesh.triangles() / kSampled, 1);
  Status wrong = ok_status();
  const bool triangles_alone = for_blocks(mesh, [&](uint64_t first, std::span<const uint32_t> corners) {
    if (!wrong) return;
    progress(static_cast<double>(first) / static_cast<double>(mesh.triangles()));
    const Seen seen = look(mesh, corners);
    if (seen.wrong != ~uint64_t{0})
      wrong = Error{fmt::format("{}: triangle {} names vertex {}, there are {}", name, first + seen.wrong / 3,
                                corners[seen.wrong], mesh.vertices())};
    if (!wrong) return;
    out.box_data.extend(seen.box);
    out.triangles += corners.size() / 3 - seen.none, out.not_finite += seen.not_finite;
    for (uint64_t t = (first + step - 1) / step * step; t < first + corners.size() / 3; t += step)
      if (corners[3 * (t - first)] != RandomMesh::kNoTriangle)
        if (const glm::vec3 at = centroid(mesh, &corners[3 * (t - first)]); is_finite(at)) out.centroids.push_back(at);
  });
  if (!wrong) return wrong.error();
  if (!triangles_alone) return std::optional<Survey>();
  if (out.not_finite == out.triangles || out.centroids.empty())
    return Error{fmt::format("{}: none of its {} triangles has finite corners", name, out.triangles)};
  return std::optional(std::move(out));
}

Mesh spread_sample(const RandomMesh& mesh) {
  Mesh out;
  out.format = mesh.facts().format, out.smooth = mesh.facts().smooth;
  out.coordinates = mesh.facts().coordinates;
  const auto add = [&](uint64_t vertex) {
    if (vertex >= mesh.vertices()) return;
    const glm::dvec3 p = mesh.position(vertex);
    out.positions.push_back(is_finite(p) ? p : glm::dvec3(0));
  };
  for (uint64_t v = 0; v < mesh.vertices(); v += std::max<uint64_t>(mesh.vertices() / kGuessedBy, 1)) add(v);
  for (uint64_t t = 0; t < mesh.triangles(); t += std::max<uint64_t>(mesh.triangles() / kTrianglesGuessedBy, 1)) {
    uint32_t corners[3];
    mesh.corners(t, 1, corners);
    const auto first = static_cast<uint32_t>(out.positions.size());
    for (const uint32_t vertex : corners) add(vertex);
    if (out.positions.size() == first + 3) out.indices.insert(out.indices.end(), {first, first + 1, first + 2});
  }
  if (mesh.facts().normals) out.normals.resize(out.positions.size(), glm::vec3(0, 0, 1));
  return out;
}

Result<bool> write_out_of_core(StorePlace& place, const std::string& path, const RandomMesh& mesh,
                               const OutOfCoreOptions& options, MeshStoreInfo& info, const Progress& progress) {
  const auto looked = survey(mesh, path, [&](double fraction) { progress(kReading, fraction); });
  if (!looked) return looked.error();
  if (!*looked) return false;
  const Survey& seen = **looked;
  if (const Status s = check_room(place.descriptor, path, seen.triangles); !s) {
    place.unwritten = true;
    return s.error();
  }
  const auto placing = find_placing(spread_sample(mesh), seen.box_data, options.store, path);
  if (!placing) return placing.error();
  const size_t part_triangles = options.leaf_triangles * options.leaves * 4 / 5;  // parts are not quite equal
  const PartTree tree(seen.centroids, (mesh.triangles() + part_triangles - 1) / part_triangles);
  const auto divided = divide(mesh, tree, place.folder, [&](double f) { progress(kSortingIntoChunks, f); });
  const auto failed = [&](const Error& error) {
    place.unwritten = true;
    return Error{path + ": " + error.text};
  };
  if (!divided) return failed(divided.error());
  if (!*divided) return false;

  auto writer = StoreWriter::begin(place.descriptor, path, first_leaves((*divided)->own, tree.parts(), options).back());
  if (!writer) return writer.error();
  PartWriter parts(mesh, *placing, **divided, *writer, options);
  if (const Status s = parts.write(progress); !s) return failed(s.error());
  describe(mesh, seen, *placing, path, info);
  info.degenerate_dropped = parts.degenerate();
  info.triangles = seen.triangles - seen.not_finite - parts.degenerate();
  info.box_room = writer->box_room();
  if (info.triangles == 0)
    return Error{fmt::format("{}: all its {} triangles are degenerate (no area)", path, parts.degenerate())};
  const Status written = writer->finish(info, progress);
  place.unwritten = !written;
  return written ? Result<bool>(true) : Result<bool>(written.error());
}

}  // namespace telesplat::data
