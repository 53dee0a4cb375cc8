// Based on: L. Shirman, S. Abi-Ezzi, "The cone of normals technique for fast processing of curved patches",
// Eurographics 1993.
#include <xxhash.h>

#include <algorithm>
#include <cmath>

#include "common/image/normal.h"
#include "common/points/allocation.h"
#include "common/points/mosaic_builder.h"

namespace telesplat::points {

static_assert(sizeof(Mosaic) == 40, "most mosaics hold a few points: their headers count");

namespace {

// Decoded normals in 1/32767: sums of integers do not depend on their order.
struct IntegerNormal {
  int16_t x, y, z, unused;
};
const std::vector<IntegerNormal>& integer_normals() {
  static const std::vector<IntegerNormal> table = [] {
    std::vector<IntegerNormal> out(65536);
    const auto at = [](float v) { return static_cast<int16_t>(std::floor(v * 32767.0f + 0.5f)); };
    for (uint32_t code = 0; code < 65536; ++code) {
      const glm::vec3 n = image::decode_normal16(static_cast<uint16_t>(code));
      out[code] = {at(n.x), at(n.y), at(n.z), 0};
    }
    return out;
  }();
  return table;
}

struct Cone {
  uint16_t axis;
  int8_t cosine;  // in 1/127, rounded down; -127 = no cone
};

Cone normal_cone(const uint16_t* normals, uint32_t n) {
  const IntegerNormal* table = integer_normals().data();
  int64_t sx = 0, sy = 0, sz = 0;
  for (uint32_t i = 0; i < n; ++i) {
    const IntegerNormal v = table[normals[i]];
    sx += v.x, sy += v.y, sz += v.z;
  }
  const glm::dvec3 sum(static_cast<double>(sx), static_cast<double>(sy), static_cast<double>(sz));
  const double length = std::sqrt(glm::dot(sum, sum));
  if (!(length > 0)) return {0, -127};
  Cone cone{image::encode_normal16(glm::vec3(sum / length)), -127};

  const IntegerNormal a = table[cone.axis];
  int32_t least = INT32_MAX;  // |a . v| < 2^31, and so are its partial sums
  for (uint32_t i = 0; i < n; ++i) {
    const IntegerNormal v = table[normals[i]];
    least = std::min(least, a.x * v.x + a.y * v.y + a.z * v.z);
  }
  // 1e-4 covers the rounding of both vectors, so that the promise of cone_cosine() holds for the decoded ones.
  const double cosine = least / (32767.0 * 32767.0) - 1e-4;
  cone.cosine = static_cast<int8_t>(std::clamp(std::floor(cosine * 127.0), -127.0, 127.0));
  return cone;
}

uint8_t mean_position(const uint16_t* q, uint32_t n) {
  uint64_t sum = 0;
  for (uint32_t i = 0; i < n; ++i) sum += q[i];
  return static_cast<uint8_t>(sum / n >> 8);
}

}  // namespace

size_t Mosaic::data_bytes() const {
  const size_t words =
      size_t{3} * counts_[0] + (counts_[1] < counts_[0] ? counts_[1] : 0) + (counts_[2] < counts_[1] ? counts_[2] : 0);
  return words * 4;
}

glm::vec3 Mosaic::centroid_room(const geometry::Box& leaf) const {
  const glm::vec3 fraction((static_cast<float>(centroid_[0]) + 0.5f) / 256.0f,
                           (static_cast<float>(centroid_[1]) + 0.5f) / 256.0f,
                           (static_cast<float>(centroid_[2]) + 0.5f) / 256.0f);
  return leaf.lo + fraction * leaf.size();
}

size_t Mosaic::bytes() const { return sizeof(Mosaic) + allocated_bytes(data_bytes()); }

uint64_t Mosaic::digest() const {
  struct {
    uint64_t sequence_and_frame;
    uint32_t counts[kLevels];
    float pixel_range;
    uint16_t cone_axis;
    int8_t cone_cosine;
    uint8_t centroid[3];
    uint16_t direction_to_eye;
  } header{sequence_and_frame_, {counts_[0], counts_[1], counts_[2]},       pixel_range_,     cone_axis_,
           cone_cosine_,        {centroid_[0], centroid_[1], centroid_[2]}, direction_to_eye_};
  static_assert(std::has_unique_object_representations_v<decltype(header.counts)> && sizeof header == 32);
  return XXH3_64bits_withSeed(data_.get(), data_bytes(), XXH3_64bits(&header, sizeof header));
}

MosaicBuilder::MosaicBuilder(Sequence sequence, FrameId frame, const std::array<uint32_t, kLevels>& counts) {
  const uint64_t sequence_mask = (uint64_t{1} << Mosaic::kSequenceBits) - 1;
  mosaic_.sequence_and_frame_ = (sequence.value & sequence_mask) | frame.value << Mosaic::kSequenceBits;
  mosaic_.counts_ = counts;
  mosaic_.data_ = std::make_unique_for_overwrite<std::byte[]>(mosaic_.data_bytes());
  const size_t n = counts[0];
  x = reinterpret_cast<uint16_t*>(mosaic_.data_.get());
  y = x + n, z = y + n, normal = z + n;
  colour = reinterpret_cast<uint32_t*>(normal + n);
  mean1 = counts[1] < counts[0] ? const_cast<uint32_t*>(mosaic_.level(1).colour) : nullptr;
  mean2 = counts[2] < counts[1] ? const_cast<uint32_t*>(mosaic_.level(2).colour) : nullptr;
}

Mosaic MosaicBuilder::finish(float pixel_range, const glm::vec3& direction_to_eye) {
  const uint32_t n = mosaic_.counts_[0];
  const Cone cone = normal_cone(normal, n);
  mosaic_.pixel_range_ = pixel_range;
  mosaic_.direction_to_eye_ =
      direction_to_eye == glm::vec3(0) ? Mosaic::kNoDirection : image::encode_normal16(direction_to_eye);
  mosaic_.cone_axis_ = cone.axis;
  mosaic_.cone_cosine_ = cone.cosine;
  mosaic_.centroid_ = {mean_position(x, n), mean_position(y, n), mean_position(z, n)};
  return std::move(mosaic_);
}

}  // namespace telesplat::points
