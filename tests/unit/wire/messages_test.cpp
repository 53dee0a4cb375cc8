// Every message: round trips, refusals of all other bytes, bytes that must not change unnoticed.
#include <cxxabi.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <memory>
#include <set>

#include "tests/support/wire_samples.h"

namespace telesplat::wire {
namespace {

using namespace telesplat::test;

// Messages that may be larger than kMaxControlBytes.
constexpr std::string_view kBulkMessages[] = {
    "metric_rows", "chunk_list",   "chunk",       "depth_tile", "patch",  "forget",       "access_report",
    "voxel_data",  "slice_images", "slice_frame", "plan",       "refine", "picture_tile", "picture"};

// True for messages whose fields may be missing.
bool is_brief(const MessageSample& sample) { return sample.name == "patch"; }

size_t body_limit(const MessageSample& sample) {
  const bool bulk = std::ranges::find(kBulkMessages, sample.name) != std::end(kBulkMessages);
  return bulk ? kMaxBulkBytes + kMaxControlBytes : kMaxControlBytes;
}

// Success if decoding fails with an error that names the message and `named`.
::testing::AssertionResult refused(const MessageSample& sample, const std::string& body,
                                   const std::string& named = "") {
  const auto result = sample.round_trip(bytes_of(body));
  if (result) return ::testing::AssertionFailure() << "was accepted";
  const std::string& text = result.error().text;
  if (text.find(sample.name) == std::string::npos || text.find(named) == std::string::npos)
    return ::testing::AssertionFailure() << "the text names neither " << sample.name << " nor " << named << ": "
                                         << text;
  return ::testing::AssertionSuccess();
}

struct Property {
  const char* name;
  void (*check)(const MessageSample& sample);
};

constexpr Property kProperties[] = {
    {"SurvivesTheRoundTrip",
     [](const MessageSample& sample) {
       const std::string& body = sample.body;
       const auto decoded = sample.round_trip(bytes_of(body));
       ASSERT_TRUE(decoded) << decoded.error().text;
       EXPECT_EQ(*decoded, body);
       EXPECT_NE(sample.default_body, body);
     }},
    {"IsRefusedTruncatedAtEveryLength",
     [](const MessageSample& sample) {
       const std::string& body = sample.body;
       for (size_t n = 0; n < body.size(); ++n)
         EXPECT_TRUE(refused(sample, body.substr(0, n))) << n << " of " << body.size() << " bytes";
     }},
    {"IsRefusedWithBytesAfterIt",
     [](const MessageSample& sample) {
       const std::string& body = sample.body;
       EXPECT_TRUE(refused(sample, body + '\0'));
       EXPECT_TRUE(refused(sample, body + body));
     }},
    {"IsRefusedInAnotherVersion",
     [](const MessageSample& sample) {
       const std::string& body = sample.body;
       EXPECT_TRUE(refused(sample, with_value(body, "v", "\x01"), "version 1"));
       EXPECT_TRUE(refused(sample, with_value(body, "v", std::string(1, '\0')), "version 0"));
       EXPECT_TRUE(refused(sample, with_value(body, "v", "\xff"), "version"));
       EXPECT_TRUE(refused(sample,
                           with_value(body, "v",
                                      "\xa1"
                                      "1"),
                           "version"));
     }},
    {"NeedsEveryField",
     [](const MessageSample& sample) {
       const std::string& body = sample.body;
       for (const Field& f : fields_of(body)) {
         if (is_brief(sample) && f.name != "v") continue;
         std::string without = body;
         without[f.key + f.name.size()] = '#';  // the last letter of its name
         EXPECT_TRUE(refused(sample, without, f.name == "v" ? "version" : f.name));
       }
     }},
    {"IgnoresFieldsItDoesNotKnow",
     [](const MessageSample& sample) {
       const std::string& body = sample.body;
       const auto fields = fields_of(body);
       const std::string more =
           std::string("\xde\0", 2) + char(fields.size() + 1) + body.substr(fields[0].key) + "\xa3new\x93\x01\x02\xc0";
       EXPECT_TRUE(sample.round_trip(bytes_of(more)));
     }},
    {"RefusesValuesOfOtherTypesAndClaimsOfHugeOnes",
     [](const MessageSample& sample) {
       const std::string& body = sample.body;
       const std::string nothing = "\xc0", extension("\xd4\x05\x01", 3), infinite("\xcb\x7f\xf0\0\0\0\0\0\0", 9),
                         undefined("\xcb\x7f\xf8\0\0\0\0\0\0", 9), huge_list = "\xdd\xff\xff\xff\xff",
                         huge_map = "\xdf\xff\xff\xff\xff", huge_string = "\xdb\xff\xff\xff\xff",
                         huge_binary = "\xc6\xff\xff\xff\xff";
       for (const Field& f : fields_of(body))
         for (const auto& value :
              {nothing, extension, infinite, undefined, huge_list, huge_map, huge_string, huge_binary})
           EXPECT_TRUE(refused(sample, with_value(body, f.name, value))) << f.name;
     }},
    {"IsRefusedWithTextThatIsNotUtf8",
     [](const MessageSample& sample) {
       value_end(sample.body, 0, [&](std::string_view text) {
         // The only text of a brief message is "v".
         if (text.empty() || is_brief(sample)) return;
         std::string body = sample.body;
         body[size_t(text.data() - sample.body.data()) + text.size() - 1] = '\xff';
         EXPECT_TRUE(refused(sample, body)) << text;
       });
     }},
    {"IsRefusedWhenNested",
     [](const MessageSample& sample) {
       EXPECT_TRUE(refused(sample, std::string(100000, '\x91') + '\x01'));
       std::string deep = sample.body;
       deep = with_value(deep, fields_of(deep)[1].name, std::string(60, '\x91') + '\x01');
       EXPECT_TRUE(refused(sample, deep));
     }},
    {"IsRefusedBeyondItsSize",
     [](const MessageSample& sample) {
       const size_t limit = body_limit(sample);
       // The size is checked before the bytes, so the bytes need not be there.
       const auto result = sample.round_trip(Bytes(kBulk.data(), limit + 1));
       ASSERT_FALSE(result);
       EXPECT_NE(result.error().text.find(std::to_string(limit)), std::string::npos) << result.error().text;
     }},
};

// One test of each property for each message. Typed tests would say the same, but take the compiler ten seconds more.
class EveryMessage : public ::testing::Test {
 public:
  EveryMessage(const MessageSample& sample, const Property& property) : sample_(sample), property_(property) {}
  void TestBody() override { property_.check(sample_); }

