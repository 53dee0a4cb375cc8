#include "common/codec/mask_edges.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdlib>

#include "common/codec/range_coder.h"

namespace telesplat::codec::detail {
namespace {

constexpr int kNear = 6;                  // pixels: edges that are farther from the one above are new ones
constexpr int kSlopes = 6;                // of an edge: -2 to 2, by how many pixels it lies beside the one above, and
constexpr uint8_t kNew = 5;               // that there was none
constexpr unsigned kMost = 24;            // bits of a distance
constexpr size_t kMostEdges = 2 * 65536;  // of a mask: larger tiles have 65535 pixels at most that are covered

// How a row's last edge was told.
enum Told : uint8_t { kNothing, kAbove, kBeside, kElsewhere };

struct Edge {
  int x;
  uint8_t slope;
};

class EdgeModel {
 public:
  explicit EdgeModel(int width) : width_(width) {}

  // The edges of the next row, without its end; false where there is no such row, or all have more than a mask has.
  // wanted: these and the end, for those who put them.
  template <class Coder>
  bool code_row(const Coder& coder, const int* wanted) {
    above_.swap(row_);
    row_.clear();
    size_t next = 0;  // the first edge above that lies beyond `at`
    int at = -1;
    for (Told told = kNothing;;) {
      while (next < above_.size() && above_[next].x <= at) ++next;
      const size_t like = next + (next % 2 != row_.size() % 2);  // runs end below where runs end, and begin likewise
      const bool any = like < above_.size();
      const Edge over = any ? above_[like] : Edge{width_, kNew};
      const int then = like + 1 < above_.size() ? above_[like + 1].x : width_;
      const int want = wanted == nullptr ? 0 : wanted[row_.size()];
      const size_t beside = over.x == at + 1;
      if (coder(want != over.x, moved_[over.slope][told][beside]) == 0) {
        if (over.x == width_) return true;
        row_.push_back({over.x, 2});
        at = over.x, told = kAbove;
        if (++edges_ > kMostEdges) return false;
        continue;
      }
      if (any && coder(then < want, ended_[over.slope][told]) != 0) {
        if (then == width_) return false;
        at = then, next = like + 1, told = kElsewhere;
        continue;
      }
      Edge edge;
      if (coder(std::abs(want - over.x) > kNear, far_[over.slope][beside]) == 0) {
        const int off = code_off(coder, want - over.x, over.slope, beside);
        edge = {over.x + off, static_cast<uint8_t>(std::clamp(off, -2, 2) + 2)}, told = kBeside;
      } else {
        const int64_t x = at + code_distance(coder, static_cast<uint32_t>(want - at), row_.size() % 2);
        edge = {static_cast<int>(std::min<int64_t>(x, width_ + 1)), kNew}, told = kElsewhere;
      }
      if (edge.x <= at || edge.x > width_) return false;
      if (edge.x == width_) return true;
      row_.push_back(edge);
      at = edge.x;
      if (++edges_ > kMostEdges) return false;
    }
  }
  const std::vector<Edge>& row() const { return row_; }

 private:
  template <class Coder>
  int code_off(const Coder& coder, int wanted, size_t slope, size_t beside) {
    const uint32_t negative = coder(wanted < 0, negative_[slope][beside]);
    int size = 1;
    while (size < kNear && coder(std::abs(wanted) > size, more_[negative][static_cast<size_t>(size)][slope]) != 0)
      ++size;
    return negative != 0 ? -size : size;
  }
  // 1 to 2^kMost - 1.
  template <class Coder>
  int64_t code_distance(const Coder& coder, uint32_t wanted, size_t ends) {
    unsigned bits = 1;
    while (bits < kMost && coder(static_cast<unsigned>(std::bit_width(wanted)) > bits, longer_[ends][bits]) != 0)
      ++bits;
    const uint32_t below = (1u << (bits - 1)) - 1;
    return int64_t{1u << (bits - 1) | coder.raw(wanted & below, bits - 1)};
  }

  int width_;
  size_t edges_ = 0;  // of all rows
  std::vector<Edge> above_, row_;
  AdaptiveBit moved_[kSlopes][4][2], ended_[kSlopes][4], far_[kSlopes][2];
  AdaptiveBit negative_[kSlopes][2], more_[2][kNear][kSlopes], longer_[2][kMost];
};

// Where runs of a row begin and end, and then its end.
void find_edges(const Mask& mask, int y, std::vector<int>& edges) {
  edges.clear();
  uint64_t before = 0;  // whether the last pixel is covered
  for (size_t w = 0; w < mask.words_per_row(); ++w) {
    const uint64_t word = mask.row(y)[w];
    for (uint64_t changes = word ^ (word << 1 | before); changes != 0; changes &= changes - 1)
      edges.push_back(static_cast<int>(w) * 64 + std::countr_zero(changes));
    before = word >> 63;
  }
  if (edges.empty() || edges.back() != mask.width()) edges.push_back(mask.width());
}

void fill_run(uint64_t* row, int begin, int end) {
  for (int w = begin / 64; w * 64 < end; ++w) {
    const int low = std::max(begin - w * 64, 0), high = std::min(end - w * 64, 64);
    row[w] |= (~uint64_t{0} >> (64 - (high - low))) << low;
  }
}

}  // namespace

void put_edges(std::vector<uint8_t>& out, const Mask& mask) {
  static thread_local std::vector<uint8_t> packed;
  static thread_local std::vector<int> edges;
  packed.clear();
  RangeEncoder coder(packed);
  EdgeModel model(mask.width());
  for (int y = 0; y < mask.height(); ++y) {
    find_edges(mask, y, edges);
    model.code_row(BitCoder{coder}, edges.data());
  }
  coder.finish();
  put_varint(out, static_cast<uint32_t>(packed.size()));
  out.insert(out.end(), packed.begin(), packed.end());
}

bool get_edges(Reader& in, Mask& mask) {
  const auto size = in.varint();
  const auto bytes = size ? in.bytes(*size) : std::nullopt;
  if (!bytes) return false;
  RangeDecoder coder(*bytes);
  EdgeModel model(mask.width());
  for (int y = 0; y < mask.height(); ++y) {
    if (!model.code_row(BitDecoder{coder}, nullptr)) return false;
    const std::vector<Edge>& row = model.row();
    for (size_t i = 0; i < row.size(); i += 2)
      fill_run(mask.row(y), row[i].x, i + 1 < row.size() ? row[i + 1].x : mask.width());
  }
  return coder.finished();
}

}  // namespace telesplat::codec::detail
