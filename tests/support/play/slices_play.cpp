#include <fmt/format.h>

#include <deque>
#include <glm/gtc/matrix_transform.hpp>

#include "common/core/log.h"
#include "common/volume/session.h"
#include "services/packer/slices/slice_packing.h"
#include "tests/support/keys/lease_key.h"
#include "tests/support/play/any_message.h"
#include "tests/support/play/play.h"
#include "tests/support/volume/slices.h"

namespace telesplat::test {
namespace {

constexpr size_t kMostSlices = 300;
constexpr uint64_t kSlices = 24;

volume::Session scene() {
  volume::Session s;
  s.grid = {{24, 20, int(kSlices)}, glm::scale(glm::translate(glm::dmat4(1), {-0.24, -0.2, -0.24}), glm::dvec3(0.02))};
  s.transfer.points = {{}};
  return s;
}

wire::Welcome welcome(EpochId epoch, InstanceId master) {
  wire::Welcome w;
  w.master = master, w.epoch = epoch;
  w.lease_key = lease_key();
  w.facts = volume::to_facts(scene());
  w.facts["kind"] = "volume";
  w.parameters = volume::to_parameters(scene());
  return w;
}

struct Scenery {
  std::vector<geometry::Camera> cameras;
  std::vector<volume::ShearFrame> shears;  // of each camera
  Scenery() {
    for (const double x : {0.0, 0.3, -0.5}) {
      cameras.push_back(geometry::make_camera({{x, 0.1, 0.9}, {1, 0, 0, 0}}, 70, 48, 32));
      shears.push_back(volume::plan_frame(scene().grid, std::span(&cameras.back(), 1)).value());
    }
  }
};
const Scenery& scenery() {
  static const Scenery s;
  return s;
}

// What a slab's sampler sends: a bit of every layer.
std::string images_of(const wire::SliceLease& l) {
  std::vector<uint8_t> bytes;
  for (int layer = 0; layer < int(l.shear.layers.size()); ++layer) {
    volume::SliceImage image{
        layer, int(l.begin), int(l.end), {0, 0, std::min(l.shear.width, 9), std::min(l.shear.height, 9)}, {}};
    image.pixels.assign(size_t(image.rect.width) * size_t(image.rect.height), 0xff404040u + uint32_t(l.slab));
    volume::encode_slice(image, bytes);
  }
  return {bytes.begin(), bytes.end()};
}

class SlicesPlay {
 public:
  explicit SlicesPlay(std::span<const uint8_t> bytes) : dice_(bytes), any_(dice_, values_) {
    values_.cameras = scenery().cameras;
    values_.shears = scenery().shears;
    values_.ids = 4;
    values_.bulk = {std::as_bytes(std::span(junk_)), std::as_bytes(std::span(junk_)).first(0)};
  }

  Complaint run() {
    for (size_t step = 0; step < kMostSlices && !dice_.over() && !complaint_; ++step) {
      now_s_ += 0.01 * double(dice_.below(20));
      act();
    }
    net::MasterLink::Values values;
    packing_.add_status(values);
    for (const char* key : {"volume_frames_complete", "slabs_refused", "slabs_duplicate", "volume_frames_dropped"})
      reached_[key] += uint64_t(values[key]);
    if (!complaint_) in_the_end();
    return complaint_;
  }

  const Reached& reached() const { return reached_; }

 private:
  void act() {
    switch (dice_.below(12)) {
      case 0:
        return any_images();
      case 1:
        return acknowledge(any_.make<wire::SliceAck>(), peer());
      case 2:
        return follow(welcome(epoch_ = {1 + dice_.below(3)}, master_ = {1 + dice_.below(2)}));
      case 3: {
        wire::Welcome w;
        any_.fill(w);
        if (dice_.chance(50)) w.facts["kind"] = "volume";
        return follow(w);
      }
      case 4:
        return time_goes_by(double(dice_.below(15)));
      case 5:
        return acknowledge(
            over_the_wire(wire::SliceAck{{1 + dice_.below(4)}, {}, 1 + dice_.below(3), dice_.chance(50)}), peer());
      case 6:
      case 7:
        return acknowledge_what_came();
      default:
        return deliver_a_slab();
    }
  }

