// Limits of decoding: fields beyond their limits, and fields that do not go together.
#include <gtest/gtest.h>

#include <bit>

#include <cmath>
#include <limits>
#include <tuple>

#include "tests/support/wire_samples.h"

namespace telesplat::wire {
namespace {

using namespace std::string_literals;
using namespace telesplat::test;

// Success if decoding fails with an error that names the message and `named`.
template <class M>
::testing::AssertionResult refused(const std::string& body, const std::string& named = "") {
  const auto result = decode<M>(bytes_of(body));
  if (result) return ::testing::AssertionFailure() << "was accepted";
  const std::string& text = result.error().text;
  if (text.find(M::kName) == std::string::npos || text.find(named) == std::string::npos)
    return ::testing::AssertionFailure() << "the text names neither " << M::kName << " nor " << named << ": " << text;
  return ::testing::AssertionSuccess();
}

TEST(Limits, OfStringsListsAndMaps) {
  Hello hello = sample_message<Hello>();
  hello.name = std::string(kMaxString, 'n');
  EXPECT_TRUE(decode<Hello>(bytes_of(encode(hello))));
  hello.name += 'n';
  EXPECT_TRUE(refused<Hello>(encode(hello), "name"));

  hello = sample_message<Hello>();
  hello.facts["transfer"] = std::string(kMaxFact, '0');  // longer than other strings
  EXPECT_TRUE(decode<Hello>(bytes_of(encode(hello))));
  hello.facts["transfer"] += '0';
  EXPECT_TRUE(refused<Hello>(encode(hello), "facts"));
  hello.facts = {{std::string(kMaxString + 1, 'k'), "v"}};
  EXPECT_TRUE(refused<Hello>(encode(hello), "facts"));

  StatusReport status = sample_message<StatusReport>();
  status.values.clear();
  for (size_t i = 0; i < kMaxEntries; ++i) status.values["k" + std::to_string(i)] = 1;
  EXPECT_TRUE(decode<StatusReport>(bytes_of(encode(status))));
  status.values["one more"] = 1;
  EXPECT_TRUE(refused<StatusReport>(encode(status)));

  MetricRows rows = sample_message<MetricRows>();
  rows.columns.assign(kMaxEntries + 1, "c");
  EXPECT_TRUE(refused<MetricRows>(encode(rows), "columns"));

  ControlReply reply{true, std::string(kMaxString * 2, 'x')};  // a status answer is longer than other strings
  EXPECT_TRUE(decode<ControlReply>(bytes_of(encode(reply))));
}

// Numbers of a wall's frames stay far below the value at which they would wrap.
TEST(Limits, OfFramesOfAWall) {
  for (uint64_t SwapReady::*number : {&SwapReady::frame, &SwapReady::presented}) {
    SwapReady ready = sample_message<SwapReady>();
    ready.*number = uint64_t{1} << 53;
    EXPECT_TRUE(decode<SwapReady>(bytes_of(encode(ready))));
    ++(ready.*number);
    EXPECT_TRUE(refused<SwapReady>(encode(ready), "frame"));
  }
}

// Texts go into JSON, CSV and logs: only valid UTF-8 is accepted.
TEST(Limits, OfTexts) {
  // Bytes that our senders never send: in the encoded message `good` becomes `bad`, which is as long.
  const auto with = [](auto message, auto change, const std::string& good = {}, const std::string& bad = {}) {
    change(message);
    std::string body = encode(message);
    const size_t at = body.find(good);
    EXPECT_NE(at, body.npos);
    return body.replace(at, good.size(), bad);
  };
  const Hello hello = sample_message<Hello>();
  EXPECT_TRUE(decode<Hello>(bytes_of(with(hello, [](Hello& m) { m.name = "caf\xc3\xa9 \xe2\x82\xac"; }))));
  EXPECT_TRUE(refused<Hello>(with(
                                 hello, [](Hello& m) { m.name = "n=@"; }, "n=@", "n=\xff"),
                             "field name is not UTF-8"));
  EXPECT_TRUE(refused<Hello>(with(
                                 hello, [](Hello& m) { m.role = "caf@"; }, "caf@", "caf\xe9"),
                             "field role is not UTF-8"));
  EXPECT_TRUE(refused<Hello>(with(
                                 hello,
                                 [](Hello& m) {
                                   m.facts = {{"f=@", ""}};
                                 },
                                 "f=@", "f=\xff"),
                             "field facts is not UTF-8"));
  EXPECT_TRUE(refused<Hello>(with(
                                 hello,
                                 [](Hello& m) {
                                   m.facts = {{"scene", "caf@.ply"}};
                                 },
                                 "caf@.ply", "caf\xe9.ply"),
                             "field facts is not UTF-8"));
  EXPECT_TRUE(refused<Hello>(with(
                                 hello,
                                 [](Hello& m) {
                                   m.parameters = {{"p=@@", 1}};
                                 },
                                 "p=@@", "p=\xc0\x80"),
                             "field parameters is not UTF-8"));
  EXPECT_TRUE(refused<StatusReport>(
      with(
          sample_message<StatusReport>(), [](StatusReport& m) { m.values["v=@@@"] = 1; }, "v=@@@", "v=\xed\xa0\x80"),
      "field values is not UTF-8"));
  EXPECT_TRUE(refused<MetricRows>(with(
                                      sample_message<MetricRows>(),
                                      [](MetricRows& m) {
                                        m.columns = {"good", "c=@"};
                                      },
                                      "c=@", "c=\xff"),
                                  "field columns is not UTF-8"));
  EXPECT_TRUE(
      refused<SlabAssignment>(with(
                                  sample_message<SlabAssignment>(),
                                  [](SlabAssignment& m) { m.sheet[1].endpoint = "tcp://@"; }, "tcp://@", "tcp://\xff"),
                              "field sheet : field endpoint is not UTF-8"));
}

// A file, a folder or a machine's name may be any bytes: no process is refused for it.
TEST(Texts, AreUtf8HoweverTheyWereGiven) {
  Hello hello = sample_message<Hello>();
  hello.name = "caf\xe9";
  hello.endpoints = {{"patches", "ipc:///tmp/\xff"}};
  hello.facts = {{"sc\xff", "\xff"}};
  hello.parameters = {{"\xff", 2}};
  const auto taken = decode<Hello>(bytes_of(encode(hello)));
  ASSERT_TRUE(taken) << taken.error().text;
  EXPECT_EQ(taken->name, "caf\xef\xbf\xbd");
  EXPECT_EQ(taken->endpoints.at("patches"), "ipc:///tmp/\xef\xbf\xbd");
  EXPECT_EQ(taken->facts.at("sc\xef\xbf\xbd"), "\xef\xbf\xbd");
  EXPECT_EQ(taken->parameters.at("\xef\xbf\xbd"), 2);

  Welcome welcome = sample_message<Welcome>();
  welcome.facts["run_folder"] = "/runs/caf\xe9";
  EXPECT_TRUE(decode<Welcome>(bytes_of(encode(welcome))));
  ViewRequest request = sample_message<ViewRequest>();
  request.wall = "mur \xe9.toml x1";
  EXPECT_TRUE(decode<ViewRequest>(bytes_of(encode(request))));
  Control control{"clip", {{"\xe9", "\xff"}}};
  EXPECT_TRUE(decode<Control>(bytes_of(encode(control))));

  // U+FFFD takes three bytes: a text within its limit stays there, and is cut between characters.
  for (const size_t size : {kMaxString, kMaxString - 1, kMaxString - 2}) {
    hello.name = std::string(size - 1, 'n') + "\xff";
    const auto cut = decode<Hello>(bytes_of(encode(hello)));
    ASSERT_TRUE(cut) << cut.error().text;
    EXPECT_TRUE(cut->name.starts_with(std::string(size - 1, 'n')));
    EXPECT_EQ(cut->name.size(), size - 1 + (size == kMaxString - 2 ? 3 : 0));
  }
  hello.facts = {{"transfer", std::string(kMaxFact, '\xff')}};
  EXPECT_TRUE(decode<Hello>(bytes_of(encode(hello))));
}

// An element takes a byte in a message and 24 of memory, also in unknown fields.
TEST(Limits, OfElementsInAll) {
  const auto with = [](const std::string& value) {
    std::string body = encode(sample_message<Control>());
    EXPECT_LT(static_cast<unsigned char>(body[0]), 0x8f);
    ++body[0];  // one field more
    return body + "\xa7unknown" + value;
  };
  const auto nils = [](size_t count) {
    const auto byte = [&](int shift) { return char(count >> shift & 0xff); };
    return std::string{'\xdd', byte(24), byte(16), byte(8), byte(0)} + std::string(count, '\xc0');
  };
  EXPECT_TRUE(decode<Control>(bytes_of(with(nils(60000)))));
  std::string lists = "\x9f";  // 15 lists, each within the limit of one
  for (int i = 0; i < 15; ++i) lists += nils(60000);
  EXPECT_TRUE(refused<Control>(with(lists), "has more than 65536 elements"));
  EXPECT_TRUE(refused<Control>(with(std::string(200000, '\x91') + "\xc0")));
  ChunkList most{EpochId{1}, {}};
  for (size_t i = 0; i < geometry::kMaxChunks; ++i)
    most.chunks.push_back({ChunkId{i}, {{0, 0, 0}, {1, 1, 1}}, 10, 400});
  EXPECT_TRUE(decode<ChunkList>(bytes_of(encode(most))));
}

TEST(Limits, OfKeysAndNumbersInBinary) {
  Forget forget = sample_message<Forget>();
  forget.clusters.assign(kMaxKeys, 7);
  forget.frames.clear();
  EXPECT_TRUE(decode<Forget>(bytes_of(encode(forget))));
  forget.clusters.push_back(7);
  EXPECT_TRUE(refused<Forget>(encode(forget), "clusters"));
  EXPECT_TRUE(refused<Forget>(with_value(encode(sample_message<Forget>()), "clusters",
                                         std::string("\xc4\x03"
                                                     "abc")),
                              "multiple of 4"));
  EXPECT_TRUE(refused<MetricRows>(with_value(encode(sample_message<MetricRows>()), "values",
                                             std::string("\xc4\x07"
                                                         "abcdefg")),
                                  "multiple of 8"));
}

TEST(Limits, OfCameras) {
  const auto refused_camera = [](auto change, const char* named) {
    ViewRequest m = sample_message<ViewRequest>();
    change(m.camera);
    return refused<ViewRequest>(encode(m), named);
  };
  using C = geometry::Camera;
  EXPECT_TRUE(refused_camera([](C& c) { c.width = 0; }, "camera"));
  EXPECT_TRUE(refused_camera([](C& c) { c.height = geometry::kMaxImageSide + 1; },
                             std::to_string(geometry::kMaxImageSide).c_str()));
  EXPECT_TRUE(refused_camera([](C& c) { c.left = c.right; }, "frustum"));
  EXPECT_TRUE(refused_camera([](C& c) { c.near_m = 0; }, "near"));
  EXPECT_TRUE(refused_camera([](C& c) { c.pose.orientation = {0, 0, 0, 0}; }, "orientation"));
  EXPECT_TRUE(refused_camera([](C& c) { c.pose.position_room.x = 1e9; }, "position"));
  EXPECT_TRUE(
      refused_camera([](C& c) { c.pose.position_room.y = std::numeric_limits<double>::quiet_NaN(); }, "finite"));
  EXPECT_TRUE(refused_camera([](C& c) { c.top = std::numeric_limits<double>::infinity(); }, "finite"));
}

TEST(Limits, OfFootprints) {
  Lease lease = sample_message<Lease>();
  ViewRequest request = sample_message<ViewRequest>();
  for (const double good : {0.0, 1e-9, 1e9}) {
    lease.footprint = request.footprint = good;
    EXPECT_TRUE(decode<Lease>(bytes_of(encode(lease))));
    EXPECT_TRUE(decode<ViewRequest>(bytes_of(encode(request))));
  }
  for (const double bad : {-1e-9, double(std::numeric_limits<double>::quiet_NaN()), HUGE_VAL}) {
    lease.footprint = request.footprint = bad;
    EXPECT_TRUE(refused<Lease>(encode(lease), "footprint"));
    EXPECT_TRUE(refused<ViewRequest>(encode(request), "footprint"));
  }
}

// Number of the part of a frame: a lease's block, a patch's tile.
uint64_t& part(Lease& m) { return m.block; }
uint64_t& part(Patch& m) { return m.tile; }
uint64_t& parts(Lease& m) { return m.blocks_in_frame; }
uint64_t& parts(Patch& m) { return m.tiles_in_frame; }

template <class M>
void expect_tiles_checked() {
  const auto change = [](auto how) {
    M m = sample_message<M>();
    const auto with_block = [&](auto& part) {
      if constexpr (requires { part.block_rect; }) part.block_rect = {0, 0, 320, 200};
      how(part);
    };
    if constexpr (requires { m.lease.rect; })
      with_block(m.lease);
    else
      with_block(m);
    return encode(m);
  };
  EXPECT_TRUE(decode<M>(bytes_of(change([](auto& m) { m.rect = {0, 0, 320, 200}; }))));
  EXPECT_TRUE(refused<M>(change([](auto& m) { m.rect = {1, 0, 320, 200}; }), "320x200"));
  EXPECT_TRUE(refused<M>(change([](auto& m) { m.rect = {0, 150, 10, 51}; }), "frame"));
  EXPECT_TRUE(refused<M>(change([](auto& m) { m.rect = {0, 0, 0, 10}; }), "rect"));
  EXPECT_TRUE(refused<M>(change([](auto& m) { m.rect = {-1, 0, 10, 10}; }), "rect"));
  EXPECT_TRUE(refused<M>(change([](auto& m) { m.rect = {2147483647, 0, 2147483647, 10}; }), "rect"));
  EXPECT_TRUE(refused<M>(change([](auto& m) { part(m) = 8; }), "tile 8 of 8"));
  EXPECT_TRUE(refused<M>(change([](auto& m) { parts(m) = 0; }), "of 0"));
  EXPECT_TRUE(refused<M>(change([](auto& m) { parts(m) = kMaxTiles + 1; }), "65536"));
  EXPECT_TRUE(refused<M>(change([](auto& m) { m.step = 0; }), "step 0"));
  EXPECT_TRUE(refused<M>(change([](auto& m) { m.step = kMaxStep + 1; }), "step 17"));
}
TEST(Limits, OfTiles) {
  expect_tiles_checked<Lease>();
  expect_tiles_checked<DepthTile>();
  expect_tiles_checked<Patch>();
  Patch patch = sample_message<Patch>();
  patch.missed.rect = {316, 0, 5, 5};
  EXPECT_TRUE(refused<Patch>(encode(patch), "frame"));
  patch.camera.width = patch.camera.height = 8192;
  patch.missed.rect = {0, 0, 8192, 512};
  EXPECT_TRUE(decode<Patch>(bytes_of(encode(patch))));
  patch.missed.rect = {0, 0, 8192, 513};
  EXPECT_TRUE(refused<Patch>(encode(patch), "pixels"));
  Lease lease = sample_message<Lease>();
  lease.tile = kMaxTiles;
  EXPECT_TRUE(refused<Lease>(encode(lease), "tile 65536"));
  lease = sample_message<Lease>();
  lease.camera.width = lease.camera.height = geometry::kMaxImageSide;
  lease.rect = lease.block_rect = {0, 0, 2048, 2048};
  EXPECT_TRUE(decode<Lease>(bytes_of(encode(lease))));
  lease.rect = lease.block_rect = {0, 0, 2049, 2048};
  EXPECT_TRUE(refused<Lease>(encode(lease), "4194304"));
  lease = sample_message<Lease>();
  lease.block_rect = {64, 32, 100, 49};
  EXPECT_TRUE(refused<Lease>(encode(lease), "not inside its block"));
}

TEST(Limits, OfMasks) {
  Lease lease = sample_message<Lease>();
  lease.rays = 5000;  // in 100 x 50 pixels
  EXPECT_TRUE(decode<Lease>(bytes_of(encode(lease))));
  lease.rays = 5001;
  EXPECT_TRUE(refused<Lease>(encode(lease), "5001 rays of 100x50 pixels"));
  lease = sample_message<Lease>();
  lease.mask.assign(kMaxMaskWords, 1);
  EXPECT_TRUE(decode<Lease>(bytes_of(encode(lease))));
  lease.mask.push_back(1);
  EXPECT_TRUE(refused<Lease>(encode(lease), "mask"));
  PlanRequest request = sample_message<PlanRequest>();
  for (const auto& [size, good] : {std::pair{32, true}, {2048, true}, {31, false}, {2049, false}, {0, false}}) {
    request.tile_size = uint64_t(size);
    EXPECT_EQ(bool(decode<PlanRequest>(bytes_of(encode(request)))), good) << size;
  }
}

TEST(Limits, OfPlans) {
  const auto plan = [](std::vector<uint32_t> tiles, size_t words) {
    Plan m = sample_message<Plan>();  // 320 x 200 pixels
    m.tiles = std::move(tiles);
    m.masks.assign(words, 7);
    return encode(m);
  };
  EXPECT_TRUE(decode<Plan>(bytes_of(plan({}, 0))));
  EXPECT_TRUE(decode<Plan>(bytes_of(plan({0, 0, 320, 200, 64000, 0}, 0))));
  EXPECT_TRUE(decode<Plan>(bytes_of(plan({0, 0, 320, 100, 3, 2, 0, 100, 320, 100, 32000, 1}, 3))));
  EXPECT_TRUE(refused<Plan>(plan({0, 0, 320, 200, 64000}, 0), "5 numbers"));
  EXPECT_TRUE(refused<Plan>(plan({1, 0, 320, 200, 64000, 0}, 0), "tile 320x200+1+0 is not inside its 320x200 frame"));
  EXPECT_TRUE(refused<Plan>(plan({0xffffffff, 0, 2, 1, 2, 0}, 0), "not inside"));
  EXPECT_TRUE(refused<Plan>(plan({0, 0xffffffff, 1, 0xffffffff, 2, 1}, 1), "not inside"));
  EXPECT_TRUE(refused<Plan>(plan({0, 0, 0, 8, 0, 1}, 1), "not inside"));
  EXPECT_TRUE(refused<Plan>(plan({0, 0, 8, 8, 0, 1}, 1), "0 rays"));
  EXPECT_TRUE(refused<Plan>(plan({0, 0, 8, 8, 65, 1}, 1), "65 rays"));
  EXPECT_TRUE(refused<Plan>(plan({0, 0, 8, 8, 63, 0}, 0), "63 rays and 0 words"));  // which of the 64 pixels?
  EXPECT_TRUE(refused<Plan>(plan({0, 0, 8, 8, 3, 2}, 1), "1 words of masks, its tiles have 2"));
  EXPECT_TRUE(refused<Plan>(plan({0, 0, 8, 8, 3, 2}, 3), "3 words of masks, its tiles have 2"));
  EXPECT_TRUE(refused<Plan>(plan({0, 0, 8, 8, 3, kMaxMaskWords + 1}, kMaxMaskWords + 1), "words of mask"));
  // Repeated pixels would be more work than the frame.
  EXPECT_TRUE(refused<Plan>(plan({0, 0, 320, 200, 64000, 0, 0, 0, 1, 1, 1, 0}, 0), "64001 pixels, the frame 64000"));
  EXPECT_TRUE(refused<Plan>(plan({}, kMaxPlanWords + 1), "masks"));
  EXPECT_TRUE(refused<Plan>(plan(std::vector<uint32_t>(kPlanNumbers * kMaxTiles + 1), 0), "tiles"));
}

template <class M>
void expect_frames_checked() {
  M m = sample_message<M>();
  m.frames.clear();
  EXPECT_TRUE(decode<M>(bytes_of(encode(m))));
  m.frames.resize(m.clusters.size() - 1);
  EXPECT_TRUE(refused<M>(encode(m), "2 frames for 3 clusters"));
}
TEST(Limits, OfFramesOfClusters) {
  expect_frames_checked<Forget>();
  expect_frames_checked<AccessReport>();
}

TEST(Limits, OfChunkLists) {
  const auto with = [](geometry::ChunkInfo info) {
    ChunkList m{EpochId{1}, {info}};
    return encode(m);
  };
  const geometry::Box box{{0, 0, 0}, {1, 1, 1}};
  EXPECT_TRUE(decode<ChunkList>(bytes_of(with({ChunkId{0}, box, 10, 400}))));
  // 3.45e38 is a double, but beyond float's range.
  std::string list = "\x91\x9c\x00\x0a\x64"s;
  for (const double x : {0.0, 0.0, 0.0, 1.0, 3.45e38, 1.0}) {
    list += '\xcb';
    for (int shift = 56; shift >= 0; shift -= 8) list += static_cast<char>(std::bit_cast<uint64_t>(x) >> shift);
  }
  list += "\x00\x00\x00"s;
  EXPECT_TRUE(refused<ChunkList>(with_value(encode(sample_message<ChunkList>()), "chunks", list), "single precision"));
  EXPECT_TRUE(refused<ChunkList>(with({ChunkId{1}, box, 10, 400}), "id"));
  EXPECT_TRUE(refused<ChunkList>(with({ChunkId{0}, box, geometry::kMaxChunkTriangles + 1, 400}), "chunk"));
  EXPECT_TRUE(refused<ChunkList>(with({ChunkId{0}, box, 10, kMaxBulkBytes + 1}), "chunk"));
  EXPECT_TRUE(refused<ChunkList>(with({ChunkId{0}, {{NAN, 0, 0}, {1, 1, 1}}, 10, 400}), "finite"));
}

// A list that is no tree could keep a sampler busy for ever.
TEST(Limits, OfTreesOfChunks) {
  const geometry::Box box{{0, 0, 0}, {1, 1, 1}};
  const auto list = [&](const std::vector<std::tuple<float, uint32_t, uint32_t>>& nodes) {
    ChunkList m{EpochId{1}, {}};
    for (const auto& [spacing_m, first_child, children] : nodes)
      m.chunks.push_back({ChunkId{m.chunks.size()}, box, 10, 400, spacing_m, first_child, children});
    return encode(m);
  };
  EXPECT_TRUE(decode<ChunkList>(bytes_of(list({{0, 0, 0}, {0, 0, 0}, {1, 0, 2}, {2, 2, 1}}))));
  for (const auto& wrong : {list({{1, 0, 1}}), list({{0, 0, 0}, {1, 0, 2}}), list({{0, 0, 0}, {1, 0, 1}, {1, 0, 1}}),
                            list({{0, 0, 0}, {0, 0, 0}, {1, 1, 1}, {1, 0, 1}}), list({{0, 0, 0}, {0, 0, 1}}),
                            list({{0, 0, 0}, {1, 0, 0}}), list({{0, 0, 0}, {-1, 0, 1}})})
    EXPECT_TRUE(refused<ChunkList>(wrong, "no node of a tree"));
}

}  // namespace
}  // namespace telesplat::wire
