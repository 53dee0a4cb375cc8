#include "services/sampler/tiles/replay.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "common/codec/depth_codec.h"
#include "common/core/log.h"
#include "common/core/whole_file.h"
#include "services/sampler/tiles/masked_image.h"

namespace telesplat::sampler {

ReplayTiles::ReplayTiles(Replay replay, double cost_scale) : replay_(std::move(replay)), cost_before_s_{0} {
  for (const double cost : replay_.row_cost_s) cost_before_s_.push_back(cost_before_s_.back() + cost * cost_scale);
}

Readiness ReplayTiles::readiness(const HeldLease& held, double now_s) {
  using State = Readiness::State;
  const wire::Lease& lease = held.lease;
  if (lease.camera.width != replay_.frame.width || lease.camera.height != replay_.frame.height || lease.step != 1) {
    log::warn("a lease of a frame of {}x{}, step {}, was dropped: the replay is of {}x{}", lease.camera.width,
              lease.camera.height, lease.step, replay_.frame.width, replay_.frame.height);
    return {State::kHopeless};
  }
  if (lease.lease != lease_) {
    lease_ = lease.lease;
    begin_s_ = std::max(end_s_, held.received_s);
    const double whole_rows_s = cost_before_s_[lease.rect.y + lease.rect.height] - cost_before_s_[lease.rect.y];
    const double pixels = double(lease.rect.width) * lease.rect.height;
    const double part = held.mask ? double(held.mask->count()) / pixels : 1.0;
    end_s_ = begin_s_ + whole_rows_s * part * lease.rect.width / lease.camera.width;
  }
  if (now_s >= end_s_) return {};
  return {State::kWaits, end_s_};
}

Sampled ReplayTiles::sample(const HeldLease& held) {
  const geometry::Rect& r = held.lease.rect;
  Sampled out{{r.width, r.height}, begin_s_, end_s_};
  const auto copy = [&](const auto& from, auto& to) {
    for (int y = 0; y < r.height; ++y)
      std::copy_n(from.begin() + size_t(r.y + y) * replay_.frame.width + r.x, r.width,
                  to.begin() + size_t(y) * r.width);
  };
  copy(replay_.frame.depth, out.image.depth);
  copy(replay_.frame.colour, out.image.colour);
  copy(replay_.frame.normal, out.image.normal);
  if (held.mask) keep_only(*held.mask, out.image);
  return out;
}

namespace {
constexpr uint64_t kMaxBytes = 1u << 30;
}

Status write_replay(const std::string& path, const Replay& replay) {
  const auto stream = codec::encode(replay.frame);
  const nlohmann::ordered_json head{
      {"width", replay.frame.width}, {"height", replay.frame.height}, {"row_cost_s", replay.row_cost_s}};
  std::ofstream out(path, std::ios::binary);
  out << head.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) << '\n';
  out.write(reinterpret_cast<const char*>(stream.data()), std::streamsize(stream.size()));
  out.close();
  if (!out) return Error{path + ": cannot be written"};
  return ok_status();
}

Result<Replay> read_replay(const std::string& path) {
  const auto content = read_whole(path, kMaxBytes);
  if (!content) return content.error();
  const std::string& all = *content;
  const size_t end = all.find('\n');
  const auto head = nlohmann::json::parse(all.substr(0, end == all.npos ? 0 : end), nullptr, false);
  if (!head.is_object() || !head.contains("width") || !head.contains("height") || !head.contains("row_cost_s") ||
      !head["width"].is_number_integer() || !head["height"].is_number_integer() || !head["row_cost_s"].is_array())
    return Error{path + ": does not begin with a line of JSON that has width, height and row_cost_s"};
  Replay out;
  for (const auto& cost : head["row_cost_s"]) {
    const double v = cost.is_number() ? cost.get<double>() : -1;
    if (!(v >= 0) || !std::isfinite(v))
      return Error{fmt::format("{}: row_cost_s holds {}, which is no cost", path, cost.dump().substr(0, 32))};
    out.row_cost_s.push_back(v);
  }
  const auto* data = reinterpret_cast<const uint8_t*>(all.data());
  auto frame = codec::decode({data + end + 1, all.size() - end - 1});
  if (!frame) return Error{fmt::format("{}: {}", path, frame.error().text)};
  out.frame = std::move(*frame);
  if (out.frame.width != head["width"] || out.frame.height != head["height"] ||
      out.row_cost_s.size() != size_t(out.frame.height))
    return Error{fmt::format("{}: says {}x{} and {} rows, holds a frame of {}x{}", path, head["width"].dump(),
                             head["height"].dump(), out.row_cost_s.size(), out.frame.width, out.frame.height)};
  return out;
}

}  // namespace telesplat::sampler
