#include "common/net/keys/access.h"

#include <gtest/gtest.h>

namespace telesplat::net {
namespace {

TEST(Via, ChoosesTheProxyOfARole) {
  const auto via = Via::parse({"127.0.0.1:1080", "data=proxy.example:1081"});
  ASSERT_TRUE(via.ok());
  EXPECT_EQ(via->proxy("data"), "proxy.example:1081");
  EXPECT_EQ(via->proxy(""), "127.0.0.1:1080");
  EXPECT_EQ(via->proxy("packer"), "127.0.0.1:1080");
  const auto data_alone = Via::parse({"data=127.0.0.1:1081"});
  ASSERT_TRUE(data_alone.ok());
  EXPECT_EQ(data_alone->proxy(""), "");
  EXPECT_EQ(Via().proxy("data"), "");
}

TEST(Via, RefusesWhatIsNoAddress) {
  for (const char* text : {"", "host", "host:", ":1080", "data=", "data=:1", "host:port", "host:0", "host:123456"}) {
    const auto via = Via::parse({text});
    ASSERT_FALSE(via.ok()) << text;
    EXPECT_TRUE(via.error().text.starts_with(std::string("--via ") + text + ":")) << via.error().text;
  }
}

}  // namespace
}  // namespace telesplat::net
