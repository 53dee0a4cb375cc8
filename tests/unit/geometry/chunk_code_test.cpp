// Coded chunks: nothing is lost, and bytes that are damaged are refused or a valid chunk.
#include "common/geometry/chunk_code.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <random>
#include <set>

namespace telesplat::geometry {
namespace {

struct Parts {
  std::vector<float> positions_room;
  std::vector<uint32_t> normals, colours, indices;
  bool scalars = false;
  std::vector<std::byte> chunk() const { return build_chunk(positions_room, normals, colours, indices, scalars); }
};

// Random bits in all attributes, and triangles between any vertices.
Parts random_parts(size_t vertices, size_t triangles, uint32_t seed) {
  std::mt19937 random(seed);
  Parts out;
  for (size_t v = 0; v < vertices; ++v) {
    for (int a = 0; a < 3; ++a) out.positions_room.push_back(std::bit_cast<float>(uint32_t(random() & 0xbf7fffff)));
    out.normals.push_back(uint32_t(random()));
    out.colours.push_back(uint32_t(random()) & 0xffffff);
  }
  for (size_t i = 0; i < 3 * triangles; ++i) out.indices.push_back(uint32_t(random() % vertices));
  return out;
}

std::vector<std::byte> coded(const Parts& parts) {
  const auto chunk = parts.chunk();
  return encode_chunk(*MeshChunkView::validate(chunk));
}

// A triangle from its smallest corner on, in the same sense.
std::vector<std::array<uint32_t, 3>> triangles_of(std::span<const uint32_t> indices) {
  std::vector<std::array<uint32_t, 3>> out;
  for (size_t i = 0; i < indices.size(); i += 3) {
    std::array<uint32_t, 3> t{indices[i], indices[i + 1], indices[i + 2]};
    auto least = t;
    for (int n = 0; n < 2; ++n) std::rotate(t.begin(), t.begin() + 1, t.end()), least = std::min(least, t);
    out.push_back(least);
  }
  return out;
}

void expect_round_trip(const Parts& parts) {
  const auto chunk = parts.chunk(), code = coded(parts);
  const auto held = decode_chunk(code);
  ASSERT_TRUE(held.ok()) << held.error().text;
  const size_t before_indices = sizeof(ChunkHeader) + 20 * parts.normals.size();
  const auto* decoded = reinterpret_cast<const std::byte*>(held->view.positions_room.data()) - sizeof(ChunkHeader);
  EXPECT_EQ(std::memcmp(decoded, chunk.data(), before_indices), 0) << "header, positions, normals, colours";
  EXPECT_EQ(triangles_of(held->view.indices), triangles_of(parts.indices));
  EXPECT_EQ(held->view.box_room, MeshChunkView::validate(chunk)->box_room);
  EXPECT_EQ(held->view.scalars, parts.scalars);
  EXPECT_EQ(decoded_bytes(code), chunk.size());
}

TEST(ChunkCode, LosesNothing) {
  expect_round_trip(random_parts(3, 1, 1));
  expect_round_trip(random_parts(1, 1, 2));
  expect_round_trip(random_parts(257, 100, 3));  // vertices that no triangle has, and one more than a block of the code
  expect_round_trip(random_parts(40000, 65536, 4));
  Parts scalars = random_parts(500, 1000, 5);
  scalars.scalars = true;
  for (size_t v = 0; v < 500; ++v)
    scalars.colours[v] = v % 7 ? uint32_t(v << 20) : 0x7fc00000 + uint32_t(v);  // NaN with different bits
  expect_round_trip(scalars);
  Parts zeros = random_parts(10, 20, 6);
  zeros.positions_room.assign(30, -0.0f);
  expect_round_trip(zeros);
}

TEST(ChunkCode, ColoursThatAreAllTheSameCostNearlyNothing) {
  Parts parts = random_parts(32768, 65536, 7);
  const size_t any = coded(parts).size();
  parts.colours.assign(32768, 0x80a0c0);
  EXPECT_GT(any - coded(parts).size(), 2.9 * 32768) << "random colours have three bytes";
  expect_round_trip(parts);
}

// Three triangles of a fan.
Parts fan() {
  Parts out = random_parts(5, 3, 8);
  out.indices = {0, 1, 2, 0, 2, 3, 0, 3, 4};
  return out;
}

TEST(ChunkCode, RefusesEveryTruncation) {
  auto code = coded(fan());
  for (size_t size = 0; size < code.size(); ++size) {
    const std::vector<std::byte> shorter(code.begin(), code.begin() + std::ptrdiff_t(size));  // ends where memory ends
    EXPECT_FALSE(decode_chunk(shorter).ok()) << size;
  }
  code.push_back({});
  EXPECT_FALSE(decode_chunk(code).ok()) << "longer by a byte";
}

// Each byte of a small chunk takes all values; a decoded chunk is valid, and its indices are checked.
TEST(ChunkCode, DamagedBytesAreRefusedOrAValidChunk) {
  auto code = coded(fan());
  size_t refused = 0;
  for (std::byte& byte : code)
    for (int change = 1; change < 256; ++change) {
      byte ^= std::byte(change);
      const auto held = decode_chunk(code);
      refused += !held.ok();
      EXPECT_TRUE(!held.ok() || std::ranges::max(held->view.indices) < held->view.vertices());
      byte ^= std::byte(change);
    }
  EXPECT_GT(refused, 255 * sizeof(CodedChunkHeader) / 4);
  std::mt19937 random(9);
  auto large = coded(random_parts(3000, 5000, 10));
  for (int n = 0; n < 300; ++n) {
    auto damaged = large;
    for (int flips = 0; flips <= n % 5; ++flips) damaged[random() % damaged.size()] ^= std::byte(1 << random() % 8);
    (void)decode_chunk(damaged);
  }
}

TEST(ChunkCode, CountsAreCheckedBeforeMemoryIsTaken) {
  const auto code = coded(fan());
  const auto error_with = [&](size_t offset, uint32_t value) {
    auto damaged = code;
    std::memcpy(damaged.data() + offset, &value, sizeof value);
    EXPECT_EQ(decoded_bytes(damaged), 0u);
    const auto held = decode_chunk(damaged);
    return held.ok() ? "" : held.error().text;
  };
  for (const size_t offset : {offsetof(CodedChunkHeader, vertices), offsetof(CodedChunkHeader, triangles)}) {
    EXPECT_NE(error_with(offset, 0).find("limits"), std::string::npos);
    EXPECT_NE(error_with(offset, kMaxChunkTriangles + 1).find("limits"), std::string::npos);
    EXPECT_NE(error_with(offset, kMaxChunkTriangles).find("cannot hold"), std::string::npos);
  }
  EXPECT_NE(error_with(offsetof(CodedChunkHeader, stream_bytes), ~0u).find("beyond"), std::string::npos);
  EXPECT_NE(error_with(0, kChunkMagic).find("magic"), std::string::npos);
}

}  // namespace
}  // namespace telesplat::geometry
