// The base on its way from the data server to viewers, across changes of the scene.
#include "services/packer/points/base/base_feed.h"

#include <gtest/gtest.h>

#include "common/core/clock.h"
#include "tests/support/mesh_chunks.h"
#include "tests/support/patience.h"

namespace telesplat::packer {
namespace {

// A strip of triangles.
geometry::ChunkBytes strip(size_t triangles) {
  std::vector<test::Vertex> vertices;
  std::vector<uint32_t> indices;
  for (size_t i = 0; i < triangles + 2; ++i)
    vertices.push_back({{0.01f * float(i) - 0.4f, i % 2 ? 0.01f : 0.0f, 0}, {0, 0, 1}, 0x204060});
  for (uint32_t i = 0; i < triangles; ++i) indices.insert(indices.end(), {i, i + 1, i + 2});
  return test::chunk_of(vertices, indices);
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
    w.box_room = {glm::vec3(-0.5f), glm::vec3(0.5f)};
    return w;
  }
  // Follows the session, and returns its request for a list of chunks.
  wire::ChunkListRequest ask(const wire::Welcome& session) {
    feed.follow(session, true);
    feed.tick({7}, now_s += 1);
    const auto message = asked();
    return message ? wire::decode<wire::ChunkListRequest>(message->body).value() : wire::ChunkListRequest{};
  }
  std::optional<net::Message> asked() {
    net::wait_readable({&data}, int(1000 * test::patient(20)));
    auto message = data.receive();
    if (message) packer = message->peer;
    return message;
  }
  // Answers with a root of half as many triangles above two chunks.
  void answer(const wire::ChunkListRequest& request, size_t triangles) {
    const uint64_t half = triangles / 2;
    data.send(wire::ChunkList{request.epoch,
                              {{.id = {0}, .triangles = half},
                               {.id = {1}, .triangles = half},
                               {.id = {2}, .triangles = half, .spacing_m = 1, .first_child = 0, .children = 2}}},
              packer);
  }
  void serve(const wire::ChunkRequest& request, size_t triangles) {
    const auto chunk = strip(triangles / 2);
    data.send(wire::Chunk{request.epoch, request.chunk, chunk.bytes}, packer);
  }
  // Serves chunks until there is a base; returns its triangles.
  size_t received(size_t triangles) {
    for (const double deadline = monotonic_s() + test::patient(20);
         feed.triangles() == 0 && monotonic_s() < deadline;) {
      net::wait_readable({feed.sockets()[0], &data}, 5);
      while (const auto message = data.receive())
        if (message->type == wire::ChunkRequest::kName)
          serve(wire::decode<wire::ChunkRequest>(message->body).value(), triangles);
      feed.receive();
    }
    return feed.triangles();
  }

  double now_s = 0;
  wire::BaseBegin told;  // the newest one on PUB
  Outlets outlets{.to_viewers = [this](std::string_view type, const std::string& body) {
    if (type == wire::BaseBegin::kName) told = wire::decode<wire::BaseBegin>(std::as_bytes(std::span(body))).value();
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
  EXPECT_EQ(received(20), 20u);
}

TEST_F(BaseFeedTest, AnAnswerThatWasAskedForInAnEarlierEpochOfTheSameDataIsTaken) {
  const auto request = ask(session(1, "aa"));
  feed.follow(session(2, "aa"), true);
  answer(request, 10);
  EXPECT_EQ(received(10), 10u);
}

TEST_F(BaseFeedTest, ViewersLearnHowManyPartsAreCoarse) {
  answer(ask(session(1, "aa")), 10);
  ASSERT_EQ(received(10), 10u);
  EXPECT_EQ(told.parts, 3u);
  EXPECT_EQ(told.coarse, 1u);
}

TEST_F(BaseFeedTest, AChunkThatIsLostIsAskedForAgain) {
  answer(ask(session(1, "aa")), 10);
  net::wait_readable({feed.sockets()[0]}, int(1000 * test::patient(20)));
  feed.receive();
  EXPECT_EQ(asked()->type, wire::ChunkRequest::kName);  // and gets no answer
  feed.tick({7}, now_s += 60);
  EXPECT_EQ(received(10), 10u);
}

TEST_F(BaseFeedTest, DamagedChunksGiveNoBase) {
  const auto request = ask(session(1, "aa"));
  answer(request, 10);
  net::wait_readable({feed.sockets()[0]}, int(1000 * test::patient(20)));
  feed.receive();
  ASSERT_TRUE(asked());
  const std::vector<std::byte> damaged(100);
  data.send(wire::Chunk{request.epoch, {2}, damaged}, packer);
  net::wait_readable({feed.sockets()[0]}, int(1000 * test::patient(20)));
  feed.receive();
  EXPECT_EQ(feed.triangles(), 0u);
  feed.tick({7}, now_s += 60);
  EXPECT_FALSE(data.receive()) << "nothing more is asked for";
}

TEST_F(BaseFeedTest, TheBaseStaysWhileItsDataServerIsAway) {
  answer(ask(session(1, "aa")), 10);
  ASSERT_EQ(received(10), 10u);
  const uint64_t number = told.base;
  auto away = session(1, "aa");
  away.endpoints.clear();
  feed.follow(away, false);
  EXPECT_EQ(feed.triangles(), 10u);
  EXPECT_EQ(told.base, number);
  feed.follow(session(2, "bb"), true);
  EXPECT_EQ(feed.triangles(), 0u) << "other data";
  EXPECT_GT(told.base, number) << "viewers drop it";
  EXPECT_EQ(told.parts, 0u);
}

}  // namespace
}  // namespace telesplat::packer
