#include "common/links/link.h"

#include <gtest/gtest.h>

namespace telesplat::links {
namespace {

Link read(const std::string& text) {
  const auto link = parse(text);
  EXPECT_TRUE(link.ok()) << (link.ok() ? "" : link.error().text);
  return link.ok() ? *link : Link{};
}

std::string refusal(const std::string& text) {
  const auto link = parse(text);
  return link.ok() ? "taken" : link.error().text;
}

TEST(LinkText, AllProperties) {
  const Link link = read("rtt=40ms,rate=100mbit,jitter=5ms,stall=2s/30s");
  EXPECT_DOUBLE_EQ(link.rtt_s, 0.04);
  EXPECT_DOUBLE_EQ(link.rate_bit_s, 1e8);
  EXPECT_DOUBLE_EQ(link.jitter_s, 0.005);
  EXPECT_DOUBLE_EQ(link.stall_s, 2);
  EXPECT_DOUBLE_EQ(link.stall_every_s, 30);
}

TEST(LinkText, ShortForms) {
  EXPECT_TRUE(read("local").is_local());
  EXPECT_EQ(read("20mbit"), (Link{.rate_bit_s = 2e7}));
  EXPECT_EQ(read("50ms"), (Link{.rtt_s = 0.05}));
  EXPECT_EQ(read("50ms:100mbit"), (Link{.rtt_s = 0.05, .rate_bit_s = 1e8}));
  EXPECT_EQ(read("0.05s:0.1gbit"), read("50ms:100mbit"));
  EXPECT_EQ(read("500us:100kbit"), (Link{.rtt_s = 500 * 1e-6, .rate_bit_s = 1e5}));
}

TEST(LinkText, ReadsWhatItWrites) {
  for (const char* text : {"local", "rtt=50ms", "rate=20mbit", "rtt=40ms,rate=100mbit,jitter=5ms,stall=2s/30s",
                           "rtt=1.5s,rate=1.5gbit", "rtt=250us,rate=64kbit,stall=100ms/1s"})
    EXPECT_EQ(text_of(read(text)), text);
}

TEST(LinkText, RefusalsNameWhatValueAndLimit) {
  EXPECT_EQ(refusal("rate=0"), "rate=0: not in 10kbit..100gbit; leave rate out for a link without a limit");
  EXPECT_EQ(refusal("rate=9kbit"), "rate=9kbit: not in 10kbit..100gbit; leave rate out for a link without a limit");
  EXPECT_EQ(refusal("rate=20"), "rate=20: is no rate; a number and kbit, mbit or gbit (a second)");
  EXPECT_EQ(refusal("rtt=11s"), "rtt=11s: not in 0..10s");
  EXPECT_EQ(refusal("rtt=-1ms"), "rtt=-1ms: not in 0..10s");
  EXPECT_EQ(refusal("rtt=nanms"), "rtt=nanms: not in 0..10s");
  EXPECT_EQ(refusal("rtt=40"), "rtt=40: is no time; a number and us, ms or s");
  EXPECT_EQ(refusal("jitter=x"), "jitter=x: is no time; a number and us, ms or s");
  EXPECT_EQ(refusal("stall=2s"), "stall=2s: is not FOR/EVERY, two times such as 2s/30s");
  EXPECT_EQ(refusal("stall=30s/2s"), "stall=30s/2s: FOR must be above 0 and at most 0.99 of EVERY, EVERY 0.01s to 3600s");
  EXPECT_EQ(refusal("loss=1"), "loss: no such property of a link; rtt, rate, jitter and stall are");
  EXPECT_EQ(refusal("rtt=1ms,,"), ": is not PROPERTY=VALUE, as in rtt=40ms,rate=100mbit");
  for (const char* text :
       {"", "fast", "50", "50ms:", "50ms:100", "20mbit:50ms", "50ms:100mbit:1", "local,rtt=1ms", "="})
    EXPECT_FALSE(parse(text).ok()) << text;
}

TEST(LinkText, Places) {
  const auto at = [](const char* text) { return parse_placed(text).value(); };
  EXPECT_EQ(at("20mbit").place, Place::kViewer);
  EXPECT_EQ(at("50ms:100mbit").place, Place::kViewer);
  EXPECT_EQ(at("viewer:50ms:100mbit").place, Place::kViewer);
  EXPECT_EQ(at("sampler:rtt=5ms").place, Place::kSampler);
  EXPECT_EQ(at("data:1gbit").place, Place::kData);
  EXPECT_EQ(at("data:1gbit").link.rate_bit_s, 1e9);
  EXPECT_FALSE(parse_placed("packer:20mbit").ok());
}

TEST(LinkQueue, HoldsARoundTripOrATenthOfASecond) {
  EXPECT_EQ(queue_bytes(read("20mbit")), 250000u);
  EXPECT_EQ(queue_bytes(read("200ms:20mbit")), 500000u);
  EXPECT_EQ(queue_bytes(read("200ms")), 0u);
}

}  // namespace
}  // namespace telesplat::links