  // Whoever is forgotten, or hears of another master, has nothing under way any more.
  void follow(const wire::Welcome& session) {
    for (auto& [id, v] : viewers_) v.under_way.clear();
    packing_.follow(session, now_s_);
  }
  void time_goes_by(double s) {
    for (auto& [id, v] : viewers_) v.under_way.clear();
    packing_.tick(now_s_ += s);
  }

  std::string peer() { return fmt::format("peer-{}", dice_.below(4)); }

  wire::SliceLease lease(uint64_t frame, uint64_t slab, uint64_t slabs) {
    const size_t view = dice_.below(scenery().cameras.size());
    wire::SliceLease l{
        .lease = {frame * 10 + slab}, .frame = {frame}, .epoch = epoch_, .partition = 1, .slab = slab, .slabs = slabs};
    l.begin = kSlices * slab / slabs, l.end = kSlices * (slab + 1) / slabs;
    // Slabs of one frame are of one view; who mixes them is refused.
    const size_t of_frame = dice_.chance(92) ? frame % scenery().cameras.size() : view;
    l.shear = scenery().shears[of_frame];
    for (uint64_t v = 0, n = 1 + frame % 3; v < n; ++v)
      l.views.push_back({{1 + (frame + v) % 4}, {frame}, scenery().cameras[of_frame], frame % 2});
    return l;
  }
  void deliver_a_slab() {
    if (dice_.chance(30)) ++frame_;
    const uint64_t slabs = 1 + frame_ % 3;
    wire::SliceLease l = lease(dice_.chance(85) ? frame_ : dice_.below(frame_ + 3), dice_.below(slabs), slabs);
    const std::string data = images_of(l);
    if (dice_.chance(10)) l.epoch = {1 + dice_.below(4)};
    if (dice_.chance(5)) any_.fill(l);
    wire::SliceImages m{.sampler = {9}, .lease = l, .voxels = dice_.below(100), .data = std::as_bytes(std::span(data))};
    deliver(m);
  }
  void any_images() {
    wire::SliceImages m;
    any_.fill(m);
    deliver(m);
  }
  // Most leases are the master's, so that what is behind their seals is played with, too.
  void deliver(wire::SliceImages& m) {
    if (dice_.chance(90)) seal_lease(m.lease, m.sampler, dice_.chance(95) ? master_ : InstanceId{1 + dice_.below(2)});
    images(over_the_wire(m));
  }
  void images(std::optional<Arrived<wire::SliceImages>> m) {
    if (m) packing_.take_sampled(socket_, message(*m, "sampler"), now_s_);
  }
  void acknowledge(std::optional<Arrived<wire::SliceAck>> m, const std::string& from) {
    if (!m) return;
    // Whoever speaks for a viewer from now on gets its frames.
    Viewer& v = viewers_[m->message.viewer];
    if (m->message.frame.value == 0 || v.peer.empty()) v.under_way.clear();
    v.peer = from, v.buffers = m->message.buffers;
    std::erase(v.under_way, m->message.frame);
    if (m->message.buffers >= 1) packing_.take_state(socket_, message(*m, from), now_s_);
  }
  void acknowledge_what_came() {
    if (came_.empty()) return;
    const auto [viewer, frame, from] = came_.front();
    came_.pop_front();
    if (!viewers_.contains(viewer)) return;
    acknowledge(
        over_the_wire(wire::SliceAck{viewer, frame, std::max<uint64_t>(viewers_[viewer].buffers, 1), dice_.chance(50)}),
        from);
  }

  template <class M>
  static net::Message message(const Arrived<M>& m, const std::string& from) {
    return {from, std::string(M::kName), bytes_of(*m.body), m.body};
  }

