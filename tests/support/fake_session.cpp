#include "tests/support/fake_session.h"

#include <algorithm>

#include "common/codec/depth_codec.h"
#include "common/core/clock.h"
#include "common/net/dispatch.h"
#include "common/volume/session.h"
#include "tests/support/points_scenes.h"
#include "tests/support/volume/frames.h"
#include "tests/support/volume/slices.h"

namespace telesplat::test {
namespace {

wire::Bytes bytes_of(const std::vector<uint8_t>& v) { return {reinterpret_cast<const std::byte*>(v.data()), v.size()}; }

}  // namespace

FakeSession::FakeSession(net::Context& context, const Options& options, std::string name)
    : options_(options),
      grid_(testing::turned_grid()),
      master_endpoint_("inproc://master-" + name),
      state_endpoint_("inproc://state-" + name),
      patches_endpoint_("inproc://patches-" + name),
      master_(context, net::Kind::kRouter, "master", {.max_message_bytes = wire::kMaxBulkBytes}),
      state_(context, net::Kind::kRouter, "state"),
      patches_(context, net::Kind::kPub, "patches") {
  CHECK(master_.bind(master_endpoint_).ok() && state_.bind(state_endpoint_).ok() &&
        patches_.bind(patches_endpoint_).ok());
  thread_ = std::thread([this] { loop(); });
}

FakeSession::~FakeSession() {
  stop_ = true;
  thread_.join();
}

std::vector<double> FakeSession::column(const std::string& table, const std::string& name) const {
  const std::lock_guard lock(mutex_);
  const auto it = tables_.find(table);
  if (it == tables_.end()) return {};
  const auto& columns = it->second.columns;
  const auto c = size_t(std::find(columns.begin(), columns.end(), name) - columns.begin());
  std::vector<double> out;
  for (size_t i = c; c < columns.size() && i < it->second.values.size(); i += columns.size())
    out.push_back(it->second.values[i]);
  return out;
}

std::map<std::string, double> FakeSession::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

FakeSession::Counts FakeSession::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

void FakeSession::loop() {
  while (!stop_) {
    net::wait_readable({&master_, &state_}, 2);
    patches_.receive();
    receive_master();
    receive_state();
    answer_next();
  }
}

wire::Welcome FakeSession::welcome() const {
  wire::Welcome w;
  w.master = master_id_;
  w.master_s = monotonic_s();
  w.epoch = epoch_;
  w.octree_depth = 5;
  w.facts = {{"scene", "made up"}, {"kind", options_.volume ? "volume" : "mesh"}};
  w.endpoints = {{"state", state_endpoint_}, {"patches", patches_endpoint_}};
  w.box_room = options_.volume ? grid_.box_room() : scene_config().box_room;
  w.settings = options_.settings;
  if (strange_) w.box_room.hi = glm::vec3(3e6f);
  if (!options_.volume) return w;
  volume::Session session;
  session.grid = grid_;
  session.transfer.points = {{0, 1, 1, 1, 0}, {1, 1, 1, 1, 1}};
  w.parameters = volume::to_parameters(session);
  w.facts.merge(volume::to_facts(session));
  return w;
}

void FakeSession::receive_master() {
  while (const auto m = master_.receive()) {
    const std::lock_guard lock(mutex_);
    if (const auto hello = m->type == wire::Hello::kName ? master_.decode<wire::Hello>(*m) : std::nullopt) {
      if (hello->instance == taken_id_) {
        master_.send(wire::Shutdown{std::string(wire::kInstanceTaken) + ": eve has it"}, m->peer);
        continue;
      }
      wire::Welcome w = welcome();
      w.hello_sent_s = hello->sent_s;
      viewer_ = m->peer;
      viewer_id_ = hello->instance;
      master_.send(w, m->peer);
    } else if (m->type == wire::ViewRequest::kName) {
      const auto request = master_.decode<wire::ViewRequest>(*m);
      if (!request || request->viewer == taken_id_) continue;
      ++counts_.requests;
      const bool known = !seen_.insert(request->request.value).second;
      counts_.repeated += known;
      counts_.buffers = request->buffers;
      if (!known && options_.forgotten.contains(request->request.value)) continue;
      const auto same = [&](const wire::ViewRequest& r) { return r.request == request->request; };
      if (std::any_of(open_.begin(), open_.end(), same)) continue;
      open_.push_back(*request);
      counts_.most_open = std::max<uint64_t>(counts_.most_open, open_.size());
    } else if (m->type == wire::MetricRows::kName) {
      const auto rows = master_.decode<wire::MetricRows>(*m);
      if (!rows || rows->table == "spans") continue;
      auto& table = tables_[rows->table];
      table.columns = rows->columns;
      table.values.insert(table.values.end(), rows->values.begin(), rows->values.end());
    } else if (m->type == wire::StatusReport::kName) {
      if (const auto report = master_.decode<wire::StatusReport>(*m)) status_ = report->values;
    }
  }
}

void FakeSession::receive_state() {
  while (const auto m = state_.receive()) {
    const std::lock_guard lock(mutex_);
    if (m->peer == former_state_) continue;  // sent before the viewer knew of the change
    viewer_state_ = m->peer;
    if (m->type == wire::SliceAck::kName) {
      const auto ack = state_.decode<wire::SliceAck>(*m);
      if (!ack || ack->viewer == taken_id_) continue;
      counts_.in_order = ack->in_order;
      buffers_ = ack->buffers;
      if (ack->frame.value == 0) {
        ++counts_.introductions;
        continue;
      }
      ++counts_.acknowledged;
      counts_.damaged += ack->damaged;
      counts_.rising &= ack->frame.value >= last_acknowledged_;  // repeated where the buffers change
      last_acknowledged_ = ack->frame.value;
      unacknowledged_.erase(ack->frame.value);
    } else if (m->type == wire::StateRequest::kName) {
      const auto request = state_.decode<wire::StateRequest>(*m);
      if (!request) continue;
      const uint64_t after = request->packer == packer_ ? request->after.value : 0;
      counts_.began_anew += after == 0;
      state_.send(wire::StateBegin{packer_, {after}}, m->peer);
      for (size_t i = after; i < log_.size(); ++i) state_.send_frames(m->peer, log_[i].first, log_[i].second);
      state_.send(wire::StateMark{packer_, {log_.size()}, epoch_, true, 0}, m->peer);
    }
  }
}

// Does what is due in place of an answer; true if something was.
bool FakeSession::disturb() {
  if (options_.restart_after && answers_ == options_.restart_after) {
    master_id_ = {13};
    frame_ = last_acknowledged_ = 0;
    unacknowledged_.clear();
    open_.clear();
    options_.restart_after = 0;
    if (options_.taken) {
      taken_id_ = viewer_id_;
      former_state_ = std::exchange(viewer_state_, {});
      master_.send(wire::WhoAreYou{master_id_}, viewer_);
      return true;
    }
  } else if (options_.change_every && options_.changes > 0 &&
             answers_ % options_.change_every == options_.change_every - 1) {
    --options_.changes;
    ++answers_;
    change_kind();
  } else if (const auto news = options_.settings_after.find(answers_); news != options_.settings_after.end()) {
    options_.settings = news->second;
    options_.settings_after.erase(news);
  } else if (options_.strange_after && answers_ == options_.strange_after) {
    strange_ = true;
    begin_packer();
    options_.strange_after = 0;
  } else {
    return false;
  }
  master_.send(welcome(), viewer_);
  return true;
}

void FakeSession::begin_packer() {
  packer_ = packer_.next();
  sequence_ = 0;
  log_.clear();
}

void FakeSession::change_kind() {
  options_.volume = !options_.volume;
  epoch_ = epoch_.next();
  begin_packer();
  frame_ = last_acknowledged_ = 0;
  unacknowledged_.clear();
  open_.clear();
  former_state_ = std::exchange(viewer_state_, {});
}

void FakeSession::answer_next() {
  const std::lock_guard lock(mutex_);
  if (open_.empty() || viewer_state_.empty() || monotonic_s() < silent_until_s_) return;
  if (options_.volume && unacknowledged_.size() >= buffers_) return;
  if (options_.epoch_every && answers_ % options_.epoch_every == options_.epoch_every - 1) {
    epoch_ = epoch_.next();
    if (!options_.volume) {
      log_.emplace_back(wire::EpochBegin::kName, wire::encode(wire::EpochBegin{packer_, {++sequence_}, epoch_}));
      patches_.send_frames({}, log_.back().first, log_.back().second);
    }
  }
  if (disturb()) return;
  if (const auto silent = options_.silent_after_s.find(answers_); silent != options_.silent_after_s.end()) {
    silent_until_s_ = monotonic_s() + silent->second;
    options_.silent_after_s.erase(silent);
    return;
  }
  ++answers_;
  const wire::ViewRequest request = open_.front();
  open_.pop_front();
  if (options_.volume)
    send_slices(request);
  else
    publish_points(request);
}

void FakeSession::send_slices(const wire::ViewRequest& request) {
  wire::SliceFrame f;
  f.packer = packer_;
  f.epoch = epoch_;
  f.frame = {++frame_};
  f.viewer = request.viewer;
  f.request = request.request;
  f.camera = request.camera;
  f.voxels = 1000;
  const auto shear = volume::plan_frame(grid_, std::span(&request.camera, 1));
  if (!shear) return;
  f.shear = *shear;
  std::vector<uint8_t> bytes;
  for (int l = 0; l < int(shear->layers.size()); l += 5)
    volume::encode_slice(testing::blobs(*shear, l, {0, 0, shear->width, shear->height}), bytes);
  if (options_.damaged.contains(request.request.value)) {
    if (!bytes.empty()) bytes.pop_back();
    // A repeated request gets a good answer.
    options_.damaged.erase(request.request.value);
  }
  f.data = bytes_of(bytes);
  state_.send(f, viewer_state_);
  unacknowledged_.insert(frame_);
  counts_.most_unacknowledged = std::max<uint64_t>(counts_.most_unacknowledged, unacknowledged_.size());
}

void FakeSession::publish_points(const wire::ViewRequest& request) {
  ++frame_;
  const auto publish = [&](const geometry::Camera& camera, uint64_t step, int tile, int tiles) {
    const int height = camera.height / tiles;
    const geometry::Rect rect{0, tile * height, camera.width, height};
    const auto image = codec::encode(sample_scene(camera, rect));
    wire::Patch p;
    p.packer = packer_;
    p.sequence = {++sequence_};
    p.epoch = epoch_;
    p.frame = {frame_};
    p.viewer = request.viewer;
    p.request = request.request;
    p.tile = uint64_t(tile);
    p.tiles_in_frame = uint64_t(tiles);
    p.step = step;
    p.frame_complete = tile + 1 == tiles;
    p.counts = {100, 100};
    p.camera = camera;
    p.rect = rect;
    p.image = bytes_of(image);
    log_.emplace_back(wire::Patch::kName, wire::encode(p));
    patches_.send_frames({}, log_.back().first, log_.back().second);
  };
  for (int i = 0; i < options_.coarse_patches; ++i)
    publish(geometry::subsample(request.camera, 4), 4, i, options_.coarse_patches);
  for (int i = 0; i < 2; ++i) publish(request.camera, 1, i, 2);
  if (answers_ == options_.other_digest_after)
    patches_.send(wire::StateMark{packer_, {sequence_}, epoch_, false, 0, 4711});
}

}  // namespace telesplat::test
