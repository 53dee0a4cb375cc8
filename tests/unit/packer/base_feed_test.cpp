// The base on its way from the data server to viewers, across changes of the scene.
#include "services/packer/points/base/base_feed.h"

#include <gtest/gtest.h>

#include "common/core/clock.h"
#include "common/image/normal.h"
#include "tests/support/patience.h"

namespace telesplat::packer {
namespace {

const points::ModelConfig kModel{{glm::vec3(-0.5f), glm::vec3(0.5f)}, 5};

// Surfels along a line.
std::vector<std::byte> set_of(size_t surfels) {
  std::vector<float> positions(3 * surfels);
  for (size_t i = 0; i < surfels; ++i) positions[3 * i] = -0.4f + 0.01f * float(i);
  return geometry::build_surfels(positions, std::vector(surfels, image::encode_normal32({0, 0, 1})),
                                 std::vector(surfels, 0x204060u), 0.01f, false);
}

class BaseFeedTest : public testing::Test {
 protected:
  BaseFeedTest() { EXPECT_TRUE(data.bind("inproc://chunks").ok()); }

  static wire::Welcome session(uint64_t epoch, const std::string& content) {
    wire::Welcome w;
    w.epoch = {epoch};
    w.facts = {{"kind", "mesh"}, {"content_hash", content}};
    w.endpoints = {{"chunks", "inproc://chunks"}};
    w.settings.keep_redundant = false;
    return w;
  }
  // Follows the session, and returns its request for the base.
  wire::SurfelRequest ask(const wire::Welcome& session) {
    feed.follow(session, kModel, true);
    feed.tick({7}, 1);
    net::wait_readable({&data}, int(1000 * test::patient(20)));
    const auto message = data.receive();
    if (message) packer = message->peer;
    return message ? wire::decode<wire::SurfelRequest>(message->body).value() : wire::SurfelRequest{};
  }
  void answer(const wire::SurfelRequest& asked, size_t surfels) {
    data.send(wire::Surfels{asked.epoch, asked.array, set_of(surfels)}, packer);
  }
  // Takes answers until there is a base; returns its surfels.
  size_t received() {
    for (const double deadline = monotonic_s() + test::patient(20); feed.surfels() == 0 && monotonic_s() < deadline;) {
      net::wait_readable({feed.sockets()[0]}, 5);
      feed.receive();
    }
    return feed.surfels();
  }

  uint64_t base = 0;  // number of the newest one that viewers were told of
  Outlets outlets{.to_viewers = [this](std::string_view, const std::string& body) {
    base = wire::decode<wire::BaseHidden>(std::as_bytes(std::span(body))).value().base;
  }};
  std::string packer;
  net::Context context;
  net::Socket data{context, net::Kind::kRouter, "data"};
  BaseFeed feed{&context, outlets};
};

TEST_F(BaseFeedTest, ALateAnswerForTheDataBeforeIsNotTaken) {
  const auto first = ask(session(1, "aa")), second = ask(session(2, "bb"));
  answer(first, 10);
  answer(second, 20);
  EXPECT_EQ(received(), 20u);
}

TEST_F(BaseFeedTest, AnAnswerThatWasAskedForInAnEarlierEpochOfTheSameDataIsTaken) {
  const auto asked = ask(session(1, "aa"));
  feed.follow(session(2, "aa"), kModel, true);
  answer(asked, 10);
  EXPECT_EQ(received(), 10u);
}

TEST_F(BaseFeedTest, TheBaseStaysWhileItsDataServerIsAway) {
  answer(ask(session(1, "aa")), 10);
  ASSERT_EQ(received(), 10u);
  const uint64_t number = base;
  auto away = session(1, "aa");
  away.endpoints.clear();
  feed.follow(away, kModel, false);
  EXPECT_EQ(feed.surfels(), 10u);
  EXPECT_EQ(base, number);
  feed.follow(session(2, "bb"), kModel, true);
  EXPECT_EQ(feed.surfels(), 0u) << "other data";
  EXPECT_GT(base, number) << "viewers drop it";
}

}  // namespace
}  // namespace telesplat::packer
