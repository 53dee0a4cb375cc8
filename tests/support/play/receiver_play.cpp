#include <fmt/format.h>

#include "common/codec/depth_codec.h"
#include "common/core/log.h"
#include "tests/support/packer_scenes.h"
#include "tests/support/play/any_message.h"
#include "tests/support/play/play.h"
#include "tests/support/play/viewer_part.h"

namespace telesplat::test {
namespace {

constexpr size_t kMostMessages = 400;
constexpr InstanceId kViewer{5}, kHonest{999};
constexpr int kPlayWidth = 48, kPlayHeight = 32;

// Some tiles as packers publish them.
struct Tiles {
  struct Tile {
    geometry::Camera camera;
    geometry::Rect rect;
    std::vector<uint8_t> stream;
    std::vector<uint8_t> bounded, refinement;  // the image with errors, and the refinement that makes it exact
  };
  std::vector<Tile> all;
  Tiles() {
    for (const glm::dvec3 eye : {glm::dvec3(0, 0.3, 0.8), glm::dvec3(0.5, 0.2, 0.5)}) {
      const auto camera = scene_camera(eye, kPlayWidth, kPlayHeight);
      for (const geometry::Rect rect :
           {geometry::Rect{0, 0, 24, 32}, geometry::Rect{24, 0, 24, 32}, geometry::Rect{8, 8, 16, 16}})
        add(camera, rect);
    }
  }

 private:
  void add(const geometry::Camera& camera, const geometry::Rect& rect) {
    const image::DepthImage exact = sample_scene(camera, rect);
    image::DepthImage decoded;
    const auto bounds = codec::error_bounds(1.0 / 4, 1 / camera.focal_x(), 1, 2);
    auto bounded = codec::encode(exact, bounds, &decoded);
    all.push_back({camera, rect, codec::encode(exact), std::move(bounded), codec::encode_refinement(exact, decoded)});
  }
};
const Tiles& tiles() {
  static const Tiles t;
  return t;
}

class ReceiverPlay {
 public:
  explicit ReceiverPlay(std::span<const uint8_t> bytes) : dice_(bytes), any_(dice_, values_) {
    values_.ids = 5;
    for (const auto& t : tiles().all) {
      values_.cameras.push_back(t.camera);
      values_.bulk.push_back(std::as_bytes(std::span(t.stream)));
    }
    viewer_.start();
  }

  Complaint run() {
    for (size_t step = 0; step < kMostMessages && !dice_.over(); ++step) act();
    return in_the_end();
  }

  const Reached& reached() const { return reached_; }

 private:
  void act() {
    switch (dice_.below(16)) {
      case 0:
        return send(any_.make<wire::Patch>());
      case 1:
        return send(any_.make<wire::Forget>());
      case 2:
        return send(any_.make<wire::EpochBegin>());
      case 3:
        return send(any_.make<wire::StateMark>());
      case 4:
        return viewer_.tick();
      case 5:
        return viewer_.hold(dice_.chance(40));
      case 6:
        return dice_.chance(20) ? viewer_.start() : (void)(packer_ = {dice_.below(4)});
      case 7:
        config_ = scene_config(int(3 + dice_.below(4)));
        config_.compact = dice_.chance(50);
        return;
      case 8: {
        if (dice_.chance(20))
          return send(over_the_wire(wire::StateBegin{packer_, {dice_.chance(50) ? 0 : sequence()}}));
        wire::StateMark m{packer_, {sequence()}, epoch(), dice_.chance(60), dice_.below(100)};
        return send(over_the_wire(m));
      }
      case 9:
        return send(over_the_wire(wire::EpochBegin{packer_, {sequence()}, epoch_ = {1 + dice_.below(5)}}));
      case 10: {
        wire::Forget m{packer_, {sequence()}, epoch(), {}, {}};
        for (uint64_t n = dice_.below(12); n-- > 0;) m.clusters.push_back(uint32_t(dice_.below(600)));
        if (dice_.chance(40)) m.frames.assign(m.clusters.size(), uint32_t(dice_.below(6)));
        return send(over_the_wire(m));
      }
      case 11:
        return refine();
      default:
        return patch();
    }
  }

  uint64_t sequence() {
    return dice_.chance(75) ? ++sequence_ : dice_.chance(50) ? dice_.below(sequence_ + 4) : (sequence_ = 1);
  }
  EpochId epoch() { return dice_.chance(85) ? epoch_ : EpochId{dice_.below(6)}; }

