#include <fmt/format.h>

#include <deque>
#include <map>

#include "common/codec/depth_codec.h"
#include "common/codec/mask_stream.h"
#include "common/core/log.h"
#include "services/packer/points/point_packing.h"
#include "tests/support/keys/lease_key.h"
#include "tests/support/play/any_message.h"
#include "tests/support/play/play.h"
#include "tests/support/play/viewer_part.h"
#include "tests/support/points_scenes.h"

namespace telesplat::test {
namespace {

constexpr size_t kMostSteps = 250, kViewers = 3;
constexpr size_t kMostQueued = 48;  // events that are published faster than they go out are lost
constexpr int kWidth = 64, kHeight = 48, kTile = 16;

// What samplers send: streams of tiles, made once.
class Streams {
 public:
  Streams() {
    for (const glm::dvec3 eye : {glm::dvec3(0, 0.3, 0.8), glm::dvec3(0.5, 0.2, 0.5), glm::dvec3(-0.6, 0.4, 0.1)})
      cameras.push_back(scene_camera(eye, kWidth, kHeight));
    geometry::Camera fine = cameras[0];
    fine.width *= 2, fine.height *= 2;
    cameras.push_back(fine);
  }
  const std::vector<uint8_t>& of(size_t camera, const geometry::Rect& rect) {
    auto& stream = streams_[{camera, rect.x, rect.y, rect.width, rect.height}];
    if (stream.empty()) stream = codec::encode(sample_scene(cameras[camera], rect));
    return stream;
  }
  std::vector<geometry::Camera> cameras;

 private:
  std::map<std::tuple<size_t, int, int, int, int>, std::vector<uint8_t>> streams_;
};
Streams& streams() {
  static Streams s;
  return s;
}

wire::Welcome welcome(Dice& dice, EpochId epoch, InstanceId master) {
  const points::ModelConfig model = scene_config(int(3 + dice.below(3)));
  wire::Welcome w;
  w.master = master, w.epoch = epoch;
  w.lease_key = lease_key();
  w.octree_depth = uint64_t(model.depth);
  w.box_room = model.box_room;
  if (dice.chance(20)) w.box_room = {w.box_room.lo * 2.f, w.box_room.hi * 2.f};
  w.facts["kind"] = "mesh";
  w.settings.keep_redundant = dice.chance(30);
  w.settings.max_points = dice.chance(30) ? 1500 : 0;
  w.settings.obsolete_after_s = dice.chance(30) ? 5 : 0;
  w.settings.validation = dice.below(3);
  w.settings.depth_error = dice.chance(50) ? 1.0 / 8 : -1;
  w.settings.normal_error = double(dice.below(3)) - 1;
  return w;
}

class PointsPlay {
 public:
  explicit PointsPlay(std::span<const uint8_t> bytes) : dice_(bytes), any_(dice_, values_) {
    values_.cameras = streams().cameras;
    values_.ids = 4;
    values_.bulk = {std::as_bytes(std::span(streams().of(0, {0, 0, kTile, kTile}))),
                    std::as_bytes(std::span(streams().of(1, {0, 0, kTile, kTile}))).first(20)};
    max_log_bytes_ = dice_.chance(30) ? 20000 : 0;
    start_packer();
    for (size_t v = 0; v < kViewers; ++v) {
      viewers_.push_back(std::make_unique<Viewer>(*this, v));
      viewers_.back()->part.start();
    }
  }

  Complaint run() {
    for (size_t step = 0; step < kMostSteps && !dice_.over() && !complaint_; ++step) {
      now_s_ += 0.01 * double(dice_.below(20));
      act();
      look_at_the_replicas();
    }
    if (!complaint_) in_the_end();
    return complaint_;
  }
  const Reached& reached() const { return reached_; }

