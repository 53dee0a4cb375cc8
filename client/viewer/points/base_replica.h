// A viewer's replica of the base, the coarse form of the whole data set: asks the packer for its parts. Messages come
// in, requests and meshes go out; no sockets, no clocks.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <unordered_map>
#include <vector>

#include "common/core/result.h"
#include "common/splat/base_mesh.h"
#include "common/wire/point_messages.h"

namespace telesplat::viewer {

class BaseReplica {
 public:
  static constexpr uint64_t kWindow = 4;    ///< parts under way
  static constexpr double kPatience_s = 1;  ///< after which a request is repeated

  /// Sends a request; the caller fills in the viewer.
  explicit BaseReplica(std::function<void(wire::BaseRequest)> ask) : ask_(std::move(ask)) {}

  /// Says whether the session has a base; without one, nothing is asked for.
  void expect(bool base) { expected_ = base; }
  /// The packer is at another address, or another one: its base is not known.
  void start(double now_s);
  /// Asks again for what did not come.
  void tick(double now_s);
  void take(const wire::BaseBegin& begin, double now_s);
  void take(const wire::BaseHidden& hidden, double now_s);
  /// Error: the part cannot be decoded, or lies beyond its limits.
  Status take(const wire::BasePart& part, double now_s);

  /// True once a base has begun.
  bool known() const { return !parts_.empty(); }
  /// True once all parts have come.
  bool complete() const { return known() && came_ == parts_.size(); }
  /// Changes whenever mesh() does.
  uint64_t changes() const { return changes_; }
  /// Returns the coarse parts that have come, or, once all others have, those. Null: none has come.
  std::shared_ptr<const splat::BaseMesh> mesh() const;

 private:
  void ask(uint64_t part, uint64_t parts, double now_s);
  void set_word(uint32_t index, uint64_t bits, uint64_t number);

  std::function<void(wire::BaseRequest)> ask_;
  InstanceId packer_;
  uint64_t base_ = 0;  // the packer's number; 0: not known
  std::vector<std::shared_ptr<const splat::BasePart>> parts_;
  struct Word {
    uint64_t bits = 0, number = 0;
  };
  std::unordered_map<uint32_t, Word> hidden_;
  uint64_t published_ = 0;  // newest wire::BaseHidden::number; 0: none
  size_t coarse_ = 0, came_ = 0;
  uint64_t asked_ = 0;  // parts before it were asked for
  uint64_t changes_ = 0;
  double heard_s_ = 0;
  bool active_ = false;  // start() was called
  bool expected_ = true;
};

}  // namespace telesplat::viewer
