#include "services/master/gate/gate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/core/utf8.h"

namespace telesplat::master {
namespace {

constexpr size_t kMostBuckets = 4096;
constexpr double kBurst_s = 2;  // of the rate: a master that was stopped finds as much waiting
constexpr double kIdle_s = 5;

}  // namespace

bool Gate::admit(const std::string& peer, double now_s) {
  auto bucket = peers_.find(peer);
  if (bucket == peers_.end()) {
    if (peers_.size() >= kMostBuckets) forget_idle(now_s);
    // Where there are that many, the rest has one together.
    const std::string& whose = peers_.size() < kMostBuckets ? peer : std::string();
    bucket = peers_.try_emplace(whose, limits_.max_messages, kBurst_s * limits_.max_messages).first;
  }
  if (bucket->second.take(now_s)) return true;
  ++hit_.messages_refused;
  return false;
}

void Gate::forget_idle(double now_s) {
  if (now_s - forgot_s_ < 1) return;
  forgot_s_ = now_s;
  std::erase_if(peers_, [&](const auto& p) { return now_s - p.second.last_s() > kIdle_s; });
}

wire::ViewRequest Gate::admit(const wire::ViewRequest& view) {
  const auto pixels = [](const geometry::Camera& c) { return uint64_t(c.width) * uint64_t(c.height); };
  const uint64_t most = std::max<uint64_t>(limits_.max_sampling_pixels, 1);
  if (pixels(view.camera) <= most) return view;
  ++hit_.views_coarser;
  wire::ViewRequest out = view;
  int step = std::max(2, int(std::sqrt(double(pixels(view.camera)) / double(most))));
  do out.camera = geometry::subsample(view.camera, step++);
  while (pixels(out.camera) > most);
  return out;
}

}  // namespace telesplat::master
