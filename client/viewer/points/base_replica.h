// A viewer's replica of the base, the coarse form of the whole data set: asks the packer for its parts, and keeps the
// numbers of hidden surfels. Messages come in, requests and mosaics of leaves go out; no sockets, no clocks.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <unordered_map>
#include <utility>
#include <vector>

#include "common/codec/surfel_codec.h"
#include "common/points/point_model.h"
#include "common/wire/point_messages.h"

namespace telesplat::viewer {

class BaseReplica {
 public:
  static constexpr uint64_t kWindow = 4;    ///< parts under way
  static constexpr double kPatience_s = 1;  ///< after which a request is repeated
  /// Mosaics' spacing over that of the surfels: means of neighbouring cells lie up to that far apart.
  static constexpr float kSpread = 1.2f;

  /// Sends a request; the caller fills in the viewer.
  explicit BaseReplica(std::function<void(wire::BaseRequest)> ask) : ask_(std::move(ask)) {}

  /// Says whether the session has a base; without one, nothing is asked for.
  void expect(bool base) { expected_ = base; }
  /// The packer is at another address, or another one: its base is not known.
  void start(double now_s);
  /// Asks again for what did not come.
  void tick(double now_s);
  /// Error: the part cannot be decoded, or contradicts earlier ones.
  Status take(const wire::BasePart& part, double now_s);
  void take(const wire::BaseHidden& hidden, double now_s);
  /// True once all parts have come.
  bool complete() const { return came_count_ > 0 && came_count_ == came_.size(); }

  /// True once a base has begun.
  bool known() const { return config_.has_value(); }
  /// The octree of its leaves. Precondition: known().
  const points::ModelConfig& config() const { return *config_; }
  /// Counts bases; each begins empty.
  uint64_t number() const { return count_; }
  /// Returns the leaves that changed since the last call, at most `most`, with the mosaic of their surfels that are not
  /// hidden; nullopt: all are hidden.
  std::vector<std::pair<points::ClusterKey, std::optional<points::Mosaic>>> take_changes(size_t most);

 private:
  struct Leaf {
    uint32_t first = 0;   // number of its first surfel in the base
    uint32_t stride = 1;  // wire::kBaseStride while only part 0 has come
    std::vector<codec::LeafSurfel> surfels;
    /// Returns the number of its surfel i in the base.
    uint32_t number(size_t i) const { return first + stride * static_cast<uint32_t>(i); }
  };
  bool is_older(InstanceId packer, uint64_t base) const { return packer == packer_ && base < base_; }
  void begin(InstanceId packer, uint64_t base);
  void ask(uint64_t part, uint64_t parts, double now_s);
  void set_word(uint32_t index, uint64_t word, uint64_t number);
  std::optional<points::Mosaic> mosaic(const Leaf& leaf);

  std::function<void(wire::BaseRequest)> ask_;
  InstanceId packer_;
  uint64_t base_ = 0;  // the packer's number; 0: not known
  uint64_t count_ = 0;
  std::optional<points::ModelConfig> config_;
  double spacing_m_ = 0;
  std::vector<bool> came_;  // parts
  size_t came_count_ = 0;
  uint64_t asked_ = 0;  // parts before it were asked for
  double heard_s_ = 0;
  bool active_ = false;  // start() was called
  bool expected_ = true;
  std::unordered_map<points::ClusterKey, Leaf> leaves_;
  std::map<uint32_t, points::ClusterKey> order_;  // leaves by Leaf::first
  struct Word {
    uint64_t bits = 0, number = 0;
  };
  std::unordered_map<uint32_t, Word> hidden_;
  uint64_t published_ = 0;  // newest wire::BaseHidden::number; 0: none
  std::set<points::ClusterKey> changed_;
  uint64_t mosaics_ = 0;
};

}  // namespace telesplat::viewer
