// Running numbers for keys: vertices, edges.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

namespace telesplat::data {

/// Numbers keys, compared by their bytes, in the order in which they first come. An open hash table, which grows up to
/// millions of keys.
template <class Key>
class Numbering {
 public:
  static constexpr uint32_t kNone = ~uint32_t{0};

  /// keys: expected number of keys.
  explicit Numbering(size_t keys = 512) : table_(std::bit_ceil(std::max<size_t>(2 * keys, 16)), kNone) {}

  /// Returns the number of a key: the next one if it is new.
  uint32_t operator()(const Key& key) {
    if (2 * (keys_.size() + 1) > table_.size()) grow();
    uint32_t& slot = table_[place(key)];
    if (slot == kNone) {
      slot = static_cast<uint32_t>(keys_.size());
      keys_.push_back(key);
    }
    return slot;
  }
  /// kNone: the key has not come.
  uint32_t find(const Key& key) const { return table_[place(key)]; }
  const std::vector<Key>& keys() const { return keys_; }  ///< by number
  std::vector<Key> take_keys() { return std::move(keys_); }

 private:
  static uint64_t hash(const Key& key) {
    std::array<uint64_t, sizeof(Key) / sizeof(uint64_t)> words;
    static_assert(sizeof words == sizeof key);
    std::memcpy(words.data(), &key, sizeof key);
    uint64_t h = 0;
    for (const uint64_t word : words) h = (std::rotl(h, 23) ^ word) * 0x9e3779b97f4a7c15;
    return h ^ h >> 32;
  }
  size_t place(const Key& key) const {
    const size_t mask = table_.size() - 1;
    size_t at = hash(key) & mask;
    while (table_[at] != kNone && std::memcmp(&keys_[table_[at]], &key, sizeof key) != 0) at = (at + 1) & mask;
    return at;
  }
  void grow() {
    table_.assign(2 * table_.size(), kNone);
    for (size_t i = 0; i < keys_.size(); ++i) table_[place(keys_[i])] = static_cast<uint32_t>(i);
  }

  std::vector<Key> keys_;
  std::vector<uint32_t> table_;
};

}  // namespace telesplat::data
