#include "services/master/tiles/frame_tiles.h"

#include <algorithm>
#include <cmath>

#include "common/core/check.h"

namespace telesplat::master {

std::vector<geometry::Rect> cut_tiles(int width, int height, int tile_size) {
  std::vector<geometry::Rect> out;
  for (int y = 0; y < height; y += tile_size)
    for (int x = 0; x < width; x += tile_size)
      out.push_back({x, y, std::min(tile_size, width - x), std::min(tile_size, height - y)});
  const auto distance = [&](const geometry::Rect& r) {
    return std::hypot(r.x + r.width / 2.0 - width / 2.0, r.y + r.height / 2.0 - height / 2.0);
  };
  std::stable_sort(out.begin(), out.end(), [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
  return out;
}

namespace {

uint64_t pixels(const geometry::Rect& rect) { return uint64_t(rect.width) * uint64_t(rect.height); }

}  // namespace

FrameTiles FrameTiles::of_squares(int width, int height, int tile_size) {
  // A hostile viewer could ask for a frame of very many tiles; larger tiles keep the count bounded.
  while (uint64_t((width + tile_size - 1) / tile_size) * uint64_t((height + tile_size - 1) / tile_size) > 1024)
    tile_size *= 2;
  FrameTiles out;
  out.blocks_ = cut_tiles(width, height, tile_size);
  out.tiles_.resize(out.blocks_.size());
  for (size_t i = 0; i < out.tiles_.size(); ++i) {
    Tile& t = out.tiles_[i];
    t.rect = out.blocks_[i], t.block = i, t.rays = pixels(t.rect);
  }
  return out;
}

FrameTiles FrameTiles::of_bands(int width, int height, size_t bands) {
  constexpr int kRows = 16;  // rows of a JPEG block
  const auto most = int(wire::kMaxTilePixels / width);
  const int count = int(std::clamp<size_t>(bands, 1, 1024)), wanted = (height + count - 1) / count;
  const int rows = std::max(kRows, std::min((wanted + kRows - 1) / kRows, most / kRows) * kRows);
  FrameTiles out;
  for (int y = 0; y < height; y += rows) {
    const geometry::Rect rect{0, y, width, std::min(rows, height - y)};
    out.tiles_.push_back({.rect = rect, .block = out.blocks_.size(), .rays = pixels(rect)});
    out.blocks_.push_back(rect);
  }
  return out;
}

FrameTiles FrameTiles::of_rows(int width, int height) {
  FrameTiles out;
  out.blocks_ = cut_blocks(width, height);
  out.rows_ = RowBands(out.blocks_);
  return out;
}

FrameTiles FrameTiles::of_plan(const wire::Plan& plan) {
  FrameTiles out;
  size_t words = 0;
  for (size_t i = 0; i < plan.tiles.size(); i += wire::kPlanNumbers) {
    const uint32_t* n = &plan.tiles[i];
    Tile t;
    t.rect = {int(n[0]), int(n[1]), int(n[2]), int(n[3])};
    t.block = out.blocks_.size();
    t.rays = n[4];
    t.mask_begin = words, t.mask_words = n[5];
    words += n[5];
    out.blocks_.push_back(t.rect);
    out.tiles_.push_back(std::move(t));
  }
  CHECK(words == plan.masks.size());
  out.masks_ = plan.masks;
  return out;
}

std::optional<size_t> FrameTiles::take(const std::string& sampler, int rows, bool even_own) {
  if (closed_) return std::nullopt;
  for (const size_t i : reopened_)
    if (tiles_[i].given_up_by != sampler) return i;
  if (unleased_ < tiles_.size()) return unleased_;
  if (rows_.rows_left() > 0) {
    const auto band = rows_.carve(rows);
    Tile t;
    t.rect = band.rect, t.block = band.block, t.rays = pixels(band.rect);
    tiles_.push_back(std::move(t));
    return tiles_.size() - 1;
  }
  if (even_own && !reopened_.empty()) return *reopened_.begin();
  return std::nullopt;
}

bool FrameTiles::is_late(const Out& out, double before_s, const Trusts& trusts) const {
  const bool heard = out.heard_s > before_s && out.leased_s > before_s - kHeardFor_s;
  return out.leased_s <= before_s && !(heard && trusts(out.sampler));
}

std::optional<size_t> FrameTiles::overdue(double before_s, const std::string* sampler, const Trusts& trusts) const {
  for (const auto& [id, out] : out_) {
    if (out.leased_s > before_s) break;  // the later ones are younger
    const Tile& t = tiles_[out.tile];
    if (id != t.leases[0] || t.leases.back().value != 0) continue;
    const bool waits = std::all_of(t.leases.begin(), t.leases.end(), [&](LeaseId lease) {
      const Out* o = this->out(lease);
      return !o || (is_late(*o, before_s, trusts) && !(sampler && o->sampler == *sampler));
    });
    if (waits) return out.tile;
  }
  return std::nullopt;
}

std::optional<size_t> FrameTiles::to_copy(const Trusts& trusts) const {
  for (auto it = out_.rbegin(); it != out_.rend(); ++it)
    if (tiles_[it->second.tile].leases[1].value == 0 && trusts(it->second.sampler)) return it->second.tile;
  return std::nullopt;
}

void FrameTiles::lease(size_t i, LeaseId id, const std::string& sampler, double now_s, double expires_s) {
  Tile& t = tiles_[i];
  const auto free = std::find(t.leases.begin(), t.leases.end(), LeaseId{});
  CHECK(t.state != Tile::State::kDone && free != t.leases.end());
  *free = id;
  if (t.state == Tile::State::kOpen) {
    if (i == unleased_)
      ++unleased_;
    else
      reopened_.erase(i);
    t.state = Tile::State::kLeased;
  }
  out_.emplace_hint(out_.end(), id, Out{i, sampler, now_s, now_s, expires_s});
  ++held_[sampler];
}

bool FrameTiles::extend(LeaseId id, const std::string& sampler, double now_s, double expires_s) {
  const auto found = out_.find(id);
  if (found == out_.end() || found->second.sampler != sampler) return false;
  found->second.heard_s = now_s;
  found->second.expires_s = expires_s;
  return true;
}

const FrameTiles::Out* FrameTiles::out(LeaseId id) const {
  const auto found = out_.find(id);
  return found == out_.end() ? nullptr : &found->second;
}

bool FrameTiles::done(uint64_t i) {
  if (i >= unleased_ || tiles_[i].state == Tile::State::kDone) return false;
  Tile& t = tiles_[i];
  for (LeaseId& id : t.leases) {
    if (const auto lease = out_.find(id); lease != out_.end()) end(lease);
    id = {};
  }
  if (t.state == Tile::State::kOpen) reopened_.erase(i);
  t.state = Tile::State::kDone;
  ++done_;
  return true;
}

int FrameTiles::refuse(uint64_t i, const std::string& sampler) {
  if (i >= unleased_ || tiles_[i].state == Tile::State::kDone) return 0;
  tiles_[i].given_up_by = sampler;
  for (const LeaseId id : tiles_[i].leases)
    if (const auto lease = out_.find(id); lease != out_.end() && lease->second.sampler == sampler) {
      take_back(lease);
      break;
    }
  return ++tiles_[i].refused;
}

bool FrameTiles::hopeless(int most_refused, int most_lost) const {
  return std::any_of(reopened_.begin(), reopened_.end(),
                     [&](size_t i) { return tiles_[i].refused > most_refused || tiles_[i].lost > most_lost; });
}

std::map<LeaseId, FrameTiles::Out>::iterator FrameTiles::take_back(std::map<LeaseId, Out>::iterator lease) {
  Tile& t = tiles_[lease->second.tile];
  *std::remove(t.leases.begin(), t.leases.end(), lease->first) = {};
  if (t.leases[0].value == 0) {
    t.state = Tile::State::kOpen;
    reopened_.insert(lease->second.tile);
  }
  return end(lease);
}

std::map<LeaseId, FrameTiles::Out>::iterator FrameTiles::end(std::map<LeaseId, Out>::iterator lease) {
  const auto held = held_.find(lease->second.sampler);
  if (--held->second == 0) held_.erase(held);
  return out_.erase(lease);
}

int FrameTiles::expire(double now_s, const std::function<void(const std::string&)>& lost_sampler) {
  int count = 0;
  for (auto it = out_.begin(); it != out_.end();) {
    if (now_s <= it->second.expires_s) {
      ++it;
      continue;
    }
    lost_sampler(it->second.sampler);
    tiles_[it->second.tile].given_up_by = it->second.sampler;
    ++tiles_[it->second.tile].lost;
    it = take_back(it);
    ++count;
  }
  return count;
}

int FrameTiles::release(const std::string& sampler) {
  int count = 0;
  for (auto it = out_.begin(); it != out_.end();)
    if (it->second.sampler == sampler)
      ++tiles_[it->second.tile].lost, it = take_back(it), ++count;
    else
      ++it;
  return count;
}

size_t FrameTiles::leases_of(const std::string& sampler) const {
  const auto held = held_.find(sampler);
  return held == held_.end() ? 0 : held->second;
}

std::vector<geometry::Rect> cut_blocks(int width, int height) {
  std::vector<geometry::Rect> out;
  for (int y = 0; y < height; y += kBlockRows) out.push_back({0, y, width, std::min(kBlockRows, height - y)});
  const auto distance = [&](const geometry::Rect& r) { return std::abs(2 * r.y + r.height - height); };
  std::stable_sort(out.begin(), out.end(), [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
  return out;
}

RowBands::RowBands(const std::vector<geometry::Rect>& blocks) : blocks_(blocks) {
  for (const auto& b : blocks_) rows_left_ += b.height;
}

RowBands::Band RowBands::carve(int rows) {
  CHECK(rows >= 1 && rows_left_ > 0);
  const geometry::Rect& block = blocks_[block_];
  const Band band{
      block_,
      {block.x, block.y + begun_rows_, block.width, std::min(rows, block.height - begun_rows_)},
  };
  rows_left_ -= band.rect.height;
  begun_rows_ += band.rect.height;
  if (begun_rows_ == block.height) ++block_, begun_rows_ = 0;
  return band;
}

int band_rows(double target_s, double row_s, int rows_left, size_t samplers) {
  const size_t parts = 3 * std::max<size_t>(samplers, 1);
  const int most = std::max(1, int((size_t(std::max(rows_left, 0)) + parts - 1) / parts));
  if (!(row_s > 0)) return 1;
  return int(std::clamp(std::round(target_s / row_s), 1.0, double(most)));
}

}  // namespace telesplat::master
