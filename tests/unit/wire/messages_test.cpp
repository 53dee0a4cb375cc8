// Every message: round trips, refusals of everything that is not one, bytes that must not change unnoticed.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

#include "tests/support/wire_samples.h"

namespace telesplat::wire {
namespace {

using namespace telesplat::test;

template <class M>
class EveryMessage : public ::testing::Test {};
template <class T>
struct AsTypes;
template <class... M>
struct AsTypes<std::tuple<M...>> {
  using type = ::testing::Types<M...>;
};
TYPED_TEST_SUITE(EveryMessage, AsTypes<AllMessages>::type);

// Refused, with the message and `named` in the text.
template <class M>
::testing::AssertionResult refused(const std::string& body, const std::string& named = "") {
  const auto result = decode<M>(bytes_of(body));
  if (result) return ::testing::AssertionFailure() << "was accepted";
  const std::string& text = result.error().text;
  if (text.find(M::kName) == std::string::npos || text.find(named) == std::string::npos)
    return ::testing::AssertionFailure() << "the text names neither " << M::kName << " nor " << named << ": " << text;
  return ::testing::AssertionSuccess();
}

TYPED_TEST(EveryMessage, SurvivesTheRoundTrip) {
  const std::string body = encode(sample_message<TypeParam>());
  const auto decoded = decode<TypeParam>(bytes_of(body));
  ASSERT_TRUE(decoded) << decoded.error().text;
  EXPECT_EQ(encode(*decoded), body);
  EXPECT_NE(encode(TypeParam{}), body);
}

TYPED_TEST(EveryMessage, IsRefusedTruncatedAtEveryLength) {
  const std::string body = encode(sample_message<TypeParam>());
  for (size_t n = 0; n < body.size(); ++n)
    EXPECT_TRUE(refused<TypeParam>(body.substr(0, n))) << n << " of " << body.size() << " bytes";
}

TYPED_TEST(EveryMessage, IsRefusedWithBytesAfterIt) {
  const std::string body = encode(sample_message<TypeParam>());
  EXPECT_TRUE(refused<TypeParam>(body + '\0'));
  EXPECT_TRUE(refused<TypeParam>(body + body));
}

TYPED_TEST(EveryMessage, IsRefusedInAnotherVersion) {
  const std::string body = encode(sample_message<TypeParam>());
  EXPECT_TRUE(refused<TypeParam>(with_value(body, "v", "\x01"), "version 1"));
  EXPECT_TRUE(refused<TypeParam>(with_value(body, "v", std::string(1, '\0')), "version 0"));
  EXPECT_TRUE(refused<TypeParam>(with_value(body, "v", "\xff"), "version"));
  EXPECT_TRUE(refused<TypeParam>(with_value(body, "v",
                                            "\xa1"
                                            "1"),
                                 "version"));
}

TYPED_TEST(EveryMessage, NeedsEveryField) {
  const std::string body = encode(sample_message<TypeParam>());
  for (const Field& f : fields_of(body)) {
    std::string without = body;
    without[f.key + f.name.size()] = '#';  // the last letter of its name
    EXPECT_TRUE(refused<TypeParam>(without, f.name == "v" ? "version" : f.name));
  }
}

TYPED_TEST(EveryMessage, IgnoresFieldsItDoesNotKnow) {
  const std::string body = encode(sample_message<TypeParam>());
  const auto fields = fields_of(body);
  const std::string more =
      std::string("\xde\0", 2) + char(fields.size() + 1) + body.substr(fields[0].key) + "\xa3new\x93\x01\x02\xc0";
  EXPECT_TRUE(decode<TypeParam>(bytes_of(more)));
}

TYPED_TEST(EveryMessage, RefusesValuesOfOtherTypesAndClaimsOfHugeOnes) {
  const std::string body = encode(sample_message<TypeParam>());
  const std::string nothing = "\xc0", extension("\xd4\x05\x01", 3), infinite("\xcb\x7f\xf0\0\0\0\0\0\0", 9),
                    undefined("\xcb\x7f\xf8\0\0\0\0\0\0", 9), huge_list = "\xdd\xff\xff\xff\xff",
                    huge_map = "\xdf\xff\xff\xff\xff", huge_string = "\xdb\xff\xff\xff\xff",
                    huge_binary = "\xc6\xff\xff\xff\xff";
  for (const Field& f : fields_of(body))
    for (const auto& value : {nothing, extension, infinite, undefined, huge_list, huge_map, huge_string, huge_binary})
      EXPECT_TRUE(refused<TypeParam>(with_value(body, f.name, value))) << f.name;
}

TYPED_TEST(EveryMessage, IsRefusedWhenNested) {
  EXPECT_TRUE(refused<TypeParam>(std::string(100000, '\x91') + '\x01'));
  std::string deep = encode(sample_message<TypeParam>());
  deep = with_value(deep, fields_of(deep)[1].name, std::string(60, '\x91') + '\x01');
  EXPECT_TRUE(refused<TypeParam>(deep));
}

TYPED_TEST(EveryMessage, IsRefusedBeyondItsSize) {
  constexpr bool kHasBulk = requires(TypeParam m) { m.image; }
  || requires(TypeParam m) { m.data; }
  || requires(TypeParam m) { m.chunks; }
  || requires(TypeParam m) { m.clusters; }
  || requires(TypeParam m) { m.columns; };
  const size_t limit = kHasBulk ? kMaxBulkBytes + kMaxControlBytes : kMaxControlBytes;
  // The size is looked at before the bytes are, so that these need not be there.
  const auto result = decode<TypeParam>(Bytes(kBulk.data(), limit + 1));
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().text.find(std::to_string(limit)), std::string::npos) << result.error().text;
}

TEST(Messages, HaveNamesOfTheirOwn) {
  std::set<std::string_view> names;
  for_each_message([&]<class M>(M*) { EXPECT_TRUE(names.insert(M::kName).second) << M::kName; });
  EXPECT_EQ(names.size(), std::tuple_size_v<AllMessages>);
}

// A change of these bytes is a change of the protocol: raise kProtocolVersion, update docs/protocol.md, then these.
std::string hex(const std::string& bytes) {
  std::string out;
  for (unsigned char c : bytes) out += fmt::format("{:02x}", c);
  return out;
}
TEST(GoldenBytes, OfAMark) {
  EXPECT_EQ(hex(encode(StateMark{InstanceId{0x1234567890}, Sequence{300}, EpochId{1}, true, 70000})),
            "86a17603a67061636b6572cf0000001234567890a873657175656e6365cd012ca565706f636801a6616e73776572c3a6706f696e74"
            "73ce00011170");
}
TEST(GoldenBytes, OfALease) {
  EXPECT_EQ(hex(encode(sample_message<Lease>())),
            "8ea17603a56c65617365cf0000010000000001a56672616d65cf0000010000000002a565706f6368cf0000010000000003a67669"
            "65776572cf0000010000000004a772657175657374cf0000010000000005a474696c6505a47374657004a5626c6f636b03af626c"
            "6f636b735f696e5f6672616d6508a663616d6572619ecb3fb999999999999acb3fc999999999999acb3fd3333333333333cb3fe3"
            "33333333333300cb3fe999999999999a00ff01cbbfe0000000000000cb3fe8000000000000cb3f847ae147ae147bcd0140ccc8a4"
            "726563749440206432aa626c6f636b5f726563749440206432a86c65617365645f73cb4024800000000000");
}

// ---- limits of single fields -----------------------------------------------------------------------------------------------

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

// What tells which part of a frame it is: a lease's block, a patch's tile.
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
  Lease lease = sample_message<Lease>();
  lease.tile = kMaxTiles;
  EXPECT_TRUE(refused<Lease>(encode(lease), "tile 65536"));
  lease = sample_message<Lease>();
  lease.camera.width = lease.camera.height = geometry::kMaxImageSide;
  lease.rect = lease.block_rect = {0, 0, 4097, 4096};
  EXPECT_TRUE(refused<Lease>(encode(lease), "16777216"));
  lease = sample_message<Lease>();
  lease.block_rect = {64, 32, 100, 49};
  EXPECT_TRUE(refused<Lease>(encode(lease), "not inside its block"));
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
  EXPECT_TRUE(decode<ChunkList>(bytes_of(with({ChunkId{5}, box, 10, 400}))));
  EXPECT_TRUE(refused<ChunkList>(with({ChunkId{geometry::kMaxChunks + 1}, box, 10, 400}), "chunk"));
  EXPECT_TRUE(refused<ChunkList>(with({ChunkId{5}, box, geometry::kMaxChunkTriangles + 1, 400}), "chunk"));
  EXPECT_TRUE(refused<ChunkList>(with({ChunkId{5}, box, 10, kMaxBulkBytes + 1}), "chunk"));
  EXPECT_TRUE(refused<ChunkList>(with({ChunkId{5}, {{NAN, 0, 0}, {1, 1, 1}}, 10, 400}), "finite"));
}

TEST(Bulk, PointsIntoTheBody) {
  const std::string body = encode(sample_message<DepthTile>());
  const auto m = decode<DepthTile>(bytes_of(body));
  ASSERT_TRUE(m);
  EXPECT_GE(reinterpret_cast<const char*>(m->image.data()), body.data());
  EXPECT_LE(reinterpret_cast<const char*>(m->image.data() + m->image.size()), body.data() + body.size());
  EXPECT_TRUE(std::equal(m->image.begin(), m->image.end(), kBulk.begin(), kBulk.end()));
}

}  // namespace
}  // namespace telesplat::wire