  void patch() {
    const auto& tile = dice_.pick(tiles().all);
    wire::Patch p{.packer = packer_, .sequence = {sequence()}, .epoch = epoch(), .frame = {dice_.below(9)}};
    p.viewer = dice_.chance(60) ? kViewer : InstanceId{6};
    p.request = {dice_.below(9)};
    p.tile = dice_.below(2), p.tiles_in_frame = 2, p.step = dice_.chance(70) ? 1 : 4;
    p.extra = dice_.chance(30), p.frame_complete = dice_.chance(50), p.left_out = dice_.below(3) / 2;
    p.camera = tile.camera, p.rect = tile.rect;
    p.counts = {100, 100};
    p.refinable = dice_.chance(40);
    const auto& stream = !dice_.chance(90) ? dice_.pick(tiles().all).stream : p.refinable ? tile.bounded : tile.stream;
    p.image = std::as_bytes(std::span(stream));
    if (p.refinable) refinable_ = {p.sequence, &tile};
    if (dice_.chance(15)) {
      p.missed.rect = {0, 0, int(1 + dice_.below(kPlayWidth)), int(1 + dice_.below(kPlayHeight))};
      for (uint64_t n = 1 + dice_.below(6); n-- > 0;)
        p.missed.words.push_back(uint32_t(dice_.below(256)) * 0x01010101u);
    }
    send(over_the_wire(p));
  }
  // Refines mostly the patch that may be refined, with the data that belong to it.
  void refine() {
    wire::Refine r{packer_, {sequence()}, epoch(), dice_.chance(80) ? refinable_.first : Sequence{sequence_}, {}};
    const auto& tile = refinable_.second && dice_.chance(80) ? *refinable_.second : dice_.pick(tiles().all);
    r.image = std::as_bytes(std::span(tile.refinement));
    if (dice_.chance(10)) r.image = r.image.first(dice_.below(r.image.size()));
    send(over_the_wire(r));
  }
  template <class M>
  void send(std::optional<Arrived<M>> m) {
    if (!m) return;
    if (dice_.chance(60))
      viewer_.take_event(M::kName, *m->body);
    else
      viewer_.take_answer(M::kName, *m->body);
  }

  // One packer remains, and publishes from its first event on.
  Complaint in_the_end() {
    reached_["points"] += viewer_.figures().points_received;
    reached_["gaps"] += viewer_.figures().gaps;
    reached_["epochs shown"] += viewer_.figures().epochs_shown;
    reached_["decode errors"] += viewer_.figures().decode_errors;
    reached_["patches refined"] += viewer_.figures().patches_refined;
    config_ = scene_config(4);
    packer::Config config;
    config.model = config_;
    packer::PackerCore core(config, {9});
    viewer_.hold(false);
    uint64_t frame = 0;
    for (const auto& tile : tiles().all) {
      packer::SampledTile t;
      t.frame = {++frame}, t.epoch = {9}, t.camera = tile.camera, t.rect = tile.rect, t.tiles_in_frame = 1;
      t.image = codec::decode(tile.stream).value();
      const auto event = core.submit(std::move(t), double(frame));
      CHECK(event.ok() && event->has_value());
      const packer::Event& e = **event;
      if (!e.is_told()) continue;
      wire::Patch p{.packer = kHonest, .sequence = e.sequence, .epoch = e.epoch, .frame = e.frame, .tiles_in_frame = 1};
      p.frame_complete = e.frame_complete, p.camera = e.camera, p.rect = e.rect,
      p.image = std::as_bytes(std::span(*e.blob));
      viewer_.take_event(wire::Patch::kName, wire::encode(p));
    }
    if (viewer_.digest() == core.model().digest()) return std::nullopt;
    return fmt::format("in the end the replica is {:x}, the model {:x}", viewer_.digest(), core.model().digest());
  }

  static ViewerPart::Pipes& pipes() {
    static net::Context context;
    static ViewerPart::Pipes p(context);
    return p;
  }

  Dice dice_;
  Values values_;
  AnyMessage any_;
  points::ModelConfig config_ = scene_config(4);
  InstanceId packer_{1};
  EpochId epoch_{1};
  uint64_t sequence_ = 0;
  std::pair<Sequence, const Tiles::Tile*> refinable_{};
  Reached reached_;
  ViewerPart viewer_{kViewer, pipes(), [this] { return config_; }, [](const wire::StateRequest&) {}};
};

}  // namespace

Complaint play_receiver(std::span<const uint8_t> bytes, Reached* reached) {
  log::initialise("play", "off");
  ReceiverPlay play(bytes);
  Complaint complaint = play.run();
  if (reached)
    for (const auto& [what, times] : play.reached()) (*reached)[what] += times;
  return complaint;
}

}  // namespace telesplat::test
