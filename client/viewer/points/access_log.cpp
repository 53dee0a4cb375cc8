#include "client/viewer/points/access_log.h"

#include <algorithm>

#include "common/core/check.h"

namespace telesplat::viewer {
namespace {

constexpr size_t kMaxSeen =
    1u << 21;  // 16 MiB; a display that draws more until the next report tells of the first frames only

}  // namespace

void AccessLog::add(std::span<const points::ClusterKey> clusters, std::span<const uint32_t> frames) {
  CHECK(frames.empty() || frames.size() == clusters.size());
  if (clusters.empty()) return;
  if (with_frames_ == frames.empty()) {
    with_frames_ = !frames.empty();
    seen_.clear();
  }
  if (seen_.size() + clusters.size() > kMaxSeen) return;
  for (size_t i = 0; i < clusters.size(); ++i)
    seen_.push_back(uint64_t{clusters[i]} << 32 | (frames.empty() ? 0 : frames[i]));
}

std::vector<AccessLog::Report> AccessLog::reports() {
  std::sort(seen_.begin(), seen_.end());
  seen_.erase(std::unique(seen_.begin(), seen_.end()), seen_.end());
  std::vector<Report> out;
  for (size_t i = 0; i < seen_.size(); ++i) {
    if (i % kMaxInReport == 0) out.emplace_back();
    out.back().clusters.push_back(static_cast<uint32_t>(seen_[i] >> 32));
    if (with_frames_) out.back().frames.push_back(static_cast<uint32_t>(seen_[i]));
  }
  seen_.clear();  // its memory stays
  return out;
}

}  // namespace telesplat::viewer
