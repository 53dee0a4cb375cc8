#include "services/data/base/random_mesh.h"

#include <algorithm>
#include <cstring>

#include "common/scene/colouring.h"
#include "services/data/base/mesh.h"

namespace telesplat::data {
namespace {

double read_number(const std::byte* at, StoredType type, bool swap) {
  return with_type(type, [&](auto value) {
    std::byte bytes[sizeof value];
    std::memcpy(bytes, at, sizeof value);
    if (swap) std::reverse(bytes, bytes + sizeof value);
    std::memcpy(&value, bytes, sizeof value);
    return static_cast<double>(value);
  });
}

}  // namespace

RecordMesh::RecordMesh(std::shared_ptr<const MappedFile> file, Facts facts, const Layout& layout)
    : RandomMesh(std::move(facts)), file_(std::move(file)), layout_(layout) {
  const auto is_float = [](const Field& field) { return field.type == StoredType::kF32; };
  const size_t x = layout.position[0].at;
  has_floats_ = !layout.swap && std::all_of(layout.position.begin(), layout.position.end(), is_float) &&
                layout.position[1].at == x + 4 && layout.position[2].at == x + 8;
}

glm::dvec3 RecordMesh::position(uint64_t vertex) const {
  if (!has_floats_) return three(vertex, layout_.position);
  float p[3];
  std::memcpy(p, file_->bytes().data() + layout_.vertices_at + vertex * layout_.vertex_bytes + layout_.position[0].at,
              sizeof p);
  return {p[0], p[1], p[2]};
}

bool RecordMesh::corners(uint64_t first, size_t count, uint32_t* out) const {
  const Layout& l = layout_;
  const std::byte* record = file_->bytes().data() + l.triangles_at + first * l.triangle_bytes;
  const size_t step = stored_bytes(l.first_corner.type);
  // The usual file: bytes as counts, numbers of 32 bits in this machine's order.
  const bool plain = !l.swap && l.corners.type == StoredType::kU8 &&
                     (l.first_corner.type == StoredType::kI32 || l.first_corner.type == StoredType::kU32);
  bool all = true;
  for (size_t t = 0; t < count; ++t, record += l.triangle_bytes, out += 3) {
    const std::byte* const at = record + l.first_corner.at;
    if (plain) {
      all &= record[l.corners.at] == std::byte{3};
      std::memcpy(out, at, 12);
      continue;
    }
    all &= read_number(record + l.corners.at, l.corners.type, l.swap) == 3;
    for (size_t k = 0; k < 3; ++k) {
      const double vertex = read_number(at + k * step, l.first_corner.type, l.swap);
      out[k] = vertex >= 0 && vertex < double(kMaxVertices) ? static_cast<uint32_t>(vertex) : ~uint32_t{0};
    }
  }
  return all;
}

double RecordMesh::number(uint64_t vertex, const Field& field) const {
  const std::byte* const record = file_->bytes().data() + layout_.vertices_at + vertex * layout_.vertex_bytes;
  return read_number(record + field.at, field.type, layout_.swap);
}

float RecordMesh::scalar(uint64_t vertex) const {
  return scene::stored_scalar(number(vertex, layout_.scalar), layout_.scalar_origin);
}

glm::dvec3 RecordMesh::three(uint64_t vertex, const Fields& fields) const {
  return {number(vertex, fields[0]), number(vertex, fields[1]), number(vertex, fields[2])};
}

uint32_t RecordMesh::colour(uint64_t vertex) const {
  const glm::dvec3 c = three(vertex, layout_.colour);
  return pack_rgb(uint32_t(c.x), uint32_t(c.y), uint32_t(c.z));
}

}  // namespace telesplat::data
