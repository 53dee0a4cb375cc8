#include "services/sampler/volume/slab_store.h"

#include <fmt/format.h>

#include <algorithm>

namespace telesplat::sampler {
namespace {

using volume::LevelSet;
using volume::Voxels;

uint64_t bytes_of(const Voxels& v) { return 4 * v.rows.size() + 6 * v.size() + 1024; }

// Returns slice k of several slices.
Voxels cut(const Voxels& from, int k, int size_y) {
  const auto row = size_t(k - from.k_begin) * size_t(size_y);
  const uint32_t first = from.rows[row], last = from.rows[row + size_t(size_y)];
  Voxels out;
  out.k_begin = k, out.k_end = k + 1;
  out.rows.resize(size_t(size_y) + 1);
  for (size_t j = 0; j < out.rows.size(); ++j) out.rows[j] = from.rows[row + j] - first;
  const auto part = [&](const std::vector<uint16_t>& v) {
    return v.empty() ? v : std::vector<uint16_t>(v.begin() + first, v.begin() + last);
  };
  out.i = part(from.i), out.level = part(from.level), out.normal = part(from.normal);
  return out;
}

void append(Voxels& to, const Voxels& slice) {
  const uint32_t before = to.rows.back();
  for (size_t j = 1; j < slice.rows.size(); ++j) to.rows.push_back(before + slice.rows[j]);
  to.i.insert(to.i.end(), slice.i.begin(), slice.i.end());
  to.level.insert(to.level.end(), slice.level.begin(), slice.level.end());
  to.normal.insert(to.normal.end(), slice.normal.begin(), slice.normal.end());
}

bool in_order(const Voxels& v) {
  for (size_t r = 0; r + 1 < v.rows.size(); ++r)
    for (size_t n = v.rows[r] + size_t{1}; n < v.rows[r + 1]; ++n)
      if (v.i[n] <= v.i[n - 1]) return false;
  return true;
}

LevelSet both(const LevelSet& a, const LevelSet& b) {
  std::vector<uint8_t> bits(a.bytes().begin(), a.bytes().end());
  for (size_t i = 0; i < bits.size(); ++i) bits[i] &= b.bytes()[i];
  return *LevelSet::from_bytes(bits);
}

// Returns the voxels of these levels only.
Voxels only(const Voxels& from, const LevelSet& levels) {
  Voxels out;
  out.k_begin = from.k_begin, out.k_end = from.k_end;
  out.rows.push_back(0);
  for (size_t r = 0; r + 1 < from.rows.size(); ++r) {
    for (uint32_t n = from.rows[r]; n < from.rows[r + 1]; ++n) {
      if (!levels.has(from.level[n])) continue;
      out.i.push_back(from.i[n]), out.level.push_back(from.level[n]);
      if (!from.normal.empty()) out.normal.push_back(from.normal[n]);
    }
    out.rows.push_back(uint32_t(out.i.size()));
  }
  return out;
}

}  // namespace

void SlabStore::set_scene(const SlabScene& scene) {
  if (scene_ == scene) return;
  clear();
  assignment_ = {};
  sheet_.clear();
  used_ = {};
  scene_ = scene;
}

void SlabStore::clear() {
  slices_.clear();
  arranged_.clear();
  slice_bytes_.clear();
  voxels_ = 0;
}

Status SlabStore::assign(const wire::SlabAssignment& a) {
  const auto size_z = uint64_t(scene_->grid.size[2]);
  if (a.begin > a.end || a.end > size_z)
    return Error{fmt::format("a slab of slices {} to {} of {}", a.begin, a.end, size_z)};
  for (const auto& e : a.sheet)
    if (e.begin >= e.end || e.end > size_z || e.endpoint.empty())
      return Error{fmt::format("slices {} to {} of {} from '{}' in a sheet", e.begin, e.end, size_z, e.endpoint)};
  assignment_ = a;
  auto sheet = a.sheet;
  std::stable_sort(sheet.begin(), sheet.end(), [](const auto& x, const auto& y) { return x.round < y.round; });
  // Leases of the old partition still need slices of the old sheet.
  for (const auto& e : sheet_)
    if (sheet.size() < 2 * wire::kMaxSlabs && std::find(sheet.begin(), sheet.end(), e) == sheet.end())
      sheet.push_back(e);
  sheet_ = std::move(sheet);
  return ok_status();
}

bool SlabStore::names(const std::string& endpoint) const {
  return std::any_of(sheet_.begin(), sheet_.end(), [&](const auto& e) { return e.endpoint == endpoint; });
}

void SlabStore::use(int begin, int end) {
  used_ = {begin, end};
  const bool newest = begin == int(assignment_.begin) && end == int(assignment_.end);
  if (newest && sheet_.size() > assignment_.sheet.size()) sheet_.resize(assignment_.sheet.size());
  // Drop arranged slabs of earlier partitions: they are of no use, and take as much memory as their voxels.
  std::erase_if(arranged_, [&](const Arranged& a) {
    const bool assigned = a.begin == int(assignment_.begin) && a.end == int(assignment_.end);
    return !assigned && (a.begin != begin || a.end != end);
  });
}

SlabStore::Range SlabStore::with_neighbours(int begin, int end) const {
  return {std::max(begin - 1, 0), std::min(end + 1, scene_->grid.size[2])};
}

bool SlabStore::complete(int step, int k, const LevelSet& shown) const {
  const auto slice = slices_.find({step, k});
  return slice != slices_.end() && slice->second.have.contains(shown);
}

bool SlabStore::holds(const SlabWant& want) const {
  if (!scene_) return false;
  const Range r = with_neighbours(want.begin, want.end);
  for (int k = r.begin; k < r.end; ++k)
    if (!complete(want.step, k, *want.shown)) return false;
  return true;
}

std::optional<VoxelAsk> SlabStore::next(const SlabWant& want) const {
  if (!scene_) return std::nullopt;
  const Range r = with_neighbours(want.begin, want.end);
  const auto have = [&](int k) {
    const auto slice = slices_.find({want.step, k});
    return slice == slices_.end() ? LevelSet{} : slice->second.have;
  };
  for (const auto& e : sheet_) {
    const int end = std::min(r.end, int(e.end));
    int k = std::max(r.begin, int(e.begin));
    while (k < end && complete(want.step, k, *want.shown)) ++k;
    if (k >= end) continue;
    VoxelAsk ask{e.endpoint, want.step, k, k + 1, e.round, want.epoch, have(k)};
    while (ask.end < end && !complete(want.step, ask.end, *want.shown) && have(ask.end) == ask.have) ++ask.end;
    return ask;
  }
  return std::nullopt;
}

void SlabStore::put(const Key& key, Slice slice) {
  if (const auto old = slices_.find(key); old != slices_.end()) erase(old);
  slice_bytes_[key.first] += sampler::bytes_of(slice.voxels);
  voxels_ += slice.voxels.size();
  slices_.emplace(key, std::move(slice));
}

void SlabStore::erase(std::map<Key, Slice>::iterator slice) {
  slice_bytes_[slice->first.first] -= sampler::bytes_of(slice->second.voxels);
  voxels_ -= slice->second.voxels.size();
  slices_.erase(slice);
}

Result<bool> SlabStore::take(const VoxelAsk& ask, const wire::VoxelData& data, const LevelSet& shown) {
  if (!scene_ || data.epoch != ask.epoch || data.step != uint64_t(ask.step) || data.begin < uint64_t(ask.begin) ||
      data.end > uint64_t(ask.end) || data.begin >= data.end)
    return false;
  const auto levels = [](wire::Bytes bytes) -> Result<LevelSet> {
    if (bytes.empty()) return LevelSet{};
    return LevelSet::from_bytes({reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()});
  };
  const auto had = levels(data.have), has = levels(data.shown);
  if (!had) return had.error();
  if (!has) return has.error();
  if (!(*had == ask.have)) return false;
  const auto& size = scene_->grid.size;
  auto voxels = volume::decode_voxels({reinterpret_cast<const uint8_t*>(data.data.data()), data.data.size()}, size[0],
                                      size[1], int(data.begin), int(data.end), scene_->levels.count);
  if (!voxels) return voxels.error();
  // The decoder accepts any part of the slices; the loop below cuts all of them.
  if (voxels->k_begin != int(data.begin) || voxels->k_end != int(data.end))
    return Error{fmt::format("{} sent voxels of slices {} to {} in an answer of slices {} to {}", ask.endpoint,
                             voxels->k_begin, voxels->k_end, data.begin, data.end)};
  if (voxels->size() > 0 && voxels->normal.empty() == scene_->lit)
    return Error{
        fmt::format("voxels {} normals, expected {}", scene_->lit ? "without" : "with", scene_->lit ? "some" : "none")};
  std::vector<std::pair<Key, Slice>> taken;
  for (int k = int(data.begin); k < int(data.end); ++k) {
    Slice slice{cut(*voxels, k, size[1]), {}};
    const Key key{ask.step, k};
    if (const auto old = slices_.find(key); old != slices_.end()) {
      if (!(old->second.have == ask.have)) return false;
      slice.voxels = volume::merge(old->second.voxels, slice.voxels);
      if (!in_order(slice.voxels)) return Error{fmt::format("slice {} brings voxels that were there", k)};
    } else if (!ask.have.empty()) {
      return false;  // the slice was dropped meanwhile
    }
    slice.have = ask.have;
    slice.have.add(*has);
    slice.have.add(shown);  // the server sent all that it has: asking again would bring no more
    taken.emplace_back(key, std::move(slice));
  }
  for (auto& [key, slice] : taken) put(key, std::move(slice));
  return true;
}

const SlabStore::Arranged* SlabStore::find(const SlabWant& want) const {
  for (const auto& a : arranged_)
    if (a.step == want.step && a.begin == want.begin && a.end == want.end && a.have.contains(*want.shown)) return &a;
  return nullptr;
}

std::shared_ptr<const Slab> SlabStore::slab(const SlabWant& want) {
  if (const Arranged* a = find(want)) return a->slab;
  if (!holds(want)) return nullptr;
  const Range r = with_neighbours(want.begin, want.end);
  Arranged made{want.step, want.begin, want.end, slices_.at({want.step, r.begin}).have, nullptr};
  Voxels all;
  all.k_begin = r.begin, all.k_end = r.end;
  all.rows.push_back(0);
  for (int k = r.begin; k < r.end; ++k) {
    const Slice& slice = slices_.at({want.step, k});
    made.have = both(made.have, slice.have);
    append(all, slice.voxels);
  }
  made.slab = make_(scene_->grid, std::move(all));
  std::erase_if(arranged_,
                [&](const Arranged& a) { return a.step == want.step && a.begin == want.begin && a.end == want.end; });
  arranged_.push_back(made);
  return made.slab;
}

bool SlabStore::kept(int k) const {
  const auto in = [&](int begin, int end) {
    const Range r = with_neighbours(begin, end);
    return begin < end && k >= r.begin && k < r.end;
  };
  return in(int(assignment_.begin), int(assignment_.end)) || in(used_.begin, used_.end);
}

uint64_t SlabStore::bytes_of(int step) const {
  const auto slices = slice_bytes_.find(step);
  uint64_t bytes = slices == slice_bytes_.end() ? 0 : slices->second;
  for (const auto& a : arranged_)
    if (a.step == step) bytes += a.slab->bytes();
  return bytes;
}

uint64_t SlabStore::bytes() const {
  uint64_t bytes = 0;
  for (const auto& [step, of_slices] : slice_bytes_) bytes += of_slices;
  for (const auto& a : arranged_) bytes += a.slab->bytes();
  return bytes;
}

void SlabStore::drop_step(int step) {
  for (auto s = slices_.lower_bound({step, 0}); s != slices_.end() && s->first.first == step;) erase(s++);
  std::erase_if(arranged_, [&](const Arranged& a) { return a.step == step; });
  slice_bytes_.erase(step);
}

void SlabStore::trim(int step, const LevelSet& shown) {
  if (!scene_ || bytes() <= budget_bytes_) return;
  for (auto s = slices_.begin(); s != slices_.end();) {
    const auto slice = s++;
    if (!kept(slice->first.second)) erase(slice);
  }
  for (int ahead = scene_->steps - 1; ahead > 0 && bytes() > budget_bytes_; --ahead)
    drop_step((step + ahead) % scene_->steps);
  if (bytes() <= budget_bytes_) return;
  for (auto& [key, slice] : slices_) {
    if (shown.contains(slice.have)) continue;
    slice_bytes_[key.first] -= sampler::bytes_of(slice.voxels);
    voxels_ -= slice.voxels.size();
    slice.voxels = only(slice.voxels, shown);
    slice.have = both(slice.have, shown);
    slice_bytes_[key.first] += sampler::bytes_of(slice.voxels);
    voxels_ += slice.voxels.size();
  }
  std::erase_if(arranged_, [&](const Arranged& a) { return !shown.contains(a.have); });
}

int SlabStore::steps_ahead(int step) const {
  if (!scene_) return 0;
  const uint64_t one = std::max<uint64_t>(bytes_of(step), 1);
  return int(std::min<uint64_t>(budget_bytes_ / one, uint64_t(scene_->steps))) - 1;
}

}  // namespace telesplat::sampler
