#include <fmt/format.h>

#include <deque>
#include <nlohmann/json.hpp>
#include <set>

#include "common/core/log.h"
#include "common/julia/parameters.h"
#include "common/volume/session.h"
#include "services/master/master_core.h"
#include "tests/support/play/any_message.h"
#include "tests/support/play/play.h"

namespace telesplat::test {
namespace {

using master::MasterCore;

constexpr size_t kPeers = 8;
constexpr size_t kMostSteps = 400;
// Limits of the messages that one message may cause: welcomes for all, leases of all frames in flight.
constexpr size_t kMostMessages = 2000, kMostBytes = 64u << 20;

const std::array<std::string, kPeers> kPeerIds{"a", "b", "c", "d", "e", "f", "g", "h"};
const std::array<std::string, 6> kRoles{"data", "sampler", "packer", "viewer", "ctl", "tourist"};
const std::array<std::string, 3> kKinds{"mesh", "julia", "volume"};
const std::array<std::string, 21> kCommands{
    "status", "stop",    "epoch",   "set",   "animate",  "tf", "colour",     "clip", "play", "pick", "where",
    "go",     "overlay", "measure", "probe", "coupling", "",   "frobnicate", "set",  "play", "epoch"};

volume::Session volume_session(int part, int parts) {
  volume::Session s;
  s.grid.size = {8, 8, 24};
  s.transfer.points = {{}};
  s.part = part, s.parts = parts;
  return s;
}

const Values& values() {
  static const Values v = [] {
    Values out;
    out.cameras = {geometry::make_camera({.position_room = {0.1, 0.1, 3}}, 60, 64, 48),
                   geometry::make_camera({.position_room = {0.1, 0.1, 3}}, 60, 640, 400),
                   geometry::make_camera({.position_room = {0, 0, 0.1}}, 100, 130, 70),
                   geometry::make_camera({.position_room = {1, 2, -3}, .orientation = {0, 0, 1, 0}}, 20, 33, 900)};
    out.texts = {"mesh",
                 "volume",
                 "julia",
                 "hill",
                 "2",
                 "100",
                 "off",
                 "plane x>=30%",
                 "box 10%,10%,10%,90%,90%,90%",
                 "c.y=-0.5:0.5:4s",
                 "c.y=@0s:0@1s:1",
                 "0.25",
                 "loose",
                 "sync",
                 "async",
                 "play",
                 "pause",
                 "step",
                 "-1",
                 "bone",
                 "temperature:0:1",
                 "viridis",
                 "0:#000000:0, 255:#ffffff:0.9",
                 "v3",
                 "viewer-0",
                 "tcp://x:1"};
    out.keys = {"kind",         "scene",        "leases",      "arrays",       "colouring",     "colour_map",
                "array_answer", "clip",         "transfer",    "placement",    "sampler",       "record",
                "timeline",     "animate",      "how",         "steps",        "coupling",      "buffers",
                "viewer",       "array",        "map",         "c.y",          "c.x",           "iterations",
                "volume.step",  "volume.steps", "volume.part", "volume.parts", "volume.size.z", "rss_mb",
                "tiles",        "chunks",       "voxels",      "state",        "patches",       "t_s",
                "frame",        "request_s",    "displayed_s", "name",         "begin_s",       "end_s",
                "triangles",    "steps_per_s",  "palette"};
    out.texts_of = {{"role", {kRoles.begin(), kRoles.end()}},
                    {"name", {"n0", "n1", "n2", "a,b", "\x1b[2J"}},
                    {"wall", {"", "w", "x"}},
                    {"table", {"frames", "updates", "stages", "spans", "nonsense"}},
                    {"command", {kCommands.begin(), kCommands.end()}}};
    return out;
  }();
  return v;
}

class MasterPlay {
 public:
  explicit MasterPlay(std::span<const uint8_t> bytes) : dice_(bytes), any_(dice_, values()) {}

  Complaint run() {
    // Most plays begin in a running session.
    if (dice_.chance(85)) {
      const uint64_t kind = dice_.below(kKinds.size());
      for (const std::string& peer : kPeerIds) on(peer, hello(peer, role_of(peer), kind));
      if (kind == 2)
        on("a",
           wire::SliceWeights{
               .data = {1}, .epoch = {1}, .begin = 0, .voxels = std::vector<uint32_t>(24, 9), .bytes_per_voxel = 3});
    }
    for (size_t step = 0; step < kMostSteps && !dice_.over(); ++step) {
      now_s_ += 0.01 * double(dice_.below(16));
      act();
      if (!look_at_what_goes_out()) return complaint_;
    }
    // After any messages the master's figures can be read.
    record_->summary(core_.processes(), core_.counters());
    reached_["frames completed"] += core_.figures().frames_completed;
    core_.live_snapshot();
    return after_them();
  }

