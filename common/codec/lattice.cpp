#include "common/codec/lattice.h"

#include "common/core/check.h"

namespace telesplat::codec::detail {
namespace {

constexpr size_t kKept = 2;  // lattices a thread keeps; that of the smallest bound takes 8 MiB

}  // namespace

DepthLattice::DepthLattice(uint32_t depth) : depth_(depth) {
  CHECK(depth >= ErrorBounds::kLeastDepth && depth <= ErrorBounds::kMostDepth);
  const uint64_t rest = (uint64_t{1} << 32) - depth;
  for (uint64_t first = 0; first <= image::kMaxDepthCode;) {
    const auto m = static_cast<uint32_t>(std::min<uint64_t>((first << 32) / rest, image::kMaxDepthCode));
    codes_.push_back(m);
    ends_.push_back(m + reach(m));
    first = uint64_t{ends_.back()} + 1;
  }
  lines_.resize(place(image::kMaxDepthCode) + 1);
  uint32_t index = 0;
  for (size_t i = 0; i < lines_.size(); ++i) {
    const uint64_t mantissa = (uint64_t{1} << kFraction) + i % (1u << kFraction), scaled = mantissa << (i >> kFraction);
    const uint64_t first = (scaled + (1u << kFraction) - 1) >> kFraction;
    const auto code = static_cast<uint32_t>(std::min<uint64_t>(first - 1, image::kMaxDepthCode));
    while (ends_[index] < code) ++index;
    lines_[i] = {code, index, 0};
    if (i == 0 || lines_[i - 1].code == code) continue;
    Line& before = lines_[i - 1];
    const uint64_t slope = (uint64_t{index - before.index} << 32) / (code - before.code);
    before.slope = static_cast<uint32_t>(std::min<uint64_t>(slope, 0xFFFFFFFF));
  }
}

std::shared_ptr<const DepthLattice> DepthLattice::of(uint32_t depth) {
  static thread_local std::vector<std::shared_ptr<const DepthLattice>> kept;  // the last used first
  const auto found = std::find_if(kept.begin(), kept.end(), [&](const auto& l) { return l->depth() == depth; });
  if (found != kept.end()) {
    std::rotate(kept.begin(), found, found + 1);
    return kept.front();
  }
  if (kept.size() == kKept) kept.pop_back();
  kept.insert(kept.begin(), std::make_shared<const DepthLattice>(depth));
  return kept.front();
}

}  // namespace telesplat::codec::detail
