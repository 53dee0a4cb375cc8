// Processes of another version get an explanation in a message that they can read.
#include <gtest/gtest.h>

#include "common/wire/serial.h"

namespace telesplat::wire {
namespace {

Bytes bytes_of(const std::string& body) { return std::as_bytes(std::span(body)); }

// {"role": "viewer", "v": VERSION}; version: its msgpack bytes.
std::string body_of_version(const std::string& version) { return "\x82\xa4role\xa6viewer\xa1v" + version; }

TEST(OtherVersion, IsFoundInAnyMapThatHasOne) {
  EXPECT_EQ(other_version(bytes_of(body_of_version("\x0d"))), 13);
  EXPECT_EQ(other_version(bytes_of(body_of_version(std::string("\xce\x80\0\0\0", 5)))), 1u << 31);
  EXPECT_FALSE(other_version(bytes_of(body_of_version({char(kProtocolVersion)}))));
  EXPECT_FALSE(other_version(bytes_of(encode(Hello{}))));
  for (const std::string& bad :
       {std::string(), std::string("\x80", 1), std::string("let me in"), std::string(3, '\xff'),
        body_of_version("\x0d").substr(0, 6), body_of_version("\xa1x")})
    EXPECT_FALSE(other_version(bytes_of(bad)));
}

// The same bytes as this version writes, except the version number.
TEST(OtherVersion, AnswersAreWrittenAsThatVersionWritesThem) {
  const Shutdown shutdown{about_versions(13)};
  std::string as_ours = encode(shutdown), theirs = encode_for(13, shutdown);
  ASSERT_EQ(theirs.size(), as_ours.size());
  const size_t at = as_ours.find(std::string("\xa1v", 2)) + 2;
  EXPECT_EQ(theirs[at], 13);
  as_ours[at] = 13;
  EXPECT_EQ(theirs, as_ours);
  EXPECT_EQ(encode_for(kProtocolVersion, ControlReply{false, "no"}), encode(ControlReply{false, "no"}));
  EXPECT_NE(shutdown.reason.find("version 13 "), std::string::npos);
  EXPECT_NE(shutdown.reason.find(std::to_string(kProtocolVersion)), std::string::npos);
}

}  // namespace
}  // namespace telesplat::wire
