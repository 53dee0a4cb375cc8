#include "services/data/volume/answers.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/core/log.h"
#include "common/scene/clip_order.h"
#include "common/scene/session.h"
#include "common/wire/serial.h"

namespace telesplat::data {
namespace {

wire::Bytes as_bytes(std::span<const uint8_t> bytes) { return std::as_bytes(bytes); }

VolumeAnswers::Reply unknown(const std::string& peer, const wire::VoxelRequest& request) {
  wire::VoxelData data;
  data.epoch = request.epoch, data.step = request.step, data.begin = request.begin, data.end = request.end;
  data.have = request.have;
  return {peer, wire::VoxelData::kName, wire::encode(data)};
}

}  // namespace

VolumeAnswers::VolumeAnswers(VolumeStore& store)
    : store_(store),
      session_(store.session()),
      begin_(int(int64_t{session_.grid.size[2]} * session_.part / session_.parts)),
      end_(int(int64_t{session_.grid.size[2]} * (session_.part + 1) / session_.parts)) {}

const VolumeAnswers::Epoch* VolumeAnswers::epoch(EpochId id) const {
  const auto found = std::find_if(epochs_.begin(), epochs_.end(), [&](const Epoch& e) { return e.id == id; });
  return found == epochs_.end() ? nullptr : &*found;
}

Status VolumeAnswers::follow(const wire::Welcome& welcome) {
  const std::string kind = scene::SessionView(welcome).fact("kind");
  if (kind.empty()) return ok_status();  // the master does not know the scene yet
  if (kind != scene::name_of(scene::Kind::kVolume))
    return Error{fmt::format("the session shows a {}, not a volume", kind)};
  const auto session = volume::read_session(welcome.parameters, welcome.facts);
  if (!session) return session.error();
  if (!(session->grid == session_.grid) || !(session->levels == session_.levels) || session->steps != session_.steps)
    return Error{"the session shows another volume"};

  const auto clip = geometry::clip_from_text(scene::SessionView(welcome).fact(scene::kClipFact));
  if (!clip) return clip.error();

  Epoch next{welcome.epoch, session->step, {}, volume::to_text(session->transfer), session->transfer, *clip};
  const std::lock_guard lock(mutex_);
  if (welcome.master != master_) epochs_.clear();  // another master counts its own epochs
  master_ = welcome.master;
  if (const Epoch* known = epoch(next.id); known && known->step == next.step && known->transfer == next.transfer)
    return ok_status();
  // Steps of a series come often, and mostly with the same transfer function.
  if (!epochs_.empty() && epochs_.back().transfer == next.transfer)
    next.shown = epochs_.back().shown;
  else
    next.shown = shown_levels(session->transfer, session_.levels);
  std::erase_if(epochs_, [&](const Epoch& e) { return e.id == next.id; });
  epochs_.push_back(std::move(next));
  if (epochs_.size() > kEpochsKept) epochs_.pop_front();
  return ok_status();
}

Result<std::optional<VolumeAnswers::Reply>> VolumeAnswers::ask(const std::string& peer,
                                                               const wire::VoxelRequest& request) {
  const uint64_t slices = uint64_t(session_.grid.size[2]);
  if (request.begin >= request.end || request.end > slices)
    return Error{fmt::format("asks for the slices {} to {} of {}", request.begin, request.end, slices)};
  if (request.step >= uint64_t(session_.steps))
    return Error{fmt::format("asks for step {} of {}", request.step, session_.steps)};
  volume::LevelSet have;
  if (!request.have.empty()) {
    const auto read =
        volume::LevelSet::from_bytes({reinterpret_cast<const uint8_t*>(request.have.data()), request.have.size()});
    if (!read) return read.error();
    have = *read;
  }
  const int begin = std::max(int(request.begin), begin_), end = std::min(int(request.end), end_);
  const std::lock_guard lock(mutex_);
  const Epoch* const known = epoch(request.epoch);
  if (!known || begin >= end) return std::optional(unknown(peer, request));
  const auto mine = std::count_if(waiting_.begin(), waiting_.end(), [&](const Waiting& w) { return w.peer == peer; });
  if (size_t(mine) >= kRequestsAPeer)
    waiting_.erase(std::find_if(waiting_.begin(), waiting_.end(), [&](const Waiting& w) { return w.peer == peer; }));
  if (waiting_.size() >= kRequestsWaiting) return std::optional(unknown(peer, request));
  waiting_.push_back({peer, request.epoch, int(request.step), begin, end, request.round, have, known->shown});
  return std::optional<Reply>();
}

Status VolumeAnswers::probe(const wire::Order& order) {
  const auto ray = scene::probe_from(order.arguments);
  if (!ray) return ray.error();
  const std::lock_guard lock(mutex_);
  const Epoch* const shown = epoch(ray->epoch);
  if (!shown) return Error{"probe: that epoch is over"};
  if (probes_.size() >= kProbesWaiting) return Error{fmt::format("probe: {} wait already", probes_.size())};
  probes_.push_back({order.number, *ray, shown->step, shown->function, shown->clip});
  return ok_status();
}

VolumeAnswers::Reply VolumeAnswers::answer(const Probe& probe, InstanceId self) {
  const auto found = store_.cast(probe.step, probe.function, probe.clip, probe.ray);
  const wire::OrderAnswer out{self, probe.number, found.ok(), found ? scene::to_text(*found) : found.error().text};
  return {{}, wire::OrderAnswer::kName, wire::encode(out)};
}

bool VolumeAnswers::has_work() const {
  const std::lock_guard lock(mutex_);
  return !waiting_.empty() || !probes_.empty() ||
         std::any_of(epochs_.begin(), epochs_.end(), [](const Epoch& e) { return e.weights_due; });
}

std::optional<VolumeAnswers::Reply> VolumeAnswers::work(InstanceId self) {
  std::unique_lock lock(mutex_);
  // Weights of past epochs are useless.
  if (!epochs_.empty() && epochs_.back().weights_due) {
    for (Epoch& e : epochs_) e.weights_due = false;
    const Epoch newest = epochs_.back();
    lock.unlock();
    return weigh(newest, self);
  }
  if (!probes_.empty()) {
    const Probe probe = probes_.front();
    probes_.pop_front();
    lock.unlock();
    return answer(probe, self);
  }
  if (waiting_.empty()) return std::nullopt;
  const auto first = std::min_element(waiting_.begin(), waiting_.end(),
                                      [](const Waiting& a, const Waiting& b) { return a.round < b.round; });
  const Waiting request = std::move(*first);
  waiting_.erase(first);
  lock.unlock();
  return answer(request);
}

// Returns the mean over the answers so far; before the first one, that of the heaviest slice.
double VolumeAnswers::bytes_per_voxel(int step, const volume::LevelSet& shown, const std::vector<uint32_t>& weights) {
  if (voxels_ > 0) return double(bytes_) / double(voxels_);
  const auto heaviest = std::max_element(weights.begin(), weights.end());
  if (heaviest == weights.end() || *heaviest == 0) return 0;
  const int k = begin_ + int(heaviest - weights.begin());
  const auto voxels = store_.voxels(step, k, k + 1, shown, {});
  if (!voxels || voxels->size() == 0) return 0;
  const auto& size = session_.grid.size;
  return double(volume::encode_voxels(*voxels, size[0], size[1]).size()) / double(voxels->size());
}

std::optional<VolumeAnswers::Reply> VolumeAnswers::weigh(const Epoch& epoch, InstanceId self) {
  auto weights = store_.slice_weights(epoch.step, epoch.shown);
  if (!weights) {
    log::error("{}", weights.error().text);
    return std::nullopt;
  }
  const double bytes = bytes_per_voxel(epoch.step, epoch.shown, *weights);
  const wire::SliceWeights message{self, epoch.id, uint64_t(begin_), std::move(*weights), bytes};
  return Reply{{}, wire::SliceWeights::kName, wire::encode(message)};
}

VolumeAnswers::Reply VolumeAnswers::answer(const Waiting& request) {
  wire::VoxelData data;
  data.epoch = request.epoch, data.step = uint64_t(request.step);
  data.begin = uint64_t(request.begin), data.end = uint64_t(request.end);
  data.have = as_bytes(request.have.bytes());

  volume::LevelSet wanted, shown = request.have;
  shown.add(request.shown);
  for (int l = 0; l < session_.levels.count; ++l)
    if (request.shown.has(l) && !request.have.has(l)) wanted.add(l);
  std::vector<uint8_t> encoded;
  Result<volume::Voxels> voxels = Error{};
  if (const auto weights = store_.slice_weights(request.step, wanted); weights) {
    // Take as many slices as one answer may have, at least one.
    int end = request.begin;
    for (uint64_t sum = 0; end < request.end && end - request.begin < kSlicesAnAnswer; ++end) {
      sum += (*weights)[size_t(end - begin_)];
      if (sum > kVoxelsAnAnswer && end > request.begin) break;
    }
    voxels = store_.voxels(request.step, request.begin, end, wanted, {});
  } else {
    voxels = weights.error();
  }
  if (voxels) {
    const auto& size = session_.grid.size;
    encoded = volume::encode_voxels(*voxels, size[0], size[1]);
    data.end = uint64_t(voxels->k_end);
    data.known = true;
    data.voxels = voxels->size();
    data.shown = as_bytes(shown.bytes());
    data.data = as_bytes(encoded);
    voxels_ += voxels->size(), bytes_ += encoded.size();
  } else {
    log::error("{}", voxels.error().text);
  }
  return {request.peer, wire::VoxelData::kName, wire::encode(data), data.voxels, encoded.size()};
}

}  // namespace telesplat::data
