#include "client/viewer/points/base_replica.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/geometry/surfels.h"
#include "common/points/compaction.h"
#include "common/points/mosaic_builder.h"

namespace telesplat::viewer {
namespace {

constexpr uint32_t kMostHiddenWords = geometry::kMaxSurfels / 64;

}  // namespace

// Received surfels stay on display until the packer's base begins.
void BaseReplica::start(double now_s) {
  active_ = true;
  base_ = 0;
  came_.clear(), came_count_ = 0;
  ask(0, kWindow, now_s);
}

void BaseReplica::ask(uint64_t part, uint64_t parts, double now_s) {
  if (!expected_) return;
  ask_({.viewer = {}, .base = base_, .part = part, .parts = parts});
  asked_ = std::max(asked_, part + parts);
  heard_s_ = now_s;
}

void BaseReplica::tick(double now_s) {
  if (!active_ || complete() || now_s - heard_s_ < kPatience_s) return;
  const auto missing = static_cast<uint64_t>(std::ranges::find(came_, false) - came_.begin());
  asked_ = missing;
  ask(missing, kWindow, now_s);
}

void BaseReplica::begin(InstanceId packer, uint64_t base) {
  packer_ = packer, base_ = base;
  config_.reset();
  came_.clear(), came_count_ = 0, asked_ = 0;
  leaves_.clear(), order_.clear(), hidden_.clear(), changed_.clear();
  published_ = 0;
  ++count_;
}

Status BaseReplica::take(const wire::BasePart& part, double now_s) {
  if (part.packer != packer_ || part.base != base_) {
    // An older base that was under way, or part 0 was lost: it is asked for again.
    if (part.part != 0 || is_older(part.packer, part.base)) return ok_status();
    begin(part.packer, part.base);
    asked_ = kWindow;
  }
  heard_s_ = now_s;
  const points::ModelConfig config{part.box_room, static_cast<int>(std::min<uint64_t>(part.depth, 1u << 10)), false};
  if (const Status valid = points::validate(config); !valid) return valid;
  if ((config_ && *config_ != config) || (!came_.empty() && came_.size() != part.parts) ||
      !(part.spacing_m > 0 && part.spacing_m < 1e6))
    return Error{fmt::format("part {} of base {} contradicts an earlier one", part.part, part.base)};
  const auto* bytes = reinterpret_cast<const uint8_t*>(part.surfel_data.data());
  auto leaves = codec::decode_surfels({bytes, part.surfel_data.size()});
  if (!leaves) return leaves.error();
  const uint32_t stride = part.part == 0 ? uint32_t{wire::kBaseStride} : 1;
  const uint32_t beyond = (1023u >> config.depth << config.depth) * (1u | 1u << 10 | 1u << 20);
  for (const auto& leaf : *leaves)
    if ((leaf.key & beyond) != 0 || leaf.first + uint64_t{stride} * (leaf.surfels.size() - 1) >= part.surfels)
      return Error{fmt::format("part {} of base {} has surfels beyond its limits", part.part, part.base)};
  config_ = config, spacing_m_ = part.spacing_m;
  came_.resize(part.parts);
  if (came_[part.part]) return ok_status();
  came_[part.part] = true, ++came_count_;
  for (auto& from : *leaves) {
    Leaf& leaf = leaves_[from.key];
    if (!leaf.surfels.empty()) {
      if (leaf.stride <= stride) continue;
      order_.erase(leaf.first);
    }
    leaf = {from.first, stride, std::move(from.surfels)};
    order_[leaf.first] = from.key;
    changed_.insert(from.key);
  }
  if (asked_ < came_.size() && asked_ < came_count_ + kWindow) ask(asked_, 1, now_s);
  return ok_status();
}

void BaseReplica::set_word(uint32_t index, uint64_t bits, uint64_t number) {
  Word& word = hidden_[index];
  if (word.number > number) return;
  const bool differs = word.bits != bits;
  word = {bits, number};
  if (!differs) return;
  const uint32_t first = 64 * index;
  auto leaf = order_.upper_bound(first);
  if (leaf != order_.begin()) --leaf;
  for (; leaf != order_.end() && leaf->first < first + 64; ++leaf) changed_.insert(leaf->second);
}

void BaseReplica::take(const wire::BaseHidden& m, double now_s) {
  if (is_older(m.packer, m.base)) return;
  if (m.packer != packer_ || m.base != base_) {
    begin(m.packer, m.base);
    ask(0, kWindow, now_s);
  }
  const bool gap = !m.whole && published_ != 0 && m.number > published_ + 1;
  published_ = std::max(published_, m.number);
  if (m.whole) {
    std::set<uint32_t> old;
    for (const auto& [index, word] : hidden_)
      if (word.bits != 0) old.insert(index);
    for (size_t i = 0; i < m.words.size(); i += 3) old.erase(m.words[i]);
    for (const uint32_t index : old) set_word(index, 0, m.number);
  }
  for (size_t i = 0; i < m.words.size(); i += 3)
    if (m.words[i] < kMostHiddenWords) set_word(m.words[i], m.words[i + 1] | uint64_t{m.words[i + 2]} << 32, m.number);
  if (gap) ask_({.viewer = {}, .base = base_, .part = 0, .parts = 0});
}

std::optional<points::Mosaic> BaseReplica::mosaic(const Leaf& leaf) {
  std::vector<const codec::LeafSurfel*> shown;
  for (size_t i = 0; i < leaf.surfels.size(); ++i) {
    const uint32_t number = leaf.number(i);
    const auto word = hidden_.find(number / 64);
    if (word == hidden_.end() || (word->second.bits >> number % 64 & 1) == 0) shown.push_back(&leaf.surfels[i]);
  }
  if (shown.empty()) return std::nullopt;
  const auto n = static_cast<uint32_t>(shown.size());
  const Sequence sequence{++mosaics_};
  points::MosaicBuilder out(sequence, {}, {n, n, n});
  for (uint32_t i = 0; i < n; ++i) {
    const codec::LeafSurfel& s = *shown[i];
    const auto middle = [](uint8_t step) { return static_cast<uint16_t>(step << 8 | 128); };
    out.x[i] = middle(s.x), out.y[i] = middle(s.y), out.z[i] = middle(s.z);
    out.normal[i] = s.normal;
    out.colour[i] = s.colour;
  }
  const double spacing_m = static_cast<double>(kSpread) * spacing_m_ * std::sqrt(static_cast<double>(leaf.stride));
  const auto range = static_cast<float>(points::octree_grid(*config_).leaf_size / spacing_m);
  const points::Mosaic plain = out.finish(range, glm::vec3(0));
  return points::merge_mosaics({&plain}, sequence);
}

std::vector<std::pair<points::ClusterKey, std::optional<points::Mosaic>>> BaseReplica::take_changes(size_t most) {
  std::vector<std::pair<points::ClusterKey, std::optional<points::Mosaic>>> out;
  while (!changed_.empty() && out.size() < most) {
    const points::ClusterKey key = *changed_.begin();
    changed_.erase(changed_.begin());
    out.emplace_back(key, mosaic(leaves_.at(key)));
  }
  return out;
}

}  // namespace telesplat::viewer