 private:
  const MessageSample& sample_;
  const Property& property_;
};

std::string type_name(const std::type_info& type) {
  const std::unique_ptr<char, decltype(&std::free)> name(abi::__cxa_demangle(type.name(), nullptr, nullptr, nullptr),
                                                         &std::free);
  return name ? name.get() : type.name();
}

[[maybe_unused]] const bool kRegistered = [] {
  for (size_t i = 0; i < message_samples().size(); ++i)
    for (const Property& property : kProperties) {
      const MessageSample& sample = message_samples()[i];
      ::testing::RegisterTest(fmt::format("EveryMessage/{}", i).c_str(), property.name, type_name(sample.type).c_str(),
                              nullptr, __FILE__, __LINE__,
                              [&]() -> ::testing::Test* { return new EveryMessage(sample, property); });
    }
  return true;
}();

TEST(Messages, HaveNamesOfTheirOwn) {
  std::set<std::string_view> names;
  for (const MessageSample& sample : message_samples()) EXPECT_TRUE(names.insert(sample.name).second) << sample.name;
  EXPECT_EQ(names.size(), std::tuple_size_v<Messages>);
}

// A change of these bytes is a change of the protocol: raise kProtocolVersion, update docs/protocol.md, then these.
std::string hex(const std::string& bytes) {
  std::string out;
  for (unsigned char c : bytes) out += fmt::format("{:02x}", c);
  return out;
}
// Seeds of an older version would all be refused at their first field. A seed's first byte is its message's number.
TEST(WireFuzzer, HasASeedOfThisVersionForEachMessage) {
  for (size_t i = 0; i < message_samples().size(); ++i) {
    const MessageSample& sample = message_samples()[i];
    std::ifstream file("tests/fuzz/corpus/wire/" + std::string(sample.name), std::ios::binary);
    const std::string seed{std::istreambuf_iterator<char>(file), {}};
    ASSERT_FALSE(seed.empty()) << sample.name;
    EXPECT_EQ(static_cast<uint8_t>(seed[0]), i) << sample.name;
    const auto back = sample.round_trip(std::as_bytes(std::span(seed).subspan(1)));
    EXPECT_TRUE(back) << sample.name << ": " << back.error().text;
  }
}

TEST(GoldenBytes, OfAMark) {
  EXPECT_EQ(hex(encode(StateMark{InstanceId{0x1234567890}, Sequence{300}, EpochId{1}, true, 70000, 5})),
            "87a17615a67061636b6572cf0000001234567890a873657175656e6365cd012ca565706f636801a6616e73776572c3a6706f696e"
            "7473ce00011170a664696765737405");
}
TEST(GoldenBytes, OfALease) {
  EXPECT_EQ(hex(encode(sample_message<Lease>())),
            "de0014a17615a56c65617365cf0000010000000001a56672616d65cf0000010000000002a565706f6368cf0000010000000003a6"
            "766965776572cf0000010000000004a772657175657374cf0000010000000005a474696c6505a47374657004a5626c6f636b03af"
            "626c6f636b735f696e5f6672616d6508a663616d6572619ecb3fb999999999999acb3fc999999999999acb3fd3333333333333cb"
            "3fe333333333333300cb3fe999999999999a00ff01cabf000000ca3f400000cb3f847ae147ae147bcd0140ccc8a4726563749440"
            "206432aa626c6f636b5f726563749440206432a56578747261c3a472617973cd03f2a46d61736bc40c0100000002000000ffffff"
            "ffa9666f6f747072696e74cb3f4999999999999aa76d6f6d656e74739ece00bebc20ce000f4240ce000f4240ce000f4240ce000f"
            "4240ce000f4240ce011a49a0ce001e8480ce000f4240ce000f4240ce000f4240ce000f4240ce000f4240ce000f4240a66d617374"
            "6572cf000001000000001aa47365616cc40c0100000002000000ffffffff");
}

// Version, packer, sequence, tiles_in_frame, image.
TEST(GoldenBytes, OfAPatch) {
  EXPECT_EQ(hex(encode(Patch{.packer = InstanceId{5}, .sequence = Sequence{300}, .tiles_in_frame = 1})),
            "85a17615000501cd012c070110c400");
}

TEST(BriefMessages, HaveNumbersForTheNamesOfTheirFields) {
  const auto back = decode<Patch>(bytes_of("\x83\xa1v\x15\x07\x09\x0b\x02"));
  ASSERT_TRUE(back) << back.error().text;
  EXPECT_EQ(back->tiles_in_frame, 9u);
  EXPECT_EQ(back->left_out, 2u);
  const auto named = decode<Patch>(bytes_of("\x83\xa1v\x15\x07\x09\xa8left_out\x02"));
  ASSERT_TRUE(named) << "a field that nobody knows";
  EXPECT_EQ(named->left_out, 0u);
  const auto wrong = decode<Patch>(bytes_of("\x82\xa1v\x15\x0b\xc0"));
  ASSERT_FALSE(wrong);
  EXPECT_NE(wrong.error().text.find("left_out"), std::string::npos) << wrong.error().text;
}

TEST(BriefMessages, AreWithoutWhatANewOneHolds) {
  const Patch fresh;
  EXPECT_LE(encode(fresh).size(), 12u) << "nothing but the version and the image";
  const auto back = decode<Patch>(bytes_of(encode(Patch{.tiles_in_frame = 1})));
  ASSERT_TRUE(back) << back.error().text;
  EXPECT_EQ(back->step, 1u);
  EXPECT_EQ(back->missed.rect, fresh.missed.rect);
  EXPECT_EQ(back->tiles_in_frame, 1u);

  // A patch as sessions send it, with an image of a few hundred bytes.
  Patch patch{.packer = InstanceId{0x1fffffffffffff},
              .sequence = Sequence{100000},
              .epoch = EpochId{1},
              .frame = FrameId{3000},
              .viewer = InstanceId{0x1ffffffffffffe},
              .request = RequestId{3000},
              .tile = 2,
              .tiles_in_frame = 4,
              .counts = {900, 800}};
  patch.camera.pose.position_room = {0.1f, 0.2f, 0.3f};
  patch.camera.pose.orientation = {0.6f, 0.1f, 0.78740078f, 0.1f};
  patch.rect = {256, 128, 256, 200};
  double t_s = 1000.123456;
  for (double Moments::*moment : kMoments) patch.moments.*moment = t_s += 0.0123457;
  patch.moments.fetch_s = 0;
  EXPECT_LE(encode(patch).size(), 200u);
}

TEST(Numbers, AreAsShortAsTheyCanBeAndExact) {
  const auto sent = [](double v) {
    ViewRequest m = sample_message<ViewRequest>();
    m.camera.pose.position_room.x = v;
    const std::string body = encode(m);
    const auto back = decode<ViewRequest>(bytes_of(body));
    EXPECT_TRUE(back);
    const double got = back ? back->camera.pose.position_room.x : NAN;
    EXPECT_EQ(got, v);
    return body.size();
  };
  const size_t integer = sent(1);
  EXPECT_EQ(sent(-0.0), integer);
  EXPECT_EQ(sent(0.5), integer + 4);
  EXPECT_EQ(sent(-1e-30f), integer + 4);
  EXPECT_EQ(sent(0.1), integer + 8);
  EXPECT_EQ(sent(1e-300), integer + 8);
  EXPECT_EQ(sent(1000), integer + 2);
}

TEST(Numbers, OfMomentsAreMicroseconds) {
  FrameEnd m = sample_message<FrameEnd>();
  m.moments = {};
  m.moments.requested_s = 86400.1234567;
  m.moments.received_s = 86400.1;  // earlier than requested_s: clocks differ
  m.moments.fetch_s = 0.25;
  m.moments.published_s = 86401;
  const auto back = decode<FrameEnd>(bytes_of(encode(m)));
  ASSERT_TRUE(back) << back.error().text;
  EXPECT_NEAR(back->moments.requested_s, m.moments.requested_s, 0.51e-6);
  EXPECT_NEAR(back->moments.received_s, m.moments.received_s, 0.51e-6);
  EXPECT_DOUBLE_EQ(back->moments.fetch_s, 0.25);
  EXPECT_NEAR(back->moments.published_s, 86401, 0.51e-6);
  EXPECT_EQ(back->moments.leased_s, 0);

  // Encoding drops moments beyond any clock; decoding refuses them.
  for (const double bad : {1e300, -1e300, double(NAN), HUGE_VAL}) {
    m.moments.requested_s = bad;
    const auto without = decode<FrameEnd>(bytes_of(encode(m)));
    ASSERT_TRUE(without);
    EXPECT_EQ(without->moments.requested_s, 0);
  }
  const std::string nine = std::string(12, '\xc0') + std::string("\xcf\x7f\xff\xff\xff\xff\xff\xff\xff", 9);
  const auto refused_moments = [&](const std::string& value) {
    const auto got = decode<FrameEnd>(bytes_of(with_value(encode(m), "moments", value)));
    return !got && got.error().text.find("moments") != std::string::npos;
  };
  EXPECT_TRUE(refused_moments("\x9e" + nine + "\x01"));
  EXPECT_TRUE(refused_moments("\x9d" + nine));
  EXPECT_TRUE(refused_moments("\x9e" + std::string(13, '\xc0') + "\xa1x"));
  const std::string far("\xcf\0\x03\xff\xff\xff\xff\xff\xff", 9);
  EXPECT_TRUE(refused_moments("\x9e" + far + far + std::string(12, '\xc0')));
}

TEST(BriefMessages, HaveMomentsInTwoBytesOrOne) {
  Patch m{.tiles_in_frame = 1};
  double t_s = 1000.123456;
  for (double Moments::*moment : kMoments) m.moments.*moment = t_s += 0.001234;
  m.moments.begun_s = 0, m.moments.fetch_s = 0.25, m.moments.sample_end_s -= 0.005;
  const std::string body = encode(m);
  EXPECT_LE(body.size(), encode(Patch{.tiles_in_frame = 1}).size() + 40);
  const auto back = decode<Patch>(bytes_of(body));
  ASSERT_TRUE(back) << back.error().text;
  for (const double Moments::*moment : kMoments) EXPECT_NEAR(back->moments.*moment, m.moments.*moment, 0.51e-6);
  EXPECT_EQ(back->moments.begun_s, 0);

  const auto moments = [&](const std::string& bytes) {
    return decode<Patch>(bytes_of("\x83\xa1v\x15\x07\x01\x13\xc4" + std::string(1, char(bytes.size())) + bytes));
  };
  const auto refused = [&](const std::string& bytes) {
    const auto got = moments(bytes);
    return !got && got.error().text.find("moments") != std::string::npos;
  };
  const std::string none(14, '\0'), most("\x81\x80\x80\x80\x80\x80\x80\x04", 8);  // 2^50 and 1
  EXPECT_TRUE(moments(none));
  EXPECT_TRUE(moments(most + none.substr(1)));
  EXPECT_TRUE(refused(none.substr(1)));
  EXPECT_TRUE(refused(none + '\0'));
  EXPECT_TRUE(refused(most + most + none.substr(2))) << "twice 35 years";
  EXPECT_TRUE(refused(std::string(9, '\xff') + none.substr(1)));
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