  const Reached& reached() const { return reached_; }

 private:
  static master::MasterOptions options(Dice& dice) {
    master::MasterOptions o;
    o.schedule.tile_size = 64;
    o.schedule.frames_in_flight = 1 + int(dice.below(2));
    o.schedule.lease_timeout_s = 2;
    o.settings.steering = dice.chance(50);
    o.progressive = dice.chance(30) ? master::Progressive::kOn : master::Progressive::kAuto;
    return o;
  }

  void act() {
    const std::string& peer = dice_.pick(kPeerIds);
    switch (dice_.below(20)) {
      case 0:
        return from_any<wire::Hello>(peer);
      case 1:
        return from_any<wire::ViewRequest>(peer);
      case 2:
        return from_any<wire::SliceWeights>(peer);
      case 3:
        return from_any<wire::SlabReady>(peer);
      case 4:
        return from_any<wire::TileDone>(peer);
      case 5:
        return from_any<wire::Plan>(peer);
      case 6:
        return from_any<wire::SwapReady>(peer);
      case 7:
        return something_else(peer);
      case 8:
      case 9:
        return on(peer, hello(peer, dice_.chance(80) ? role_of(peer) : dice_.pick(kRoles), dice_.below(9)));
      case 10:
      case 11:
        return ask_for_a_view(dice_.chance(80) ? "e" : peer);
      case 12:
      case 13:
        return ask_for_a_lease(dice_.chance(80) ? "c" : peer);
      case 14:
      case 15:
        return finish_a_lease(peer);
      case 16:
        return plan_a_view(peer);
      case 17:
        return hold_a_slab(peer);
      case 18:
        return weigh(peer);
      default:
        return time_goes_by();
    }
  }

  void something_else(const std::string& peer) {
    switch (dice_.below(11)) {
      case 0:
        return from_any<wire::StatusReport>(peer);
      case 1:
        return from_any<wire::MetricRows>(peer);
      case 2:
        return from_any<wire::LeaseExtend>(peer);
      case 3:
        return from_any<wire::LinkReport>(peer);
      case 4:
        return from_any<wire::OrderAnswer>(peer);
      case 5:
        return from_any<wire::Goodbye>(peer);
      case 6:
        return core_.undeliverable(peer);
      case 7:
        return from_any<wire::TileRefused>(packer_.empty() ? peer : packer_);
      case 8:
        return refuse_a_tile();
      default:
        return from_any<wire::Control>(peer);
    }
  }

  template <class M>
  void from_any(const std::string& peer) {
    if (const auto m = any_.make<M>()) on(peer, m->message);
  }
  template <class M>
  void on(const std::string& peer, const M& m) {
    if constexpr (std::is_same_v<M, wire::Hello>)
      if (m.role == "sampler") said_sampler_.insert(peer);
    // A peer that sends too much is not heard, as in the service.
    if (core_.admit(peer, now_s_))
      (void)core_.on(peer, m, now_s_);
    else
      ++reached_["not admitted"];
  }

  InstanceId instance(const std::string& peer) {
    return {dice_.chance(95) ? 1 + uint64_t(peer[0] - 'a') : dice_.below(12)};
  }

  // The message of an honest process. salt: chooses among the role's variants.
  static const std::string& role_of(const std::string& peer) {
    // data, packer, two samplers, two viewers, ctl, another data server
    constexpr std::array<size_t, kPeers> kRoleOf{0, 2, 1, 1, 3, 3, 4, 0};
    return kRoles[kRoleOf[size_t(peer[0] - 'a')]];
  }
  wire::Hello hello(const std::string& peer, const std::string& role, uint64_t salt) {
    wire::Hello h;
    h.role = role, h.name = fmt::format("{}-{}", role, peer), h.instance = instance(peer);
    if (role == "packer") h.endpoints = {{"tiles", "tcp://t"}, {"patches", "tcp://p"}, {"state", "tcp://s"}};
    if (role != "data") return h;
    const std::string& kind = kKinds[salt % kKinds.size()];
    h.facts = {{"kind", kind}, {"scene", kind}};
    h.box_room = {{-1, -1, -1}, {1, 1, 1}};
    h.endpoints = {{"chunks", "tcp://c" + peer}};
    if (kind == "julia") h.parameters = julia::to_map(julia::Parameters{});
    if (kind != "volume") return h;
    const auto s = volume_session(int(salt / 3 % 2), 1 + int(salt / 3 % 2));
    h.endpoints = {{"voxels", "tcp://v" + peer}};
    h.parameters = volume::to_parameters(s);
    h.facts.merge(volume::to_facts(s));
    return h;
  }

