// Which axis of a mesh points up, guessed from its shape.
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "services/data/mesh/placing/placement.h"
#include "services/data/vtk/reader.h"

namespace telesplat::data {
namespace {

// A surface over the plane of x and y: flat on the whole, and seen from one side.
bool is_height_field(const Mesh& mesh, const glm::dvec3& size) {
  if (!(size.z < 0.35 * size.x && size.z < 0.35 * size.y)) return false;
  glm::dvec3 sum(0);
  double area = 0;
  for (size_t i = 0; i < mesh.indices.size(); i += 3) {
    const glm::dvec3 a = mesh.positions[mesh.indices[i]];
    const glm::dvec3 n = glm::cross(mesh.positions[mesh.indices[i + 1]] - a, mesh.positions[mesh.indices[i + 2]] - a);
    sum += n;
    area += glm::length(n);
  }
  const double length = glm::length(sum);
  return length >= 0.4 * area && std::abs(sum.z) >= 0.87 * length;
}

// For each of the sampled coordinates: whether its value occurs at least kRepeats times among them.
std::vector<bool> repeated(const std::vector<double>& values) {
  constexpr size_t kRepeats = 6;
  std::vector<uint32_t> order(values.size());
  for (size_t i = 0; i < order.size(); ++i) order[i] = static_cast<uint32_t>(i);
  std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) { return values[a] < values[b]; });
  std::vector<bool> out(values.size());
  for (size_t first = 0, last = 0; first < order.size(); first = last) {
    while (last < order.size() && values[order[last]] == values[order[first]]) ++last;
    for (size_t i = first; i < last; ++i) out[order[i]] = last - first >= kRepeats;
  }
  return out;
}

}  // namespace

// Marching cubes puts its vertices on the edges of the voxel grid: two coordinates are those of grid planes and so
// shared with many other vertices, the third lies in between and is shared with few. Scans share none, CAD models
// mostly all three.
bool is_isosurface(const Mesh& mesh) {
  constexpr size_t kSamples = 1 << 16, kFewest = 2000;
  const size_t vertices = mesh.positions.size(), step = std::max<size_t>(vertices / kSamples, 1);
  if (vertices < kFewest) return false;
  std::vector<double> values[3];
  for (size_t v = 0; v < vertices; v += step)
    for (int a = 0; a < 3; ++a) values[a].push_back(mesh.positions[v][a]);
  const std::vector<bool> shared[3] = {repeated(values[0]), repeated(values[1]), repeated(values[2])};
  size_t two_or_more = 0, exactly_two = 0;
  for (size_t i = 0; i < values[0].size(); ++i) {
    const int count = shared[0][i] + shared[1][i] + shared[2][i];
    two_or_more += count >= 2;
    exactly_two += count == 2;
  }
  return 10 * two_or_more >= 9 * values[0].size() && 2 * exactly_two >= values[0].size();
}

UpGuess guess_up(const Mesh& mesh) {
  if (mesh.format == "raster") return {"z", "an elevation raster"};
  if (mesh.format == "iso") return {"z", "the surface of a volume"};
  geometry::DBox box;
  for (uint32_t i : mesh.indices) box.extend(mesh.positions[i]);
  if (vtk::is_mesh_kind(mesh.format)) return {"z", "VTK's formats hold scans and simulations"};
  if (is_height_field(mesh, box.size())) return {"z", "shaped like a terrain"};
  if (is_isosurface(mesh)) return {"z", "its vertices lie on a voxel grid, as a scan's surface does"};
  return {"y", "nothing tells of a terrain or a scan"};
}

}  // namespace telesplat::data
