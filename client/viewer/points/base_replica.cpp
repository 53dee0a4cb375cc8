#include "client/viewer/points/base_replica.h"

#include <fmt/format.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <limits>
#include <queue>
#include <unordered_set>
#include <utility>

#include "common/geometry/chunk_code.h"

namespace telesplat::viewer {
namespace {

constexpr uint64_t kWords = wire::kBasePart / 64;  // words of hidden triangles, a part
static_assert(splat::BasePart::kMostTriangles == wire::kBasePart);
// Triangles that are held, over those that are shown: the levels above these, and what was wanted a while ago.
constexpr uint64_t kHeld = 2;

}  // namespace

// The base stays on display until the packer's begins.
void BaseReplica::start(double now_s) {
  active_ = true;
  base_ = 0;
  under_way_.clear();
  ask(0, 0, now_s);
}

void BaseReplica::ask(uint64_t part, uint64_t parts, double now_s) {
  heard_s_ = now_s;
  if (most_ > 0) ask_({.viewer = {}, .base = base_, .part = part, .parts = parts});
}

void BaseReplica::tick(const std::optional<splat::Viewpoint>& from, double now_s) {
  if (!active_ || most_ == 0) return;
  const bool late = now_s - heard_s_ >= kPatience_s;
  if (base_ == 0 && late) ask(0, 0, now_s);
  if (base_ == 0 || nodes_.empty()) return;
  if (late) under_way_.clear();
  if (from && now_s - plan_.made_s >= kPlans_s) plan_.made_s = now_s, plan(*from);
  ask_more(now_s);
}

// Parts the node that looks coarsest as long as there are triangles left.
void BaseReplica::plan(const splat::Viewpoint& from) {
  const auto error = [&](uint32_t n) {
    double away = splat::distance_m(nodes_[n].info.box_room, from.eye_room);
    if (nodes_[n].whole()) {
      away = std::numeric_limits<double>::max();
      for (const auto& part : nodes_[n].parts) away = std::min(away, splat::distance_m(part->box_room, from.eye_room));
    }
    const double error_m = double{nodes_[n].info.spacing_m};
    return error_m / std::max(away - error_m, std::numeric_limits<double>::min());
  };
  std::priority_queue<std::pair<double, uint32_t>> open;
  plan_.nodes.clear();
  plan_.triangles = 0, ++plan_.number;
  const auto want = [&](uint32_t n) {
    open.emplace(error(n), n);
    plan_.nodes.push_back(n);
    plan_.triangles += nodes_[n].info.triangles;
    nodes_[n].wanted = plan_.number;
  };
  for (const uint32_t root : roots_) want(root);
  for (; !open.empty() && open.top().first > from.fine;) {
    const auto& node = nodes_[open.top().second].info;
    open.pop();
    uint64_t below = 0;
    for (uint32_t i = 0; i < node.children; ++i) below += nodes_[node.first_child + i].info.triangles;
    if (below <= node.triangles || plan_.triangles - node.triangles + below > most_) continue;
    plan_.triangles -= node.triangles;
    for (uint32_t i = 0; i < node.children; ++i) want(node.first_child + i);
  }
  make_room();
}

// Drops what was not wanted for longest.
void BaseReplica::make_room() {
  uint64_t held = 0;
  std::vector<std::pair<uint64_t, uint32_t>> spare;  // newest plan that wants a node, and the node
  for (uint32_t n = 0; n < nodes_.size(); ++n) {
    if (nodes_[n].came == 0) continue;
    held += nodes_[n].info.triangles;
    if (nodes_[n].wanted < plan_.number) spare.emplace_back(nodes_[n].wanted, n);
  }
  std::ranges::sort(spare);
  for (size_t i = 0; i < spare.size() && held > kHeld * most_; ++i) {
    held -= nodes_[spare[i].second].info.triangles;
    drop(spare[i].second);
    dropped_.push_back(spare[i].second);
  }
}

void BaseReplica::drop(uint32_t n) {
  if (n >= nodes_.size()) return;
  nodes_[n].parts.assign(nodes_[n].parts.size(), nullptr);
  nodes_[n].came = 0;
  ++changes_;
}

void BaseReplica::ask_more(double now_s) {
  for (const uint32_t n : plan_.nodes) {
    const Node& node = nodes_[n];
    for (size_t i = 0; i < node.parts.size() && !node.whole(); ++i) {
      if (under_way_.size() >= kWindow) return;
      const uint64_t part = first_part_[n] + i;
      if (node.parts[i] || std::ranges::find(under_way_, part) != under_way_.end()) continue;
      under_way_.push_back(part);
      ask(part, 1, now_s);
    }
  }
}

void BaseReplica::take(const wire::BaseBegin& m, double now_s) {
  if (m.packer == packer_ && m.base <= newest_) return;
  packer_ = m.packer, newest_ = m.base, base_ = m.nodes == 0 ? m.base : 0;
  clear();
  if (base_ == 0 && active_) ask(0, 0, now_s);
}

void BaseReplica::clear() {
  nodes_.clear(), roots_.clear(), hidden_.clear(), under_way_.clear();
  first_part_ = {0}, plan_ = {}, published_ = 0;
  ++changes_;
}

void BaseReplica::take(const wire::BaseTree& m, double now_s) {
  if (m.packer == packer_ && (m.base < newest_ || m.base == base_)) return;
  if (m.packer == packer_ && m.base == newest_ && known()) {  // after a new connection
    base_ = m.base;
    return;
  }
  packer_ = m.packer, newest_ = base_ = m.base;
  clear();
  first_part_ = wire::first_base_parts(m.nodes);
  std::vector<bool> is_child(m.nodes.size());
  for (size_t n = 0; n < m.nodes.size(); ++n) {
    const auto& info = m.nodes[n];
    nodes_.push_back({info, std::vector<std::shared_ptr<const splat::BasePart>>(first_part_[n + 1] - first_part_[n])});
    std::fill_n(is_child.begin() + info.first_child, info.children, true);
  }
  for (uint32_t n = 0; n < nodes_.size(); ++n)
    if (!is_child[n]) roots_.push_back(n);
  plan_.nodes = roots_;
  heard_s_ = now_s;
  if (active_) ask_more(now_s);
}

uint32_t BaseReplica::node_of(uint64_t part) const {
  return static_cast<uint32_t>(std::ranges::upper_bound(first_part_, part) - first_part_.begin() - 1);
}

Status BaseReplica::take(const wire::BasePart& m, double now_s) {
  if (m.packer != packer_ || m.base != base_) return ok_status();  // the base before
  if (m.part >= first_part_.back())
    return Error{fmt::format("part {} of base {} is refused: it has {} parts", m.part, m.base, first_part_.back())};
  const uint32_t n = node_of(m.part);
  Node& node = nodes_[n];
  auto& place = node.parts[m.part - first_part_[n]];
  if (place) return ok_status();
  const auto chunk = geometry::decode_chunk(m.mesh);
  if (!chunk) return chunk.error();
  const auto& view = chunk->view;
  const uint64_t wanted = std::min(wire::kBasePart, node.info.triangles - wire::kBasePart * (m.part - first_part_[n]));
  if (view.scalars || view.triangles() != wanted || view.vertices() > 3 * wanted)
    return Error{fmt::format("part {} of base {} is refused: {} triangles of {}, {} vertices, {}", m.part, m.base,
                             view.triangles(), wanted, view.vertices(), view.scalars ? "scalars" : "colours")};
  place = std::make_shared<splat::BasePart>(splat::base_part(view));
  ++node.came;
  heard_s_ = now_s;
  std::erase(under_way_, m.part);
  changes_ += node.whole() || std::ranges::find(roots_, n) != roots_.end();
  if (active_) ask_more(now_s);
  return ok_status();
}

void BaseReplica::set_word(uint32_t index, uint64_t bits, uint64_t number, std::vector<uint64_t>& touched) {
  const uint64_t part = index / kWords;
  if (part >= first_part_.back()) return;
  Hidden& hidden = hidden_[part];
  if (hidden.bits.empty()) hidden.bits.resize(kWords), hidden.numbers.resize(kWords);
  const size_t k = index % kWords;
  if (hidden.numbers[k] > number) return;
  if (hidden.bits[k] != bits) touched.push_back(part);
  hidden.bits[k] = bits, hidden.numbers[k] = number;
}

void BaseReplica::take(const wire::BaseHidden& m, double now_s) {
  if (m.packer != packer_ || m.base != base_) return;
  const bool gap = !m.whole && published_ != 0 && m.number > published_ + 1;
  published_ = std::max(published_, m.number);
  std::vector<uint64_t> touched;
  if (m.whole) {
    std::unordered_set<uint32_t> named;
    for (size_t i = 0; i < m.words.size(); i += 3) named.insert(m.words[i]);
    std::vector<uint32_t> others;
    for (const auto& [part, hidden] : hidden_)
      for (uint64_t k = 0; k < kWords; ++k)
        if (const auto index = static_cast<uint32_t>(part * kWords + k); hidden.bits[k] != 0 && !named.contains(index))
          others.push_back(index);
    for (const uint32_t index : others) set_word(index, 0, m.number, touched);
  }
  for (size_t i = 0; i < m.words.size(); i += 3)
    set_word(m.words[i], m.words[i + 1] | uint64_t{m.words[i + 2]} << 32, m.number, touched);
  for (const uint64_t part : touched) {
    Hidden& hidden = hidden_[part];
    hidden.shown = std::make_shared<const splat::BaseNode::Bits>(hidden.bits);
  }
  changes_ += !touched.empty();
  if (gap) ask(0, 0, now_s);
}

// Appends a node without its children.
void BaseReplica::append(uint32_t n, splat::BaseMesh& out) const {
  const Node& node = nodes_[n];
  splat::BaseNode& shown = out.nodes.emplace_back();
  shown.box_room = node.info.box_room, shown.error_m = node.info.spacing_m;
  for (size_t i = 0; i < node.parts.size(); ++i) {
    if (!node.parts[i]) continue;
    const auto hidden = hidden_.find(first_part_[n] + i);
    const auto& box = node.parts[i]->box_room;
    shown.part_m = std::max(shown.part_m, double{glm::length(box.size())});
    shown.parts.push_back({node.parts[i], hidden == hidden_.end() ? nullptr : hidden->second.shown});
  }
}

std::shared_ptr<const splat::BaseMesh> BaseReplica::mesh() const {
  auto out = std::make_shared<splat::BaseMesh>();
  out->number = changes_;
  std::vector<uint32_t> numbers;  // numbers here of the nodes in `out`
  for (const uint32_t root : roots_)
    if (nodes_[root].came > 0) append(root, *out), numbers.push_back(root);
  out->roots = numbers.size();
  for (size_t i = 0; i < numbers.size(); ++i) {
    const auto& info = nodes_[numbers[i]].info;
    const auto whole = [&](uint32_t child) { return nodes_[info.first_child + child].whole(); };
    bool all = info.children > 0;
    for (uint32_t child = 0; child < info.children; ++child) all = all && whole(child);
    if (!all) continue;
    out->nodes[i].first_child = static_cast<uint32_t>(out->nodes.size()), out->nodes[i].children = info.children;
    for (uint32_t child = 0; child < info.children; ++child) {
      append(info.first_child + child, *out);
      numbers.push_back(info.first_child + child);
    }
  }
  return out->nodes.empty() ? nullptr : out;
}

}  // namespace telesplat::viewer