  void ask_for_a_lease(const std::string& peer) { on(peer, wire::LeaseRequest{instance(peer)}); }
  void ask_for_a_view(const std::string& peer) {
    wire::ViewRequest r;
    r.viewer = instance(peer);
    r.request = {++requests_};
    r.buffers = dice_.below(4);
    r.camera = dice_.pick(values().cameras);
    on(peer, r);
  }
  void finish_a_lease(const std::string& peer) {
    if (leases_.empty()) return;
    const wire::Lease& l = dice_.pick(leases_);
    wire::TileDone done{.frame = l.frame,
                        .tile = l.tile,
                        .lease = l.lease,
                        .sampler = instance(peer),
                        .request = l.request,
                        .step = l.step,
                        .extra = l.extra,
                        .rays = l.rays,
                        .rect = l.rect,
                        .samples = dice_.below(500)};
    if (dice_.chance(10)) done.tile = dice_.below(9);
    if (dice_.chance(10)) done.lease = {dice_.below(40)};
    on(packer_.empty() || dice_.chance(10) ? peer : packer_, done);
  }
  void refuse_a_tile() {
    if (leases_.empty()) return;
    const wire::Lease& l = dice_.pick(leases_);
    on(packer_.empty() ? "b" : packer_, wire::TileRefused{l.frame, l.tile, l.lease, instance("c"), "why"});
  }
  void plan_a_view(const std::string& peer) {
    if (plans_.empty()) return;
    const wire::PlanRequest& asked = dice_.pick(plans_);
    wire::Plan plan{.frame = asked.frame, .epoch = asked.epoch, .camera = asked.camera};
    plan.full = dice_.chance(30);
    if (!plan.full)
      for (uint64_t n = dice_.below(4), i = 0; i < n; ++i)
        for (const uint32_t v : {uint32_t(16 * i), 0u, 16u, 16u, uint32_t(1 + dice_.below(256)), 0u})
          plan.tiles.push_back(v);
    if (const auto arrived = over_the_wire(plan)) on(packer_.empty() ? peer : packer_, arrived->message);
  }
  void hold_a_slab(const std::string& peer) {
    wire::SlabReady ready{.sampler = instance(peer), .partition = dice_.below(6), .epoch = {1 + dice_.below(4)}};
    if (!slabs_.empty()) {
      const auto& [to, slab] = dice_.pick(slabs_);
      ready.partition = slab.partition;
      return on(to, ready);
    }
    on(peer, ready);
  }
  void weigh(const std::string& peer) {
    wire::SliceWeights w{.data = instance(peer), .epoch = {1 + dice_.below(3)}, .begin = 12 * dice_.below(2)};
    w.voxels.assign(12 * (1 + dice_.below(2)), uint32_t(dice_.below(50)));
    w.bytes_per_voxel = 3;
    on(peer, w);
  }
  void time_goes_by() {
    constexpr std::array<double, 6> kSteps{0.02, 0.05, 0.3, 1, 4, 12};
    const double step_s = dice_.pick(kSteps);
    now_s_ += step_s;
    if (dice_.chance(10)) core_.stood_still(step_s, now_s_);
    core_.tick(now_s_);
  }

