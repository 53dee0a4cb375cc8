// Follows the session and what samples tell of the base, and sends it to viewers.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "common/net/socket.h"
#include "common/scene/colouring.h"
#include "services/packer/packing.h"
#include "services/packer/points/base/base.h"
#include "services/packer/points/base/base_fetch.h"

namespace telesplat::packer {

class BaseFeed {
 public:
  /// Keeps references to both. context: null: there is no base.
  BaseFeed(net::Context* context, const Outlets& outlets)
      : outlets_(outlets), wanted_(context != nullptr), fetch_(context) {}

  /// Follows the session. anew: the packer's model holds no samples yet.
  void follow(const wire::Welcome& session, bool anew);
  std::vector<net::Socket*> sockets() { return fetch_.sockets(); }
  /// Takes the data server's answers.
  void receive();
  /// Asks for chunks that are wanted. packer: as viewers know this packer.
  void tick(InstanceId packer, double now_s);
  /// A viewer asks for parts.
  void answer(const wire::BaseRequest& request, const std::string& peer);

  /// Keeps the rays of a tile for take_noted(): viewers wait for its points first. whole: all pixels were cast;
  /// cast: else its rays; null: not known.
  void note(const SampledTile& tile, bool whole, const image::PixelMask* cast);
  /// Learns from the rays, and publishes what changed.
  void take_noted();
  /// The packer forgot clusters of its model.
  void forgotten(const Event& event, const points::PointModel& model);
  /// Tells viewers which base there is, and what changed.
  void publish();

  size_t triangles() const { return base_ ? base_->triangles() : 0; }

 private:
  // The base depends on these.
  struct Scene {
    std::string content_hash, colouring;
    uint64_t most = 0;
    float largest_m = 0;
    bool operator==(const Scene&) const = default;
  };
  void publish(bool whole);
  void drop();
  void begin(std::vector<geometry::ChunkInfo> nodes);
  void take(ChunkId chunk, const Result<geometry::HeldChunk>& held);
  void send_part(uint64_t part, const std::string& peer);
  wire::BaseBegin summary() const { return {packer_, number_, base_ ? base_->nodes().size() : 0}; }

  const Outlets& outlets_;
  const bool wanted_;  // false: there is no base
  BaseFetch fetch_;
  Scene scene_;  // most == 0: no base is wanted
  std::optional<scene::ColourTable> colours_;
  std::optional<Base> base_;  // the base that viewers have
  // Parts that viewers wait for.
  struct Waiting {
    uint64_t part;
    std::string peer;
  };
  std::deque<Waiting> waiting_;
  struct Noted {
    SampledTile tile;
    std::optional<image::PixelMask> cast;
  };
  std::optional<Noted> noted_;
  InstanceId packer_;
  uint64_t number_ = 0;     // counts bases
  uint64_t published_ = 0;  // wire::BaseHidden::number of the newest message
};

}  // namespace telesplat::packer
