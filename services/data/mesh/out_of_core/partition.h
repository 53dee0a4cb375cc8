// Divides the triangles of a mesh that is not in memory into parts that fit there: a k-d tree over a sample of their
// centroids, and for each part a list of its triangles in a scratch file.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/core/descriptor.h"
#include "common/core/result.h"
#include "services/data/base/random_mesh.h"

namespace telesplat::data {

/// A k-d tree whose leaves are parts with about as many of the sampled points each. Four parts that follow each other,
/// counted from the first, are close together.
class PartTree {
 public:
  /// Precondition: at least one point, and at least one part.
  PartTree(std::vector<glm::vec3> points, size_t parts);
  size_t parts() const { return parts_; }
  uint32_t part_of(const glm::vec3& point) const;

 private:
  struct Split {
    int axis;
    float at;  // points below it go left
  };
  void divide(std::span<glm::vec3> points, size_t node, size_t parts);

  size_t parts_;
  std::vector<Split> splits_;  // in preorder: the left subtree follows its node
};

/// Lists of numbers that grow in turn, in a file without a name; numbers of a list come back in the order they came.
class ScratchLists {
 public:
  /// folder: where the file is made. Error: names it.
  static Result<ScratchLists> make(const std::string& folder, size_t lists);
  void add(size_t list, uint32_t number) {
    auto& open = open_[list];
    open.push_back(number);
    if (open.size() == kBlock) flush(list);
  }
  /// Returns the numbers of a list. Error: they could not be written, or read again.
  Result<std::vector<uint32_t>> take(size_t list) const;
  uint64_t size(size_t list) const { return blocks_[list].size() * kBlock + open_[list].size(); }

 private:
  static constexpr size_t kBlock = 1 << 14;
  ScratchLists(Descriptor file, size_t lists) : file_(std::move(file)), open_(lists), blocks_(lists) {}
  void flush(size_t list);

  Descriptor file_;
  std::vector<std::vector<uint32_t>> open_;    // not written yet
  std::vector<std::vector<uint64_t>> blocks_;  // where full blocks are
  uint64_t end_ = 0;
  int failure_ = 0;  // errno
};

/// The triangles of each part, and those around them: each list ascends.
struct Partition {
  ScratchLists own;
  /// Triangles of other parts that share a vertex with one of its own.
  std::vector<std::vector<uint32_t>> around;
};

/// nullopt: the mesh is tangled, more than a quarter of its triangles lie around parts. Error: the scratch file cannot
/// be made. Precondition: every triangle has three corners that exist. progress: 0..1.
Result<std::optional<Partition>> divide(const RandomMesh& mesh, const PartTree& tree, const std::string& folder,
                                        const std::function<void(double)>& progress);

/// Calls turn(first, corners) for blocks of triangles in order, with three vertices for each. Returns false if one of
/// them has another number of corners; then the rest is left out.
bool for_blocks(const RandomMesh& mesh, const std::function<void(uint64_t first, std::span<const uint32_t>)>& turn);

/// A triangle's centroid, rounded, in the file's units.
glm::vec3 centroid(const RandomMesh& mesh, const uint32_t* corners);

}  // namespace telesplat::data