  // Keeps outgoing messages that peers may answer. False: one of them is wrong.
  bool look_at_what_goes_out() {
    size_t bytes = 0;
    auto outgoing = core_.take_outgoing();
    for (const auto& out : outgoing) {
      bytes += out.body.size();
      ++reached_[out.type];
      if (!look_at<wire::Welcome, wire::WhoAreYou, wire::Lease, wire::SliceLease, wire::SlabAssignment,
                   wire::PlanRequest, wire::FrameEnd, wire::ControlReply, wire::Order, wire::Shutdown, wire::Swap>(out))
        return false;
    }
    if (outgoing.size() <= kMostMessages && bytes <= kMostBytes) return true;
    complaint_ = fmt::format("{} messages of {} bytes for one that came", outgoing.size(), bytes);
    return false;
  }
  template <class... M>
  bool look_at(const master::Outgoing& out) {
    const auto one = [&]<class T>(std::type_identity<T>) {
      if (out.type != T::kName) return;
      const auto m = wire::decode<T>(bytes_of(out.body));
      if (!m)
        complaint_ = "the master sends what nobody can read: " + m.error().text;
      else
        note(out.peer, *m);
    };
    (one(std::type_identity<M>{}), ...);
    return !complaint_;
  }
  template <class M>
  void note(const std::string& peer, const M& m) {
    if constexpr (std::is_same_v<M, wire::Lease>) {
      if (!given_.insert(m.lease.value).second) complaint_ = fmt::format("lease {} is given twice", m.lease.value);
      if (!said_sampler_.contains(peer))
        complaint_ = fmt::format("{}, which is no sampler, gets lease {}", peer, m.lease.value);
      keep(leases_, m);
    } else if constexpr (std::is_same_v<M, wire::SliceLease>) {
      if (!given_.insert(m.lease.value).second) complaint_ = fmt::format("lease {} is given twice", m.lease.value);
      if (!said_sampler_.contains(peer)) complaint_ = fmt::format("{}, which is no sampler, gets a slab's lease", peer);
      slice_leases_ += 1;
    } else if constexpr (std::is_same_v<M, wire::PlanRequest>) {
      packer_ = peer;
      keep(plans_, m);
    } else if constexpr (std::is_same_v<M, wire::SlabAssignment>) {
      keep(slabs_, std::pair(peer, m));
    } else if constexpr (std::is_same_v<M, wire::ControlReply>) {
      if (m.ok && m.text.starts_with('{') && !nlohmann::json::accept(m.text))
        complaint_ = "status is no JSON: " + m.text;
    }
  }
  template <class T>
  static void keep(std::deque<T>& list, T m) {
    list.push_back(std::move(m));
    if (list.size() > 16) list.pop_front();
  }

  // All peers fall silent and are forgotten. Then honest processes join, and the viewer gets its view.
  Complaint after_them() {
    if (core_.stop_requested()) return std::nullopt;
    for (int i = 0; i < 200; ++i) core_.tick(now_s_ += 0.1);
    core_.take_outgoing();
    given_.clear(), leases_.clear(), plans_.clear(), packer_ = "packer";
    uint64_t number = 1000;
    for (const char* role : {"data", "packer", "sampler", "viewer"}) {
      wire::Hello h = hello(role, role, 0);
      h.name = std::string("honest-") + role, h.instance = {++number};
      h.facts["scene"] = "another";
      on(role, h);
    }
    for (int round = 0; round < 300; ++round) {
      core_.tick(now_s_ += 0.05);
      // An earlier command may still clip the scene, or play it.
      on("sampler", wire::LeaseRequest{{1003}});
      if (round % 10 == 0) {
        for (const char* role : {"data", "packer", "sampler", "viewer"}) on(role, wire::StatusReport{});
        wire::ViewRequest r{.viewer = {1004}, .request = {++number}};
        r.camera = values().cameras[0];
        on("viewer", r);
      }
      const uint64_t leases = given_.size();
      if (!look_at_what_goes_out()) return complaint_;
      if (given_.size() > leases) return std::nullopt;
    }
    return "after they had gone, an honest session got no lease within 15 s";
  }

  Dice dice_;
  AnyMessage any_;
  std::unique_ptr<metrics::RunRecord> record_ = std::move(metrics::RunRecord::open("")).value();
  MasterCore core_{options(dice_), {42}, *record_};
  double now_s_ = 1;
  uint64_t requests_ = 0, slice_leases_ = 0;
  std::deque<wire::Lease> leases_;
  std::deque<wire::PlanRequest> plans_;
  std::deque<std::pair<std::string, wire::SlabAssignment>> slabs_;
  std::set<uint64_t> given_;
  std::set<std::string> said_sampler_;
  std::string packer_;
  Complaint complaint_;
  Reached reached_;
};

}  // namespace

Complaint play_master(std::span<const uint8_t> bytes, Reached* reached) {
  log::initialise("play", "off");
  MasterPlay play(bytes);
  Complaint complaint = play.run();
  if (reached)
    for (const auto& [what, times] : play.reached()) (*reached)[what] += times;
  return complaint;
}

}  // namespace telesplat::test