 private:
  struct Sent {
    std::string type, body;
  };
  struct Viewer {
    Viewer(PointsPlay& play, size_t number)
        : id{101 + number},
          peer(fmt::format("peer-{}-0", number)),
          config(play.config()),
          part(
              id, pipes(number), [this] { return config; },
              [this](const wire::StateRequest& request) { requests.push_back(request); }) {}
    static ViewerPart::Pipes& pipes(size_t number) {
      static net::Context context;
      static std::array<ViewerPart::Pipes, kViewers> all{ViewerPart::Pipes(context), ViewerPart::Pipes(context),
                                                         ViewerPart::Pipes(context)};
      return all[number];
    }
    InstanceId id;
    std::string peer;
    points::ModelConfig config;  // as its newest welcome tells
    bool heard_late = false;     // its replica may be one of another configuration's
    viewer::PointReceiver::Figures figures;
    std::deque<wire::StateRequest> requests;  // on their way to the packer
    std::deque<Sent> events, answers;         // on their way from it
    ViewerPart part;
  };

  points::ModelConfig config() const {
    return {session_.box_room, int(session_.octree_depth), !session_.settings.keep_redundant};
  }

  void start_packer() {
    packing_.emplace(packer::PointPacking::Options{.threads = 1, .max_log_bytes = max_log_bytes_}, outlets(), spans_);
    session_ = welcome(dice_, epoch_, master_);
    packing_->follow(session_, now_s_);
  }
  void follow(const wire::Welcome& session) {
    session_ = session;
    packing_->follow(session_, now_s_);
  }
  packer::Outlets outlets() {
    return {.tell = [](const wire::TileDone&) {},
            .refuse = [this](const wire::TileRefused&) { ++reached_["tiles refused"]; },
            .to_viewers =
                [this](std::string_view type, std::string body) {
                  ++reached_[std::string(type)];
                  for (auto& v : viewers_)
                    if (v->events.size() < kMostQueued) v->events.push_back({std::string(type), body});
                },
            .to_viewer =
                [this](std::string_view peer, std::string_view type, std::string body) {
                  for (auto& v : viewers_)
                    if (v->peer == peer) return v->answers.push_back({std::string(type), std::move(body)}), true;
                  return false;
                },
            .tell_link = {},
            .master_now = [this] { return now_s_; },
            .to_master_s = [](double s) { return s; }};
  }

  void act() {
    Viewer& v = *dice_.pick(viewers_);
    switch (dice_.below(20)) {
      case 0:
        return change_the_session();
      case 1:
        return any_tile();
      case 2:
        return from_any<wire::StateRequest>();
      case 3:
        return from_any<wire::AccessReport>();
      case 4:
        return from_any<wire::Receipt>();
      case 5:
        return plan();
      case 6:
        return end_a_frame();
      case 7:
        return packing_->tick(now_s_ += 0.2 * double(dice_.below(20)));
      case 8:
        return (void)packing_->idle(now_s_ += 1);
      case 9:
        return lose(v);
      case 10:
        if (dice_.chance(50)) return hear(v);
        return v.part.tick();
      case 11:
        return v.part.hold(dice_.chance(30));
      case 12:
        return report_what_is_drawn(v);
      case 13:
      case 14:
        return carry(v, 1 + dice_.below(8));
      default:
        return sample();
    }
  }

  void change_the_session() {
    switch (dice_.below(5)) {
      case 0:
        start_packer();
        return;
      case 1:
        return follow(welcome(dice_, epoch_ = epoch_.next(), master_));
      case 2:
        return follow(welcome(dice_, epoch_, master_ = {1 + dice_.below(3)}));
      default: {
        wire::Welcome same = session_;
        same.epoch = epoch_ = epoch_.next();
        return follow(same);
      }
    }
  }
  template <class M>
  void from_any() {
    const auto m = any_.make<M>();
    if (m) packing_->take_state(socket_, message(*m, dice_.chance(50) ? "stranger" : viewers_[0]->peer), now_s_);
  }
  void any_tile() {
    wire::DepthTile m;
    any_.fill(m);
    deliver(m);
  }
  // Most leases are the master's, so that what is behind their seals is played with, too.
  void deliver(wire::DepthTile& m) {
    if (dice_.chance(90)) seal_lease(m.lease, m.sampler, dice_.chance(95) ? master_ : InstanceId{1 + dice_.below(3)});
    if (const auto arrived = over_the_wire(m)) packing_->take_sampled(socket_, message(*arrived, "s"), now_s_);
  }
  template <class M>
  static net::Message message(const Arrived<M>& m, const std::string& from) {
    return {from, std::string(M::kName), bytes_of(*m.body), m.body};
  }