  bool deliver(std::string_view to, std::string_view type, const std::string& body) {
    const auto frame = wire::decode<wire::SliceFrame>(bytes_of(body));
    if (type != wire::SliceFrame::kName || !frame) return complain("a viewer gets what it cannot read");
    const auto& s = frame->shear;
    const std::span data(reinterpret_cast<const uint8_t*>(frame->data.data()), frame->data.size());
    if (!volume::parse_slices(data, s.width, s.height, int(s.layers.size())))
      return complain("a viewer gets images that are none");
    if (dice_.chance(3)) {
      std::erase_if(viewers_, [&](const auto& v) { return v.second.peer == to; });
      return false;  // its queue is full
    }
    ++reached_["frames sent"];
    Viewer& v = viewers_[frame->viewer];
    v.under_way.push_back(frame->frame);
    came_.push_back({frame->viewer, frame->frame, std::string(to)});
    if (came_.size() > 32) came_.pop_front();
    if (v.under_way.size() > wire::kMaxBuffers)
      return complain(fmt::format("{} frames are under way to a viewer", v.under_way.size()));
    return true;
  }
  bool complain(std::string what) {
    complaint_ = std::move(what);
    return true;
  }

  // Another master, an honest frame, a viewer that has never been there.
  void in_the_end() {
    time_goes_by(100);
    epoch_ = {77}, master_ = {99};
    follow(welcome(epoch_, master_));
    const InstanceId viewer{1234};
    viewers_.erase(viewer);
    acknowledge(over_the_wire(wire::SliceAck{viewer, {}, 2, false}), "honest");
    wire::SliceLease l = lease(1, 0, 1);
    l.shear = scenery().shears[0];
    l.begin = 0, l.end = kSlices, l.slab = 0, l.slabs = 1;
    l.views = {{viewer, {1}, scenery().cameras[0], 0}};
    const std::string data = images_of(l);
    came_.clear();
    seal_lease(l, {9}, master_);
    images(over_the_wire(
        wire::SliceImages{.sampler = {9}, .lease = l, .voxels = 1, .data = std::as_bytes(std::span(data))}));
    time_goes_by(5);
    const bool came = std::any_of(came_.begin(), came_.end(), [&](const auto& c) { return std::get<0>(c) == viewer; });
    if (!came && !complaint_ && viewers_.contains(viewer)) complaint_ = "in the end an honest viewer got no frame";
    net::MasterLink::Values values;
    packing_.add_status(values);
    if (values["volume_viewers"] > double(packer::kMaxSliceViewers))
      complaint_ = "more viewers are remembered than ever can be";
  }

  struct Viewer {
    std::string peer;
    uint64_t buffers = 0;
    std::vector<FrameId> under_way;
  };

  static net::Socket& socket() {
    static net::Context context;
    static net::Socket s(context, net::Kind::kDealer, "play");
    return s;
  }

  Dice dice_;
  Values values_;
  AnyMessage any_;
  net::Socket& socket_ = socket();
  const std::array<uint8_t, 40> junk_{1, 2, 3, 4, 5, 255, 254, 9};
  double now_s_ = 1;
  EpochId epoch_{1};
  InstanceId master_{1};
  uint64_t frame_ = 1;
  std::map<InstanceId, Viewer> viewers_;
  std::deque<std::tuple<InstanceId, FrameId, std::string>> came_;
  Complaint complaint_;
  Reached reached_;
  metrics::SpanRecorder spans_;
  packer::SlicePacking packing_{{.tell = [](const wire::TileDone&) {},
                                 .refuse = [this](const wire::TileRefused&) { ++reached_["slabs told as refused"]; },
                                 .to_viewers = [](std::string_view, std::string) {},
                                 .to_viewer = [this](std::string_view peer, std::string_view type,
                                                     std::string body) { return deliver(peer, type, body); },
                                 .tell_link = {},
                                 .master_now = [this] { return now_s_; },
                                 .to_master_s = [](double s) { return s; }},
                                spans_};
};

}  // namespace

Complaint play_slices(std::span<const uint8_t> bytes, Reached* reached) {
  log::initialise("play", "off");
  SlicesPlay play(bytes);
  Complaint complaint = play.run();
  if (reached)
    for (const auto& [what, times] : play.reached()) (*reached)[what] += times;
  return complaint;
}

}  // namespace telesplat::test
