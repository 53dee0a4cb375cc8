#include "client/viewer/render/gl/point_arena.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cstring>

namespace telesplat::viewer {
namespace {

constexpr uint32_t kArenaWords = 16u << 20;  // 64 MiB: 5.6 million points

}  // namespace

PointArenas::PointArenas() {
  GLint64 largest = 0;
  glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &largest);
  arena_words_ = static_cast<uint32_t>(std::min<int64_t>(kArenaWords, largest / 4));
}

PointArenas::~PointArenas() {
  for (const Arena& a : arenas_) glDeleteBuffers(1, &a.buffer);
}

size_t PointArenas::KeyHash::operator()(const Key& k) const {
  uint64_t h = (k.sequence.value ^ k.replica << 40) * 0x9e3779b97f4a7c15ull ^ k.cluster;
  h = (h ^ h >> 29) * 0xbf58476d1ce4e5b9ull ^ reinterpret_cast<uintptr_t>(k.colour);
  return static_cast<size_t>((h ^ h >> 32) * 0x94d049bb133111ebull);
}

PointRange PointArenas::place(const splat::DrawItem& item, uint64_t replica) {
  const points::Mosaic::Level level = item.arrays();
  const uint32_t words = 3 * level.count;
  if (item.sequence.value == 0) {
    const Entry entry{allocate(words), words, frame_};
    upload(level, entry.range);
    transient_.push_back(entry);
    return entry.range;
  }
  const auto [it, is_new] =
      entries_.try_emplace(Key{item.cluster->key, level.count, item.sequence, replica, level.x, level.colour});
  Entry& entry = it->second;
  if (is_new) {
    entry.range = allocate(words);
    entry.words = words;
    upload(level, entry.range);
  }
  entry.last_frame = frame_;
  return entry.range;
}

void PointArenas::end_frame() {
  for (const Entry& e : transient_) release(e.range, e.words);
  transient_.clear();
  ++frame_;
  if (frame_ % 16 != 0) return;  // to look through all entries would take too long for every frame
  std::erase_if(entries_, [&](const auto& item) {
    const Entry& e = item.second;
    if (e.last_frame + kKeptFrames >= frame_) return false;
    release(e.range, e.words);
    return true;
  });
}

PointRange PointArenas::allocate(uint32_t words) {
  for (uint32_t a = 0; a < arenas_.size(); ++a) {
    auto& free = arenas_[a].free;
    const auto it = std::find_if(free.begin(), free.end(), [&](const auto& block) { return block.second >= words; });
    if (it == free.end()) continue;
    const auto [word, available] = *it;
    free.erase(it);
    if (available > words) free.emplace(word + words, available - words);
    return {a, word};
  }
  Arena arena;
  const uint32_t size = std::max(arena_words_, words);
  glGenBuffers(1, &arena.buffer);
  glBindBuffer(GL_SHADER_STORAGE_BUFFER, arena.buffer);
  glBufferData(GL_SHADER_STORAGE_BUFFER, static_cast<GLsizeiptr>(size) * 4, nullptr, GL_DYNAMIC_DRAW);
  if (size > words) arena.free.emplace(words, size - words);
  arenas_.push_back(std::move(arena));
  return {count() - 1, 0};
}

void PointArenas::release(const PointRange& range, uint32_t words) {
  auto& free = arenas_[range.arena].free;
  auto it = free.emplace(range.word, words).first;
  if (const auto next = std::next(it); next != free.end() && it->first + it->second == next->first) {
    it->second += next->second;
    free.erase(next);
  }
  if (it == free.begin()) return;
  const auto before = std::prev(it);
  if (before->first + before->second != it->first) return;
  before->second += it->second;
  free.erase(it);
}

void PointArenas::upload(const points::Mosaic::Level& level, const PointRange& range) {
  const size_t n = level.count;
  staging_.resize(3 * n);
  auto* out = reinterpret_cast<std::byte*>(staging_.data());
  for (const uint16_t* array : {level.x, level.y, level.z, level.normal}) {
    std::memcpy(out, array, n * 2);
    out += n * 2;
  }
  std::memcpy(out, level.colour, n * 4);
  glBindBuffer(GL_SHADER_STORAGE_BUFFER, arenas_[range.arena].buffer);
  glBufferSubData(GL_SHADER_STORAGE_BUFFER, static_cast<GLintptr>(range.word) * 4, static_cast<GLsizeiptr>(n) * 12,
                  staging_.data());
}

}  // namespace telesplat::viewer
