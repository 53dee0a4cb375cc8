// Turns a depth-image tile into mosaics: unproject, decimate, sort into leaves (T4.3.2, T7.2).
#include <algorithm>
#include <glm/geometric.hpp>
#include <numeric>

#include "common/points/decimate.h"
#include "common/points/mosaic_builder.h"

namespace telesplat::points {
namespace {

// Leaf and position of each pixel of the tile. All values are written, so they need not be cleared first. Rows without
// a sample have kNoCluster.
struct UnprojectedTile {
  std::unique_ptr<ClusterKey[]> keys;
  std::unique_ptr<uint16_t[]> x, y, z;
};

UnprojectedTile unproject(const OctreeGrid& grid, const geometry::Camera& camera, const geometry::Rect& tile,
                          const image::DepthImage& image) {
  const size_t pixels = image.pixels();
  UnprojectedTile out{
      std::make_unique_for_overwrite<ClusterKey[]>(pixels), std::make_unique_for_overwrite<uint16_t[]>(pixels),
      std::make_unique_for_overwrite<uint16_t[]>(pixels), std::make_unique_for_overwrite<uint16_t[]>(pixels)};
  for (int row = 0; row < tile.height; ++row) {
    const size_t first = static_cast<size_t>(row) * tile.width;
    const uint32_t* depth = image.depth.data() + first;
    uint32_t any = 0;
    for (int x = 0; x < tile.width; ++x) any |= depth[x];
    // Decimation reads four rows at once if one of them has a sample.
    if (any == 0) {
      std::fill_n(out.keys.get() + first, tile.width, kNoCluster);
      continue;
    }
    unproject_row(row_rays(grid, camera, tile.x, tile.y + row), image.depth.data() + first, tile.width,
                  out.keys.get() + first, {out.x.get() + first, out.y.get() + first, out.z.get() + first});
  }
  return out;
}

// A mosaic being filled: the next free place of each rank.
struct OpenMosaic {
  MosaicBuilder arrays;
  std::array<uint32_t, kRanks> next;

  uint32_t place(int rank, const UnprojectedTile& tile, const image::DepthImage& image, size_t pixel) {
    const uint32_t at = next[rank]++;
    arrays.x[at] = tile.x[pixel], arrays.y[at] = tile.y[pixel], arrays.z[at] = tile.z[pixel];
    arrays.normal[at] = image.normal[pixel];
    arrays.colour[at] = image.colour[pixel];
    return at;
  }
};

std::vector<OpenMosaic> open_mosaics(const std::vector<DecimatedTile::Leaf>& leaves, Sequence sequence, FrameId frame) {
  std::vector<OpenMosaic> out;
  out.reserve(leaves.size());
  for (const auto& leaf : leaves) {
    std::array<uint32_t, kRanks> first;
    const uint32_t n0 = std::reduce(leaf.count.begin(), leaf.count.end());
    std::exclusive_scan(leaf.count.begin(), leaf.count.end(), first.begin(), 0u);
    out.push_back({MosaicBuilder(sequence, frame, {n0, first[kFirstRankOfLevel0], first[1]}), first});
  }
  return out;
}

void place_block(const BlockEntry& block, const UnprojectedTile& tile, const image::DepthImage& image, OpenMosaic& m) {
  const size_t w = image.width;
  // First pixels of the four 2x2 blocks: the one near the centre belongs to all levels. A mosaic that holds a block has
  // coarser levels with fewer points, hence mean colours.
  const uint32_t centre = m.place(0, tile, image, block.pixel + 2 * w + 2);
  m.arrays.mean1[centre] = block.mean[3];
  m.arrays.mean2[centre] = block.mean[4];
  const size_t block_offset[4] = {0, 2, 2 * w, 2 * w + 2};
  for (int rank = 1; rank < kFirstRankOfLevel0; ++rank) {
    const int sub = kBlockOrder[rank];
    m.arrays.mean1[m.place(rank, tile, image, block.pixel + block_offset[sub])] = block.mean[sub];
  }
  const size_t pixel_offset[4] = {0, 1, w, w + 1};
  int rank = kFirstRankOfLevel0;
  for (const int p : kPixelOrder)
    for (const int sub : kBlockOrder) m.place(rank++, tile, image, block.pixel + block_offset[sub] + pixel_offset[p]);
}

void place_sample(const SampleEntry& sample, const UnprojectedTile& tile, const image::DepthImage& image,
                  OpenMosaic& m) {
  const uint32_t at = m.place(static_cast<int>(sample.rank), tile, image, sample.pixel);
  if (sample.rank < kFirstRankOfLevel0 && m.arrays.mean1) m.arrays.mean1[at] = sample.mean[0];
  if (sample.rank == 0 && m.arrays.mean2) m.arrays.mean2[at] = sample.mean[1];
}

}  // namespace

float pixel_range(const geometry::Camera& camera, const glm::dvec3& leaf_centre_room, double leaf_size_m) {
  const glm::dvec3 backward = camera.pose.orientation * glm::dvec3(0, 0, 1);
  const double depth = glm::dot(camera.pose.position_room - leaf_centre_room, backward);
  return static_cast<float>(leaf_size_m * camera.focal_x() / std::max(depth, 0.5 * leaf_size_m));
}

PreparedPatch prepare_patch(const ModelConfig& config, Sequence sequence, const geometry::Camera& camera,
                            const geometry::Rect& tile, const image::DepthImage& image, FrameId frame) {
  CHECK(tile.width == image.width && tile.height == image.height);
  CHECK(tile.x >= 0 && tile.y >= 0 && tile.x + tile.width <= camera.width && tile.y + tile.height <= camera.height);
  const OctreeGrid grid = octree_grid(config);
  const UnprojectedTile unprojected = unproject(grid, camera, tile, image);
  const DecimatedTile decimated = decimate(tile, image, unprojected.keys.get());

  // Counting sort by leaf and rank.
  std::vector<OpenMosaic> open = open_mosaics(decimated.leaves, sequence, frame);
  for (const BlockEntry& block : decimated.blocks) place_block(block, unprojected, image, open[block.leaf]);
  for (const SampleEntry& sample : decimated.samples) place_sample(sample, unprojected, image, open[sample.leaf]);

  std::vector<uint32_t> by_key(open.size());
  std::iota(by_key.begin(), by_key.end(), 0u);
  std::sort(by_key.begin(), by_key.end(),
            [&](uint32_t a, uint32_t b) { return decimated.leaves[a].key < decimated.leaves[b].key; });
  PreparedPatch patch{sequence};
  patch.mosaics.reserve(open.size());
  for (const uint32_t i : by_key) {
    const ClusterKey key = decimated.leaves[i].key;
    const glm::dvec3 cell(key & 1023, key >> 10 & 1023, key >> 20 & 1023);
    const glm::dvec3 centre = grid.lo + (cell + 0.5) * grid.leaf_size;
    const glm::vec3 to_eye(camera.pose.position_room - centre);
    patch.mosaics.emplace_back(key, open[i].arrays.finish(pixel_range(camera, centre, grid.leaf_size), to_eye));
    patch.points += patch.mosaics.back().second.count(0);
  }
  const auto nothing = std::count(image.depth.begin(), image.depth.end(), 0u);
  patch.outside = image.pixels() - static_cast<uint64_t>(nothing) - patch.points;
  return patch;
}

}  // namespace telesplat::points
