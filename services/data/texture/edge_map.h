// Inside services/data/texture: from edges to numbers.
#pragma once

#include <cstdint>
#include <vector>

namespace telesplat::data {

/// Open addressing: millions of edges a pass.
class EdgeMap {
 public:
  static constexpr uint32_t kNone = ~uint32_t{0};

  EdgeMap() { clear(); }
  void clear() {
    keys_.assign(1024, kEmpty);
    values_.assign(1024, kNone);
    size_ = 0;
  }
  size_t size() const { return size_; }

  uint32_t find(uint32_t a, uint32_t b) const { return values_[slot(key(a, b))]; }
  /// The value of this edge; `value` from now on if it had none.
  uint32_t insert(uint32_t a, uint32_t b, uint32_t value) {
    if (2 * (size_ + 1) > keys_.size()) grow();
    const size_t at = slot(key(a, b));
    if (keys_[at] == kEmpty) {
      keys_[at] = key(a, b);
      values_[at] = value;
      ++size_;
    }
    return values_[at];
  }

 private:
  static constexpr uint64_t kEmpty = ~uint64_t{0};
  static uint64_t key(uint32_t a, uint32_t b) { return a < b ? uint64_t{a} << 32 | b : uint64_t{b} << 32 | a; }
  size_t slot(uint64_t key) const {
    const size_t mask = keys_.size() - 1;
    size_t at = size_t((key * 0x9e3779b97f4a7c15ull) >> 20) & mask;
    while (keys_[at] != kEmpty && keys_[at] != key) at = (at + 1) & mask;
    return at;
  }
  void grow() {
    std::vector<uint64_t> keys(keys_.size() * 2, kEmpty);
    std::vector<uint32_t> values(keys.size(), kNone);
    keys.swap(keys_);
    values.swap(values_);
    for (size_t i = 0; i < keys.size(); ++i) {
      if (keys[i] == kEmpty) continue;
      const size_t at = slot(keys[i]);
      keys_[at] = keys[i];
      values_[at] = values[i];
    }
  }

  std::vector<uint64_t> keys_;
  std::vector<uint32_t> values_;
  size_t size_ = 0;
};

}  // namespace telesplat::data
