// Slice images survive a round trip, and any other bytes do no harm.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <random>

#include "common/volume/slices/block.h"
#include "common/volume/slices/image.h"
#include "common/volume/slices/view.h"
#include "tests/support/volume/slices.h"

namespace telesplat::volume {
namespace {

using Random = std::mt19937_64;

// Soft blobs with hard edges, premultiplied; `noise` bits of noise in the colours.
SliceImage blobs(const geometry::Rect& rect, Random& random, int noise = 0) {
  SliceImage out{3, 10, 20, rect, std::vector<uint32_t>(size_t(rect.width) * size_t(rect.height))};
  std::uniform_real_distribution<double> u(0, 1);
  for (int n = 0; n < 3; ++n) {
    const double cx = u(random) * rect.width, cy = u(random) * rect.height, radius = 5 + u(random) * 40;
    for (int y = 0; y < rect.height; ++y)
      for (int x = 0; x < rect.width; ++x) {
        const double d = std::hypot(x - cx, y - cy) / radius;
        if (d > 1) continue;
        const double alpha = n == 0 ? 1 : 1 - d;
        const auto channel = [&](double c) {
          const int jitter = noise ? int(random() % (1u << noise)) : 0;
          return uint32_t(std::clamp(alpha * c * (255 - 60 * d) - jitter, 0.0, alpha * 255));
        };
        out.pixels[size_t(y) * size_t(rect.width) + size_t(x)] =
            uint32_t(alpha * 255) << 24 | channel(1) << 16 | channel(0.8) << 8 | channel(0.5);
      }
  }
  return out;
}

uint32_t at(const SliceImage& i, int x, int y) {
  const auto& r = i.rect;
  if (x < r.x || y < r.y || x >= r.x + r.width || y >= r.y + r.height) return 0;
  return i.pixels[size_t(y - r.y) * size_t(r.width) + size_t(x - r.x)];
}

void expect_same(const SliceImage& a, const SliceImage& b, int width, int height) {
  EXPECT_EQ(a.layer, b.layer);
  EXPECT_EQ(a.k_begin, b.k_begin);
  EXPECT_EQ(a.k_end, b.k_end);
  int wrong = 0;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) wrong += at(a, x, y) != at(b, x, y);
  EXPECT_EQ(wrong, 0);
}

TEST(SliceCodec, ImagesComeBackWhereverTheyLie) {
  Random random(1);
  for (int n = 0; n < 60; ++n) {
    const int width = 1 + int(random() % 300), height = 1 + int(random() % 300);
    geometry::Rect r;
    r.x = int(random() % uint64_t(width)), r.y = int(random() % uint64_t(height));
    r.width = 1 + int(random() % uint64_t(width - r.x)), r.height = 1 + int(random() % uint64_t(height - r.y));
    const auto image = blobs(r, random, n % 4);
    const auto bytes = encode_slice(image);
    const auto slices = parse_slices(bytes, width, height, 4);
    ASSERT_TRUE(slices.ok()) << slices.error().text;
    if (slices->empty()) {
      EXPECT_TRUE(std::all_of(image.pixels.begin(), image.pixels.end(), [](uint32_t p) { return p == 0; }));
      continue;
    }
    ASSERT_EQ(slices->size(), 1u);
    EXPECT_EQ(join_slices(*slices), bytes);
    const auto back = decode_slice(slices->front(), width, height);
    ASSERT_TRUE(back.ok()) << back.error().text;
    EXPECT_EQ(back->rect, bounds(slices->front(), width, height));
    expect_same(image, *back, width, height);
  }
}

TEST(SliceCodec, SeveralImagesAndPartsOfThem) {
  Random random(2);
  std::vector<uint8_t> bytes;
  std::vector<SliceImage> images;
  for (int layer = 0; layer < 5; ++layer) {
    images.push_back(blobs({0, 0, 200, 150}, random));
    images.back().layer = layer;
    if (layer == 2) std::fill(images.back().pixels.begin(), images.back().pixels.end(), 0u);
    encode_slice(images.back(), bytes);
  }
  auto slices = parse_slices(bytes, 200, 150, 5);
  ASSERT_TRUE(slices.ok());
  ASSERT_EQ(slices->size(), 4u) << "the transparent one is left out";
  for (auto& s : *slices) std::erase_if(s.blocks, [](const EncodedBlock& b) { return b.x != 1; });
  slices->at(1).blocks.clear();
  const auto joined = join_slices(*slices);
  const auto again = parse_slices(joined, 200, 150, 5);
  ASSERT_TRUE(again.ok());
  for (const auto& s : *again) {
    const auto back = decode_slice(s, 200, 150);
    ASSERT_TRUE(back.ok());
    EXPECT_EQ(back->rect.x, 64);
    EXPECT_EQ(back->rect.width, 64);
    for (int y = 0; y < 150; ++y)
      for (int x = 64; x < 128; ++x) ASSERT_EQ(at(*back, x, y), at(images[size_t(s.layer)], x, y));
  }
  EXPECT_LE(again->size(), 3u);
}

TEST(SliceCodec, TransparentPixelsCostAlmostNothing) {
  SliceImage image{0, 0, 1, {0, 0, 1024, 1024}, std::vector<uint32_t>(1 << 20)};
  EXPECT_TRUE(encode_slice(image).empty());
  image.pixels[1024 * 700 + 650] = 0x80402010;
  EXPECT_LT(encode_slice(image).size(), 500u);
}

TEST(SliceCodec, SmoothImagesShrink) {
  Random random(3);
  const auto image = blobs({0, 0, 256, 256}, random);
  const auto covered = std::count_if(image.pixels.begin(), image.pixels.end(), [](uint32_t p) { return p != 0; });
  EXPECT_LT(double(encode_slice(image).size()), 2.5 * double(covered));
}

TEST(SliceCodec, EveryTruncationIsRefused) {
  Random random(4);
  std::vector<uint8_t> bytes;
  for (int n = 0; n < 2; ++n) encode_slice(blobs({30, 20, 60, 50}, random), bytes);
  const auto whole = parse_slices(bytes, 128, 128, 4);
  ASSERT_TRUE(whole.ok());
  ASSERT_EQ(whole->size(), 2u);
  const size_t first = encode_slice(*decode_slice(whole->front(), 128, 128)).size();
  for (size_t n = 1; n < bytes.size(); ++n)
    EXPECT_EQ(parse_slices(std::span(bytes).first(n), 128, 128, 4).ok(), n == first) << n;
  // A block that ends early, with a length that says so.
  for (const auto& b : whole->front().blocks)
    for (size_t n = 0; n < b.bytes.size(); ++n) {
      EncodedSlice cut = whole->front();
      cut.blocks = {{b.x, b.y, b.bytes.first(n)}};
      EXPECT_FALSE(decode_slice(cut, 128, 128).ok()) << n;
    }
}

TEST(SliceCodec, RefusalsSayWhy) {
  Random random(4);
  const auto bytes = encode_slice(blobs({0, 0, 128, 128}, random));
  const auto refused = [&](size_t at, uint8_t value, const char* why, int width = 128, int layers = 4) {
    auto bad = bytes;
    bad[at] = value;
    const auto r = parse_slices(bad, width, 128, layers);
    ASSERT_FALSE(r.ok()) << why;
    EXPECT_NE(r.error().text.find(why), std::string::npos) << r.error().text;
  };
  const size_t blocks = 10 + (bytes[8] | size_t{bytes[9]} << 8);  // after head and tables
  refused(0, 4, "layer 4 of 4");
  refused(2, 20, "slab 20 to 20");
  refused(5, 0x20, "limit 4096");
  refused(6, 0, "without blocks");
  refused(7, 0xff, "blocks");
  refused(9, 0xff, "of tables");
  refused(blocks, 2, "in a raster of 128 x 128");
  refused(blocks + 5, 200, "in a raster");
  refused(blocks + 4, 0, "after one at 0, 0");
  refused(blocks + 3, 0xff, "are left");
  refused(0, 3, "in a raster of 64 x 128", 64);
}

// A volume's slice: soft, and without repetitions.
SliceImage soft(Random& random) {
  SliceImage image{0, 0, 1, {0, 0, 256, 192}, std::vector<uint32_t>(256 * 192)};
  for (int y = 0; y < 192; ++y)
    for (int x = 0; x < 256; ++x) {
      const double f = std::sin(x * 0.031) * std::cos(y * 0.023) + 0.3 * std::sin(0.11 * (x + 2 * y));
      const double alpha = std::clamp(f, 0.0, 1.0) * 0.7;
      const auto channel = [&](double c) { return uint32_t(alpha * c * 255 + double(random() % 3) * alpha); };
      image.pixels[size_t(y) * 256 + size_t(x)] =
          uint32_t(alpha * 255) << 24 | channel(0.9) << 16 | channel(0.7) << 8 | channel(0.5);
    }
  return image;
}

TEST(SliceCodec, SoftImagesTakeAFractionAndNoiseGrowsLittle) {
  Random random(9);
  SliceImage image = soft(random);
  EXPECT_LT(encode_slice(image).size(), image.pixels.size() * 4 / 5);
  for (auto& p : image.pixels) p = uint32_t(random());
  EXPECT_LT(double(encode_slice(image).size()), 4.2 * double(image.pixels.size()));
}

TEST(SliceCodec, DamagedTablesAndBlocksAreRefusedOrGiveAnImage) {
  Random random(11);
  const auto bytes = encode_slice(soft(random));
  auto slices = parse_slices(bytes, 256, 192, 1);
  ASSERT_TRUE(slices.ok());
  EncodedSlice without = slices->front();
  without.tables = {};
  EXPECT_FALSE(decode_slice(without, 256, 192).ok()) << "blocks need tables";
  int refused = 0;
  for (int n = 0; n < 400; ++n) {
    auto bad = bytes;
    const size_t tables = bytes[8] | size_t{bytes[9]} << 8;
    bad[10 + random() % (n % 2 ? tables : bytes.size() - 10)] ^= uint8_t(1 + random() % 255);
    const auto parsed = parse_slices(bad, 256, 192, 1);
    if (!parsed.ok() || !decode_slice(parsed->front(), 256, 192).ok()) ++refused;
  }
  EXPECT_GT(refused, 300) << "states that do not come back to where they began tell nearly all damage";
}

TEST(SliceCodec, MutationsNeverDoHarm) {
  Random random(8);
  std::vector<uint8_t> bytes;
  for (int n = 0; n < 3; ++n) encode_slice(blobs({0, 0, 150, 90}, random, 1), bytes);
  int decoded = 0;
  for (int n = 0; n < 3000; ++n) {
    auto bad = bytes;
    for (int k = 0; k <= n % 4; ++k) bad[random() % (n % 2 ? 64 : bad.size())] = uint8_t(random());
    const auto slices = parse_slices(bad, 150, 90, 4);
    if (!slices.ok()) continue;
    for (const auto& s : *slices) {
      const auto image = decode_slice(s, 150, 90);
      if (!image.ok()) continue;
      ++decoded;
      EXPECT_LE(image->pixels.size(), size_t{150 * 90});
    }
  }
  EXPECT_GT(decoded, 100);
}

Grid a_grid() {
  Grid g{{60, 50, 40}, glm::dmat4(1)};
  g.index_to_room = glm::translate(glm::dmat4(1), glm::dvec3(-0.3, -0.2, -0.25));
  g.index_to_room = glm::rotate(g.index_to_room, 0.2, glm::dvec3(0.3, 1, 0.2));
  g.index_to_room = glm::scale(g.index_to_room, glm::dvec3(0.01, 0.009, 0.014));
  return g;
}

// A block may be seen if the warp puts any of its pixels into the widened picture; most other blocks are left out.
TEST(SliceView, IsConservativeAndUseful) {
  const Grid grid = a_grid();
  Random random(9);
  std::uniform_real_distribution<double> u(-1, 1);
  const double margin = 0.1;
  int seen = 0, left_out = 0, kept_in_vain = 0;
  for (int n = 0; n < 40; ++n) {
    glm::dvec3 from(u(random), u(random), u(random));
    if (glm::length(from) < 0.7) from *= 0.7 / glm::length(from);
    const auto look = [&](const glm::dvec3& eye, double fov, const glm::dvec3& to) {
      return geometry::make_camera(
          {eye, glm::quatLookAt(glm::normalize(to - eye), glm::normalize(glm::dvec3(0.1, 1, 0.05)))}, fov, 640, 480);
    };
    const auto wide = look(from, 80, grid.centre_room());
    const auto frame = plan_frame(grid, std::span(&wide, 1));
    ASSERT_TRUE(frame);
    // Another camera near by that sees a part of the frame.
    const auto camera = look(from + 0.05 * glm::dvec3(u(random), u(random), u(random)), 25,
                             grid.centre_room() + 0.2 * glm::dvec3(u(random), u(random), u(random)));
    const SliceView view(grid, *frame, camera, margin);
    for (int layer = 0; layer < int(frame->layers.size()); layer += 5) {
      const auto t = camera.room_to_pixel();
      for (int by = 0; by * kSliceBlock < frame->height; ++by)
        for (int bx = 0; bx * kSliceBlock < frame->width; ++bx) {
          bool truly = false;
          for (int y = by * kSliceBlock; y < std::min((by + 1) * kSliceBlock, frame->height) && !truly; y += 3)
            for (int x = bx * kSliceBlock; x < std::min((bx + 1) * kSliceBlock, frame->width) && !truly; x += 3) {
              const glm::dvec4 room =
                  grid.index_to_room *
                  glm::dvec4(frame->unproject(x + 0.5, y + 0.5, frame->layers[size_t(layer)].plane), 1);
              const double w = glm::dot(t.w, room);
              const double px = glm::dot(t.x, room) / w / camera.width, py = glm::dot(t.y, room) / w / camera.height;
              truly = w > 0 && px > -margin && py > -margin && px < 1 + margin && py < 1 + margin;
            }
          const bool may = view.may_see(layer, bx, by);
          seen += truly;
          EXPECT_TRUE(may || !truly) << "layer " << layer << ", block " << bx << ", " << by;
          left_out += !may;
          kept_in_vain += may && !truly;
        }
    }
  }
  EXPECT_GT(seen, 100);
  EXPECT_GT(left_out, 100);
  EXPECT_LT(kept_in_vain, left_out / 4);
}

}  // namespace
}  // namespace telesplat::volume
