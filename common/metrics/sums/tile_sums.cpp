#include "common/metrics/sums/tile_sums.h"

#include <algorithm>

namespace telesplat::metrics {
namespace {

constexpr size_t kMostOpen = 256, kMostPlanned = 4096;  // frames

}  // namespace

void TileSums::add(const std::string& sampler, const wire::TileDone& tile) {
  samples_ += double(tile.samples);
  kept_ += double(tile.kept);
  bytes_sent_ += double(tile.bytes_sent);
  bounded_ += tile.depth_error_m > 0 || tile.normal_error_deg > 0 || tile.colour_error > 0;
  depth_error_m_ = std::max(depth_error_m_, tile.depth_error_m);
  normal_error_deg_ = std::max(normal_error_deg_, tile.normal_error_deg);
  colour_error_ = std::max(colour_error_, tile.colour_error);
  rays_cast_ += double(tile.rays);
  if (!planned_.contains(tile.frame.value)) rays_full_ += double(tile.rays);
  const bool room = busy_s_.size() < kMostSamplers || busy_s_.contains(sampler);
  busy_s_[room ? sampler : "others"] += std::max(0.0, tile.moments.encode_end_s - tile.moments.sample_begin_s);
  if (tile.step == 1 && !tile.extra) time(tile);
}

void TileSums::time(const wire::TileDone& tile) {
  if (tile.frame.value <= closed_) return;
  Times& f = open_[tile.frame.value];
  const wire::Moments& at = tile.moments;
  f.leased = std::min(f.leased, at.leased_s);
  f.begin = std::min(f.begin, at.sample_begin_s);
  f.end = std::max(f.end, at.encode_end_s);
  f.packing_s += at.packed_s - at.receive_s;
  while (open_.size() > kMostOpen) {
    closed_ = open_.begin()->first;
    close(open_.begin()->second, durations_);
    open_.erase(open_.begin());
  }
}

void TileSums::close(const Times& f, FrameDurations& durations) {
  durations.leased_ms.add((f.end - f.leased) * 1e3);
  durations.sampling_ms.add((f.end - f.begin) * 1e3);
  durations.packing_ms.add(f.packing_s * 1e3);
}

FrameDurations TileSums::durations() const {
  FrameDurations out = durations_;
  for (const auto& [frame, times] : open_) close(times, out);
  return out;
}

void TileSums::add(const PlanRow& plan) {
  ++plans_;
  if (plan.outcome == PlanRow::Outcome::kLate)
    ++plans_late_;
  else if (!plan.asked.extra)
    plan_answer_ms_.add((plan.planned_s - plan.asked_s) * 1e3);
  if (const auto ms = plan.figures.find("plan_ms"); ms != plan.figures.end() && !plan.asked.extra)
    plan_ms_.add(ms->second);
  if (plan.outcome != PlanRow::Outcome::kTiles && plan.outcome != PlanRow::Outcome::kEmpty) return;
  rays_full_ += double(plan.rays_full());
  planned_.insert(plan.asked.frame.value);
  if (planned_.size() > kMostPlanned) planned_.erase(planned_.begin());
}

void TileSums::begin_life() {
  for (const auto& [frame, times] : open_) close(times, durations_);
  open_.clear();
  planned_.clear();
  closed_ = 0;
}

}  // namespace telesplat::metrics