  // A tile as its sampler sends it; now and then its lease is of something else.
  void sample() {
    if (dice_.chance(12)) ++frame_;
    const uint64_t frame = dice_.chance(80) ? frame_ : dice_.below(frame_ + 2);
    const size_t camera = frame % streams().cameras.size();
    const geometry::Camera& c = streams().cameras[camera];
    wire::DepthTile m{.sampler = {7}};
    wire::Lease& l = m.lease;
    l.frame = {frame}, l.epoch = epoch_, l.viewer = {101 + frame % kViewers}, l.request = {frame};
    l.camera = c, l.extra = camera == 3;
    const int columns = c.width / kTile;
    l.blocks_in_frame = uint64_t(columns) * uint64_t(c.height / (2 * kTile));
    l.block = dice_.below(l.blocks_in_frame);
    l.block_rect = {int(l.block) % columns * kTile, int(l.block) / columns * 2 * kTile, kTile, 2 * kTile};
    l.rect = l.block_rect;
    if (!l.extra && dice_.chance(50)) l.rect.height = kTile, l.rect.y += kTile * int(dice_.below(2));
    l.tile = 2 * l.block;
    l.lease = {frame * 1000 + l.tile};
    l.rays = dice_.chance(60) ? 0 : uint64_t(l.rect.width) * uint64_t(l.rect.height) / 2;
    if (dice_.chance(8)) l.epoch = {epoch_.value + dice_.below(3)};
    const auto& stream = streams().of(dice_.chance(95) ? camera : 0, l.rect);
    if (dice_.chance(6)) any_.fill(l);
    m.image = std::as_bytes(std::span(stream));
    deliver(m);
  }
  void plan() {
    wire::PlanRequest r;
    if (dice_.chance(30)) any_.fill(r);
    r.frame = {++frame_}, r.epoch = dice_.chance(90) ? epoch_ : EpochId{dice_.below(5)};
    r.viewer = {101 + dice_.below(kViewers)}, r.request = {r.frame.value};
    r.camera = dice_.pick(streams().cameras);
    r.extra = dice_.chance(40), r.still = dice_.chance(50), r.round = dice_.below(3);
    const auto asked = over_the_wire(r);
    if (!asked) return;
    const auto plan = packing_->plan_piece(asked->message, now_s_);
    if (plan && !plan->tiles.empty()) ++reached_["plans with tiles"];
    if (plan && !over_the_wire(*plan)) complaint_ = "a plan that nobody can read";
  }
  void end_a_frame() {
    wire::FrameEnd end;
    if (dice_.chance(20)) any_.fill(end);
    end.frame = {dice_.below(frame_ + 2)}, end.epoch = epoch_;
    end.viewer = {101 + end.frame.value % kViewers}, end.request = {end.frame.value};
    end.camera = streams().cameras[end.frame.value % streams().cameras.size()];
    end.tiles = dice_.below(20);
    if (const auto m = over_the_wire(end)) packing_->end_frame(m->message, now_s_);
  }
  void report_what_is_drawn(Viewer& v) {
    wire::AccessReport r{.viewer = v.id};
    for (uint64_t n = dice_.below(10); n-- > 0;) r.clusters.push_back(uint32_t(dice_.below(300)));
    if (dice_.chance(50)) r.frames.assign(r.clusters.size(), uint32_t(dice_.below(frame_ + 1)));
    if (const auto m = over_the_wire(r)) packing_->take_state(socket_, message(*m, v.peer), now_s_);
    tell_what_came(v);
  }
  void tell_what_came(Viewer& v) {
    const auto f = v.part.figures();
    if (const auto m = over_the_wire(wire::Receipt{v.id, f.packer, f.sequence, now_s_}))
      packing_->take_state(socket_, message(*m, v.peer), now_s_);
  }

