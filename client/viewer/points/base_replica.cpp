#include "client/viewer/points/base_replica.h"

#include <fmt/format.h>

#include <algorithm>
#include <unordered_set>

#include "common/geometry/chunk_code.h"

namespace telesplat::viewer {
namespace {

constexpr uint32_t kWords = wire::kBasePart / 64;  // words of hidden triangles, a part
static_assert(splat::BasePart::kMostTriangles == wire::kBasePart);

}  // namespace

// The base stays on display until the packer's begins.
void BaseReplica::start(double now_s) {
  active_ = true;
  base_ = 0;
  ask(0, kWindow, now_s);
}

void BaseReplica::ask(uint64_t part, uint64_t parts, double now_s) {
  if (!expected_) return;
  ask_({.viewer = {}, .base = base_, .part = part, .parts = parts});
  asked_ = std::max(asked_, part + parts);
  heard_s_ = now_s;
}

void BaseReplica::tick(double now_s) {
  if (!active_ || (base_ != 0 && came_ == parts_.size()) || now_s - heard_s_ < kPatience_s) return;
  const auto missing = static_cast<uint64_t>(std::ranges::find(parts_, nullptr) - parts_.begin());
  asked_ = base_ != 0 ? missing : 0;
  ask(asked_, kWindow, now_s);
}

void BaseReplica::take(const wire::BaseBegin& m, double now_s) {
  if (m.packer == packer_ && m.base <= base_) return;
  packer_ = m.packer, base_ = m.base;
  parts_.assign(m.parts, nullptr);
  hidden_.clear(), published_ = 0;
  coarse_ = m.coarse, came_ = 0, asked_ = 0;
  ++changes_;
  if (m.parts > 0) ask(0, kWindow, now_s);
}

Status BaseReplica::take(const wire::BasePart& part, double now_s) {
  if (part.packer != packer_ || part.base != base_) return ok_status();  // the base before
  heard_s_ = now_s;
  if (part.part >= parts_.size())
    return Error{fmt::format("part {} of base {} is refused: it has {} parts", part.part, part.base, parts_.size())};
  if (parts_[part.part]) return ok_status();
  const auto chunk = geometry::decode_chunk(part.mesh);
  if (!chunk) return chunk.error();
  const auto& view = chunk->view;
  if (view.scalars || view.triangles() > splat::BasePart::kMostTriangles || view.vertices() > 3 * view.triangles())
    return Error{fmt::format("part {} of base {} is refused: {} triangles, {} vertices, {}", part.part, part.base,
                             view.triangles(), view.vertices(), view.scalars ? "scalars" : "colours")};
  auto made = std::make_shared<splat::BasePart>(splat::base_part(view));
  made->error_m = static_cast<float>(part.error_m);
  parts_[part.part] = std::move(made);
  ++came_, ++changes_;
  if (asked_ < parts_.size() && asked_ < came_ + kWindow) ask(asked_, 1, now_s);
  return ok_status();
}

void BaseReplica::set_word(uint32_t index, uint64_t bits, uint64_t number) {
  if (index >= parts_.size() * kWords) return;
  Word& word = hidden_[index];
  if (word.number > number) return;
  changes_ += word.bits != bits;
  word = {bits, number};
}

void BaseReplica::take(const wire::BaseHidden& m, double now_s) {
  if (m.packer != packer_ || m.base != base_) return;
  const bool gap = !m.whole && published_ != 0 && m.number > published_ + 1;
  published_ = std::max(published_, m.number);
  if (m.whole) {
    std::unordered_set<uint32_t> named;
    for (size_t i = 0; i < m.words.size(); i += 3) named.insert(m.words[i]);
    for (const auto& [index, word] : hidden_)
      if (!named.contains(index)) set_word(index, 0, m.number);
  }
  for (size_t i = 0; i < m.words.size(); i += 3)
    set_word(m.words[i], m.words[i + 1] | uint64_t{m.words[i + 2]} << 32, m.number);
  if (gap) ask(0, 0, now_s);
}

std::shared_ptr<const splat::BaseMesh> BaseReplica::mesh() const {
  const bool whole = coarse_ == 0 || complete();
  auto out = std::make_shared<splat::BaseMesh>();
  out->number = changes_;
  for (size_t n = whole ? coarse_ : 0; n < (whole ? parts_.size() : coarse_); ++n) {
    if (!parts_[n]) continue;
    out->parts.push_back(parts_[n]);
    out->triangles += parts_[n]->indices.size() / 3;
    auto& hidden = out->hidden.emplace_back();
    for (uint32_t k = 0; k < kWords; ++k) {
      const auto word = hidden_.find(static_cast<uint32_t>(n) * kWords + k);
      if (word == hidden_.end() || word->second.bits == 0) continue;
      hidden.resize(kWords);
      hidden[k] = word->second.bits;
    }
  }
  return out->parts.empty() ? nullptr : out;
}

}  // namespace telesplat::viewer
