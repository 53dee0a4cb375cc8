#include "services/master/slabs/partition.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "common/core/check.h"
#include "common/wire/messages.h"

namespace telesplat::master {
namespace {

// Returns, for every i, the fewest ranges of weight at most `cap` into which slices [i, n) can be cut; sums[i]:
// weight of the slices before i.
std::vector<int> ranges_needed(const std::vector<uint64_t>& sums, uint64_t cap) {
  const size_t n = sums.size() - 1;
  std::vector<int> needed(n + 1, 0);
  size_t end = n;  // the furthest that a range from i reaches
  for (size_t i = n; i-- > 0;) {
    while (sums[end] - sums[i] > cap) --end;
    needed[i] = sums[n] == sums[i] ? 0 : 1 + needed[end];
  }
  return needed;
}

// Returns the least weight that the heaviest of at most `parts` ranges can have.
uint64_t smallest_cap(const std::vector<uint64_t>& sums, std::span<const uint32_t> weights, int parts) {
  uint64_t lo = std::max<uint64_t>(*std::max_element(weights.begin(), weights.end()), sums.back() / uint64_t(parts));
  uint64_t hi = sums.back();
  while (lo < hi) {
    const uint64_t middle = lo + (hi - lo) / 2;
    if (ranges_needed(sums, middle)[0] <= parts)
      hi = middle;
    else
      lo = middle + 1;
  }
  return lo;
}

}  // namespace

std::vector<SlabRange> cut_slabs(std::span<const uint32_t> weights, int parts) {
  CHECK(!weights.empty() && parts >= 1);
  const int n = int(weights.size());
  std::vector<uint64_t> sums(weights.size() + 1, 0);
  std::vector<int> weighty(weights.size() + 1, 0);  // slices of weight above 0 before this one
  for (size_t i = 0; i < weights.size(); ++i) {
    sums[i + 1] = sums[i] + weights[i];
    weighty[i + 1] = weighty[i] + (weights[i] > 0);
  }
  parts = std::clamp(weighty.back(), 1, parts);
  if (parts == 1) return {{0, n}};
  const uint64_t cap = smallest_cap(sums, weights, parts);
  const std::vector<int> needed = ranges_needed(sums, cap);
  std::vector<SlabRange> out;
  int begin = 0;
  for (int left = parts; left > 1; --left) {
    // End as near to an equal share of the remaining weight as the cap allows, for this range and the later ones, and
    // leave each later one a slice that weighs something.
    const double target = double(sums[size_t(n)] - sums[size_t(begin)]) / left;
    int best = -1;
    double best_off = 0;
    for (int end = begin + 1; end < n; ++end) {
      const uint64_t weight = sums[size_t(end)] - sums[size_t(begin)];
      if (weight > cap || weighty.back() - weighty[size_t(end)] < left - 1) break;
      if (weight == 0 || needed[size_t(end)] > left - 1) continue;
      const double off = std::abs(double(weight) - target);
      if (best < 0 || off < best_off) best = end, best_off = off;
    }
    CHECK(best > 0);  // the cap was chosen so that a cut exists
    out.push_back({begin, best});
    begin = best;
  }
  out.push_back({begin, n});
  return out;
}

bool Partition::ready() const {
  return std::all_of(slabs.begin(), slabs.end(), [](const Slab& s) { return s.ready; });
}

std::optional<size_t> Partition::slab_of(const std::string& sampler) const {
  for (size_t i = 0; i < slabs.size(); ++i)
    if (slabs[i].sampler == sampler) return i;
  return std::nullopt;
}

void SlabPartitions::set_slices(int slices) {
  CHECK(slices >= 1);
  weights_.assign(size_t(slices), 1);
  newest_ = in_use_ = nullptr;
  none_since_s_.reset();
  changed_ = true;
}

Status SlabPartitions::set_weights(std::vector<uint32_t> weights) {
  if (weights.size() != weights_.size())
    return Error{fmt::format("weights of {} slices; the volume has {}", weights.size(), weights_.size())};
  weights_ = std::move(weights);
  return ok_status();
}

bool SlabPartitions::has(const std::string& sampler) const {
  return std::find(samplers_.begin(), samplers_.end(), sampler) != samplers_.end();
}

void SlabPartitions::join(const std::string& sampler) {
  if (has(sampler)) return;
  // In the middle, the bounds of the others' slabs move least: about a quarter of the volume goes to another sampler;
  // at an end it would be half.
  samplers_.insert(samplers_.begin() + std::ptrdiff_t((samplers_.size() + 1) / 2), sampler);
  changed_ = true;
}

void SlabPartitions::leave(const std::string& sampler) {
  if (std::erase(samplers_, sampler) == 0) return;
  changed_ = true;
  if (in_use_ && !all_here(*in_use_)) in_use_ = nullptr;
}

bool SlabPartitions::all_here(const Partition& p) const {
  return std::all_of(p.slabs.begin(), p.slabs.end(), [&](const Slab& s) { return has(s.sampler); });
}

// True if the newest slabs weigh so differently now that others would be clearly better.
bool SlabPartitions::uneven() const {
  const auto heaviest = [&](const auto& ranges, const auto& range_of) {
    uint64_t most = 0;
    for (const auto& r : ranges) {
      const SlabRange range = range_of(r);
      most = std::max(most, std::accumulate(weights_.begin() + range.begin, weights_.begin() + range.end, uint64_t{0}));
    }
    return double(most);
  };
  const double total = double(std::accumulate(weights_.begin(), weights_.end(), uint64_t{0}));
  const double most = heaviest(newest_->slabs, [](const Slab& s) { return s.range; });
  const size_t parts = std::min(newest_->slabs.size() + newest_->spare.size(), size_t{wire::kMaxSlabs});
  if (most <= kUneven * total / double(parts)) return false;
  return heaviest(cut_slabs(weights_, int(parts)), [](const SlabRange& r) { return r; }) < 0.9 * most;
}

std::shared_ptr<const Partition> SlabPartitions::update(double now_s) {
  if (weights_.empty() || samplers_.empty()) return nullptr;
  std::shared_ptr<const Partition> made;
  if (changed_ || (newest_ && now_s - newest_->made_s >= kRecutAfter_s && uneven())) {
    changed_ = false;
    const auto ranges = cut_slabs(weights_, int(std::min(samplers_.size(), size_t{wire::kMaxSlabs})));
    newest_ = std::make_shared<Partition>(Partition{.number = ++made_, .made_s = now_s});
    for (size_t i = 0; i < samplers_.size(); ++i) {
      if (i >= ranges.size()) {
        newest_->spare.push_back(samplers_[i]);
        continue;
      }
      const uint64_t weight =
          std::accumulate(weights_.begin() + ranges[i].begin, weights_.begin() + ranges[i].end, uint64_t{0});
      newest_->slabs.push_back({.sampler = samplers_[i], .range = ranges[i], .weight = weight});
    }
    made = newest_;
  }
  if (!in_use_ && !none_since_s_) none_since_s_ = now_s;
  if (newest_ && in_use_ != newest_) {
    if (newest_->ready()) {
      in_use_ = newest_;
      none_since_s_.reset();
    } else if (!in_use_ && now_s - *none_since_s_ >= kReadyPatience_s) {
      // none_since_s_ stays: if this happens again before a partition is ready, the next one is not waited for either.
      // Samplers may come and go all the time.
      in_use_ = newest_;
    }
  }
  return made;
}

void SlabPartitions::ready(const std::string& sampler, uint64_t number, uint64_t voxels, uint64_t bytes) {
  for (auto* p : {newest_.get(), in_use_.get()})
    if (const auto slab = p && p->number == number ? p->slab_of(sampler) : std::nullopt) {
      p->slabs[*slab].ready = true;
      p->slabs[*slab].voxels = voxels;
      p->slabs[*slab].bytes = bytes;
    }
}

}  // namespace telesplat::master