  void lose(Viewer& v) {
    if (dice_.chance(20)) return connect(v);
    for (uint64_t n = dice_.below(4); n-- > 0 && !v.events.empty();) v.events.pop_front();
  }
  // Who knows the model's configuration has the packer's points after each event.
  void look_at_the_replicas() {
    for (auto& v : viewers_) {
      v->heard_late |= v->config != config();
      const auto now = v->part.figures(), before = std::exchange(v->figures, now);
      if (v->heard_late || complaint_) continue;
      if (now.digests_different != before.digests_different)
        complaint_ = fmt::format("viewer {} holds other points after event {}", v->id.value, before.sequence.value);
      if (now.decode_errors != before.decode_errors)
        complaint_ = fmt::format("viewer {} cannot apply what follows event {}", v->id.value, before.sequence.value);
    }
  }
  // The link breaks, or is left: on another one nothing comes that was sent over the old one.
  void connect(Viewer& v) {
    v.events.clear(), v.answers.clear(), v.requests.clear();
    v.peer = fmt::format("{}-{}", v.peer.substr(0, v.peer.rfind('-')), ++connections_);
  }
  // A welcome reaches the viewer, some time after the packer has got its own.
  void hear(Viewer& v) {
    if (v.config == config()) return;
    v.config = config();
    connect(v);
    v.part.start();
    v.heard_late = false;
  }
  // Events and answers come over two connections: either may be the faster one.
  void carry(Viewer& v, uint64_t most) {
    for (; most-- > 0;) {
      if (!v.requests.empty() && dice_.chance(40)) {
        const auto m = over_the_wire(v.requests.front());
        v.requests.pop_front();
        if (m) packing_->take_state(socket_, message(*m, v.peer), now_s_);
      }
      if (!v.answers.empty() && dice_.chance(60))
        take(v.answers, [&](const Sent& s) { v.part.take_answer(s.type, s.body); });
      if (!v.events.empty()) take(v.events, [&](const Sent& s) { v.part.take_event(s.type, s.body); });
    }
  }
  static void take(std::deque<Sent>& queue, auto&& by) {
    const Sent sent = std::move(queue.front());
    queue.pop_front();
    by(sent);
  }

  // Nothing is lost any more, and nobody does anything new.
  void in_the_end() {
    for (auto& v : viewers_) v->part.hold(false), hear(*v);
    for (int round = 0; round < 12; ++round) {
      packing_->tick(now_s_ += 1);
      for (auto& v : viewers_)
        while (!v->requests.empty() || !v->answers.empty() || !v->events.empty()) {
          carry_all(*v);
          tell_what_came(*v);
        }
      for (auto& v : viewers_) v->part.tick();
    }
    for (const auto& v : viewers_) reached_["gaps"] += v->part.figures().gaps;
    reached_["models with points"] += packing_->points() > 0;
    for (const auto& v : viewers_)
      if (v->part.digest() != packing_->digest()) {
        complaint_ =
            fmt::format("viewer {} holds {:x}, the packer {:x}; it has {} of packer {}", v->id.value, v->part.digest(),
                        packing_->digest(), v->part.figures().sequence.value, v->part.figures().packer.value);
        return;
      }
  }
  void carry_all(Viewer& v) {
    while (!v.requests.empty()) {
      const auto m = over_the_wire(v.requests.front());
      v.requests.pop_front();
      if (m) packing_->take_state(socket_, message(*m, v.peer), now_s_);
    }
    while (!v.answers.empty()) take(v.answers, [&](const Sent& s) { v.part.take_answer(s.type, s.body); });
    while (!v.events.empty()) take(v.events, [&](const Sent& s) { v.part.take_event(s.type, s.body); });
  }

  static net::Socket& socket() {
    static net::Context context;
    static net::Socket s(context, net::Kind::kDealer, "play");
    return s;
  }

  Dice dice_;
  Values values_;
  AnyMessage any_;
  net::Socket& socket_ = socket();
  double now_s_ = 1;
  EpochId epoch_{1};
  InstanceId master_{1};
  wire::Welcome session_;
  uint64_t frame_ = 1, max_log_bytes_ = 0, connections_ = kViewers;
  metrics::SpanRecorder spans_;
  std::vector<std::unique_ptr<Viewer>> viewers_;
  std::optional<packer::PointPacking> packing_;
  Complaint complaint_;
  Reached reached_;
};

}  // namespace

Complaint play_points(std::span<const uint8_t> bytes, Reached* reached) {
  log::initialise("play", "off");
  PointsPlay play(bytes);
  Complaint complaint = play.run();
  if (reached)
    for (const auto& [what, times] : play.reached()) (*reached)[what] += times;
  return complaint;
}

}  // namespace telesplat::test
