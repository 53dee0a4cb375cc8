// Fetches the base from the data server, follows what samples tell of it, and sends it to viewers.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/net/socket.h"
#include "services/packer/packing.h"
#include "services/packer/points/base/base.h"

namespace telesplat::packer {

class BaseFeed {
 public:
  /// Keeps references to both. context: null: there is no base.
  BaseFeed(net::Context* context, const Outlets& outlets) : context_(context), outlets_(outlets) {}

  /// Follows the session. model: of the packer; anew: that model holds no samples yet.
  void follow(const wire::Welcome& session, const points::ModelConfig& model, bool anew);
  std::vector<net::Socket*> sockets();
  /// Takes the data server's answers.
  void receive();
  /// Asks for the base if it is wanted. packer: as viewers know this packer.
  void tick(InstanceId packer, double now_s);
  /// A viewer asks for parts.
  void answer(const wire::BaseRequest& request, const std::string& peer) const;

  /// Keeps the rays of a tile for take_noted(): viewers wait for its points first. whole: all pixels were cast;
  /// cast: else its rays; null: not known.
  void note(const SampledTile& tile, bool whole, const image::PixelMask* cast);
  /// Learns from the rays, and publishes what changed.
  void take_noted();
  /// The packer forgot clusters of its model.
  void forgotten(const Event& event, const points::PointModel& model);
  /// Publishes what changed.
  void publish();

  size_t surfels() const { return base_ ? base_->surfels() : 0; }

 private:
  // The base depends on these.
  struct Scene {
    std::string content_hash, colouring;
    uint64_t most = 0;
    points::ModelConfig model;
    bool operator==(const Scene&) const = default;
  };
  void connect(const std::string& endpoint);
  void drop();
  void take_surfels(const wire::Surfels& surfels);
  void publish(bool whole);

  net::Context* const context_;
  const Outlets& outlets_;
  std::optional<net::Socket> blocks_;
  std::string endpoint_;
  Scene scene_;  // most == 0: no base is wanted
  std::string array_;
  std::optional<scene::ColourTable> colours_;
  EpochId epoch_;  // epoch that scene_ began with: requests have it, and answers repeat it
  std::optional<Base> base_;
  struct Noted {
    SampledTile tile;
    std::optional<image::PixelMask> cast;
  };
  std::optional<Noted> noted_;
  bool asks_ = false;  // true: the data server has yet to answer
  double asked_s_ = -1e9, patience_s_ = 0;
  InstanceId packer_;
  uint64_t number_ = 0;     // counts bases
  uint64_t published_ = 0;  // wire::BaseHidden::number of the newest message
};

}  // namespace telesplat::packer
