#include "services/master/slabs/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/scene/session.h"
#include "services/master/control.h"

namespace telesplat::master {
namespace {

constexpr double kGuessedBytesPerVoxel = 4;

// True if two parts are of the same volume.
bool same_volume(const volume::Session& a, const volume::Session& b) {
  return a.grid == b.grid && a.levels == b.levels && a.lit == b.lit && a.steps == b.steps && a.parts == b.parts;
}

std::string described(const volume::Session& s) {
  return fmt::format("{} x {} x {} voxels, {} levels, {} steps, {} parts, {}", s.grid.size[0], s.grid.size[1],
                     s.grid.size[2], s.levels.count, s.steps, s.parts, s.lit ? "lit" : "not lit");
}

}  // namespace

Status VolumeScene::fits(const volume::Session& session, const wire::Hello& data) const {
  if (!data.endpoints.contains("voxels")) return Error{"has no endpoint \"voxels\""};
  if (session.parts < 1 || session.parts > session.grid.size[2] || session.part < 0 || session.part >= session.parts)
    return Error{
        fmt::format("part {} of {} of a volume of {} slices", session.part, session.parts, session.grid.size[2])};
  const auto p = size_t(session.part);
  for (size_t i = 0; i < servers_.size(); ++i) {
    const Server& s = servers_[i];
    if (!s.here || s.instance == data.instance) continue;
    if (!same_volume(session, session_))
      return Error{fmt::format("its volume ({}) is another than that of {} ({})", described(session), s.name,
                               described(session_))};
    if (i == p) return Error{fmt::format("part {} of {} is held by {}", p + 1, session.parts, s.name)};
  }
  return ok_status();
}

// Begins a volume and forgets the one before.
void VolumeScene::begin(const volume::Session& session) {
  const auto parts = size_t(session.parts);
  servers_.assign(parts, {});
  told_.assign(parts, {});
  content_hash_.assign(parts, "");
  known_.assign(parts, false);
  weighed_.assign(parts, std::nullopt);
  weights_.assign(size_t(session.grid.size[2]), 0);
  session_ = session;
}

Result<VolumeScene::Change> VolumeScene::adopt(const wire::Hello& data) {
  const auto read = volume::read_session(data.parameters, data.facts);
  if (!read) return read.error();
  const volume::Session& session = *read;
  if (const Status s = fits(session, data); !s) return s.error();
  const auto p = size_t(session.part);
  const bool same = !servers_.empty() && same_volume(session, session_);
  Change change;
  change.another =
      !same || (known_[p] && content_hash_[p] != scene::value_or(data.facts, "content_hash", std::string()));
  if (!same) begin(session);
  Server& server = servers_[p];
  const int64_t slices = session.grid.size[2];
  const std::string& endpoint = data.endpoints.at("voxels");
  change.servers = !server.here || server.endpoint != endpoint;
  server = {.name = data.name,
            .endpoint = endpoint,
            .instance = data.instance,
            .begin = int(slices * session.part / session.parts),
            .end = int(slices * (session.part + 1) / session.parts),
            .bytes_per_voxel = server.bytes_per_voxel,
            .here = true};
  const bool was_complete = complete();
  const bool says_the_same = known_[p] && told_[p] == session && !change.another;
  told_[p] = session;
  content_hash_[p] = scene::value_or(data.facts, "content_hash", std::string());
  known_[p] = true;
  // The first part's server decides how the volume looks at the beginning.
  if (p == 0 && !says_the_same) {
    session_ = session;
    box_room_ = data.box_room;
    parameters_ = data.parameters;
    facts_ = data.facts;
    playing_ = true;
    begun_s_.reset();
    change.values = true;
  }
  change.values |= !was_complete && complete();
  return change;
}

void VolumeScene::leave(InstanceId data) {
  for (Server& s : servers_)
    if (s.instance == data) s.here = false;
}

bool VolumeScene::complete() const {
  return !known_.empty() && std::all_of(known_.begin(), known_.end(), [](bool k) { return k; });
}

std::map<std::string, double> VolumeScene::values() const {
  auto out = parameters_;
  for (const auto& [name, value] : volume::to_parameters(session_)) out[name] = value;
  return out;
}

std::map<std::string, std::string> VolumeScene::facts() const {
  auto out = facts_;
  for (const auto& [name, value] : volume::to_facts(session_)) out[name] = value;
  return out;
}

Result<bool> VolumeScene::weigh(const wire::SliceWeights& m) {
  const auto s = std::find_if(servers_.begin(), servers_.end(), [&](const Server& x) { return x.instance == m.data; });
  if (s == servers_.end()) return Error{"slice weights from a data server without a part"};
  const auto p = size_t(s - servers_.begin());
  if (m.begin != uint64_t(s->begin) || m.voxels.size() != size_t(s->end - s->begin))
    return Error{fmt::format("weights of {} slices from {} on; part {} has slices {} to {}", m.voxels.size(), m.begin,
                             p + 1, s->begin, s->end)};
  if (!(m.bytes_per_voxel >= 0 && m.bytes_per_voxel <= 1e6))
    return Error{fmt::format("{} bytes a voxel", m.bytes_per_voxel)};
  if (weighed_[p] && m.epoch < *weighed_[p]) return false;
  weighed_[p] = m.epoch;
  s->bytes_per_voxel = m.bytes_per_voxel;
  std::copy(m.voxels.begin(), m.voxels.end(), weights_.begin() + s->begin);
  return true;
}

bool VolumeScene::weighed() const {
  return std::all_of(weighed_.begin(), weighed_.end(), [](const auto& w) { return w.has_value(); });
}

uint64_t VolumeScene::bytes(const Server& server, int begin, int end) const {
  double voxels = 0;
  for (int k = begin; k < end; ++k) voxels += weights_[size_t(k)];
  return uint64_t(voxels * (server.bytes_per_voxel > 0 ? server.bytes_per_voxel : kGuessedBytesPerVoxel));
}

double VolumeScene::bytes_per_voxel() const {
  double bytes = 0, voxels = 0;
  for (const Server& s : servers_)
    for (int k = s.begin; k < s.end && s.bytes_per_voxel > 0; ++k) {
      bytes += weights_[size_t(k)] * s.bytes_per_voxel;
      voxels += weights_[size_t(k)];
    }
  return voxels > 0 ? bytes / voxels : 0;
}

Status VolumeScene::set_transfer(const std::string& text) {
  const auto presets = volume::transfer_presets();
  const bool preset = std::any_of(presets.begin(), presets.end(), [&](const auto& p) { return p.name == text; });
  auto transfer = preset ? volume::transfer_preset(text, session_.range) : volume::parse_transfer(text, session_.range);
  if (!transfer) return transfer.error();
  if (volume::to_text(*transfer).size() > volume::kMaxTransferText)
    return Error{fmt::format("a transfer function of {} points, whose text has more than {} bytes",
                             transfer->points.size(), volume::kMaxTransferText)};
  session_.transfer = *std::move(transfer);
  return ok_status();
}

Status VolumeScene::set(const std::map<std::string, std::string>& arguments) {
  if (arguments.empty()) return Error{"set: names no parameter; NAME=VALUE is needed"};
  volume::Session wanted = session_;
  bool playing = playing_;
  for (const auto& [name, text] : arguments) {
    const auto value = read_number(name, text);
    if (!value) return value.error();
    if (name == "volume.step") {
      if (!(*value >= 0 && *value < session_.steps && *value == std::floor(*value)))
        return Error{fmt::format("volume.step is {}, not one of the steps 0 to {}", *value, session_.steps - 1)};
      wanted.step = int(*value);
      playing = false;
    } else if (name == "volume.steps-per-s") {
      if (!(*value >= 0 && *value <= 1000))
        return Error{fmt::format("volume.steps-per-s is {}, limits 0 and 1000", *value)};
      wanted.steps_per_s = *value;
      playing = *value > 0;
    } else {
      return Error{
          fmt::format("{} cannot be set; of a volume: volume.step, volume.steps-per-s, volume.layers; ctl tf sets the "
                      "transfer function",
                      name.substr(0, 64))};
    }
  }
  session_ = wanted;
  playing_ = playing;
  begun_s_.reset();
  return ok_status();
}

Status VolumeScene::animate(const std::string& text) {
  if (text != "on" && text != "off")
    return Error{
        fmt::format("animate: \"{}\"; a volume's steps are played with on and stopped with off", text.substr(0, 64))};
  if (text == "on" && !(session_.steps > 1 && session_.steps_per_s > 0))
    return Error{fmt::format("animate: a volume of {} steps at {} a second has nothing to play", session_.steps,
                             session_.steps_per_s)};
  playing_ = text == "on";
  begun_s_.reset();
  return ok_status();
}

Result<bool> VolumeScene::play(const PlayOrder& order) {
  if (session_.steps < 2) return Error{"play: the volume has one step"};
  if (order.how == PlayOrder::How::kPlay) {
    if (const Status s = animate("on"); !s) return s.error();
    return false;
  }
  playing_ = false;
  begun_s_.reset();
  if (order.how == PlayOrder::How::kPause) return false;
  const int step = ((session_.step + order.steps) % session_.steps + session_.steps) % session_.steps;
  return std::exchange(session_.step, step) != step;
}

bool VolumeScene::step(double now_s) {
  if (!playing()) return false;
  if (!begun_s_) begun_s_ = now_s, first_step_ = session_.step;
  const double passed = std::floor((now_s - *begun_s_) * session_.steps_per_s);
  const int step = int(std::fmod(first_step_ + passed, double(session_.steps)));
  return std::exchange(session_.step, step) != step;
}

}  // namespace telesplat::master
