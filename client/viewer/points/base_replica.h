// A viewer's replica of the base, the coarse form of the whole data set: asks the packer for the nodes that are wanted
// where the head is. Messages come in, requests and meshes go out; no sockets, no clocks.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "common/core/result.h"
#include "common/splat/base_mesh.h"
#include "common/wire/point_messages.h"

namespace telesplat::viewer {

class BaseReplica {
 public:
  static constexpr size_t kWindow = 4;      ///< parts under way
  static constexpr double kPatience_s = 1;  ///< after which a request is repeated
  static constexpr double kPlans_s = 0.1;   ///< time between two plans

  /// Sends a request; the caller fills in the viewer.
  explicit BaseReplica(std::function<void(wire::BaseRequest)> ask) : ask_(std::move(ask)) {}

  /// Triangles that the base is to show at most; 0: the session has no base, and nothing is asked for.
  void expect(uint64_t most) { most_ = most; }
  /// The packer is at another address, or another one: its base is not known.
  void start(double now_s);
  /// Plans which nodes are wanted, and asks for those, and again for what did not come. Nothing: no picture is drawn.
  void tick(const std::optional<splat::Viewpoint>& from, double now_s);
  void take(const wire::BaseBegin& begin, double now_s);
  void take(const wire::BaseTree& tree, double now_s);
  void take(const wire::BaseHidden& hidden, double now_s);
  /// Error: the part cannot be decoded, or lies beyond its limits.
  Status take(const wire::BasePart& part, double now_s);
  /// Drops the triangles of a node. No effect if there is no such node.
  void drop(uint32_t node);
  /// Nodes that were dropped because others are wanted, since the last call.
  std::vector<uint32_t> take_dropped() { return std::exchange(dropped_, {}); }

  /// True once a base has begun.
  bool known() const { return !nodes_.empty(); }
  /// Changes whenever mesh() does.
  uint64_t changes() const { return changes_; }
  /// Returns what has come: children only where all of a node's are whole. Null: nothing has.
  std::shared_ptr<const splat::BaseMesh> mesh() const;

 private:
  struct Node {
    geometry::ChunkInfo info;
    std::vector<std::shared_ptr<const splat::BasePart>> parts;  // null: has not come
    size_t came = 0;
    uint64_t wanted = 0;  // newest plan that wants it
    bool whole() const { return came == parts.size(); }
  };
  struct Hidden {
    std::vector<uint64_t> bits, numbers;  // a part's words; messages that they come from
    std::shared_ptr<const splat::BaseNode::Bits> shown;
  };
  void ask(uint64_t part, uint64_t parts, double now_s);
  void ask_more(double now_s);
  void clear();
  void plan(const splat::Viewpoint& from);
  void make_room();
  uint32_t node_of(uint64_t part) const;
  void set_word(uint32_t index, uint64_t bits, uint64_t number, std::vector<uint64_t>& touched);
  void append(uint32_t node, splat::BaseMesh& out) const;

  std::function<void(wire::BaseRequest)> ask_;
  InstanceId packer_;
  uint64_t base_ = 0;    // the packer's number of the base that is held, which may be none; 0: not known
  uint64_t newest_ = 0;  // newest number that the packer told
  std::vector<Node> nodes_;
  std::vector<uint32_t> roots_;
  std::vector<uint64_t> first_part_{0};          // wire::first_base_parts()
  std::unordered_map<uint64_t, Hidden> hidden_;  // by part
  uint64_t published_ = 0;                       // newest wire::BaseHidden::number; 0: none
  struct Plan {
    uint64_t number = 0, triangles = 0, changes = 0;
    std::vector<uint32_t> nodes;  // wanted, the most urgent first
    double made_s = -1e9;
  } plan_;
  std::vector<uint64_t> under_way_;  // parts
  std::vector<uint32_t> dropped_;
  uint64_t changes_ = 0, most_ = 0;
  double heard_s_ = 0;
  bool active_ = false;  // start() was called
};

}  // namespace telesplat::viewer
