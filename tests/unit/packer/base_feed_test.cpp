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
  // Takes the list, asks for the root as a viewer does, and serves it. Returns the triangles that the feed has then.
  size_t received(size_t triangles) {
    take_answer();
    feed.answer({{}, 0, 0, 0}, "viewer");
    feed.answer({{}, told.base, kRootPart, 1}, "viewer");
    const auto request = asked();
    if (!request || request->type != wire::ChunkRequest::kName) return 0;
    serve(wire::decode<wire::ChunkRequest>(request->body).value(), triangles);
    take_answer();
    return feed.triangles();
  }
  void take_answer() {
    net::wait_readable({feed.sockets()[0]}, int(1000 * test::patient(20)));
    feed.receive();
  }
  size_t came(std::string_view type) const { return size_t(std::ranges::count(answers, type)); }

  static constexpr uint64_t kRootPart = 2;
  double now_s = 0;
  wire::BaseBegin told;              // the newest one on PUB
  std::vector<std::string> answers;  // types of what the viewer was sent
  Outlets outlets{.to_viewers =
                      [this](std::string_view type, const std::string& body) {
                        if (type == wire::BaseBegin::kName)
                          told = wire::decode<wire::BaseBegin>(std::as_bytes(std::span(body))).value();
                      },
                  .to_viewer =
                      [this](std::string_view, std::string_view type, const std::string&) {
                        answers.emplace_back(type);
                        return true;
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
  EXPECT_EQ(received(20), 10u);
}

TEST_F(BaseFeedTest, AnAnswerThatWasAskedForInAnEarlierEpochOfTheSameDataIsTaken) {
  const auto request = ask(session(1, "aa"));
  feed.follow(session(2, "aa"), true);
  answer(request, 10);
  EXPECT_EQ(received(10), 5u);
}

TEST_F(BaseFeedTest, AViewerGetsTheTreeAndThePartsThatItAsksFor) {
  answer(ask(session(1, "aa")), 10);
  ASSERT_EQ(received(10), 5u);
  EXPECT_EQ(told.nodes, 3u);
  EXPECT_EQ(came(wire::BaseTree::kName), 1u);
  EXPECT_EQ(came(wire::BasePart::kName), 1u);
  feed.answer({{}, told.base, kRootPart, 1}, "viewer");
  EXPECT_EQ(came(wire::BasePart::kName), 2u) << "it is held";
}

TEST_F(BaseFeedTest, AChunkThatIsLostIsAskedForAgain) {
  answer(ask(session(1, "aa")), 10);
  take_answer();
  feed.answer({{}, told.base, kRootPart, 1}, "viewer");
  EXPECT_EQ(asked()->type, wire::ChunkRequest::kName);   // and gets no answer
  feed.answer({{}, told.base, kRootPart, 1}, "viewer");  // it loses patience
  feed.tick({7}, now_s);
  EXPECT_FALSE(data.receive()) << "the answer may be on its way";
  feed.tick({7}, now_s += 60);
  const auto again = asked();
  serve(wire::decode<wire::ChunkRequest>(again->body).value(), 10);
  take_answer();
  EXPECT_EQ(came(wire::BasePart::kName), 1u);
}

TEST_F(BaseFeedTest, DamagedChunksEndTheBase) {
  const auto request = ask(session(1, "aa"));
  answer(request, 10);
  take_answer();
  feed.answer({{}, told.base, kRootPart, 1}, "viewer");
  ASSERT_TRUE(asked());
  const std::vector<std::byte> damaged(100);
  data.send(wire::Chunk{request.epoch, {2}, damaged}, packer);
  take_answer();
  EXPECT_EQ(told.nodes, 0u) << "viewers drop it";
  feed.tick({7}, now_s += 60);
  EXPECT_FALSE(data.receive()) << "nothing more is asked for";
}

TEST_F(BaseFeedTest, TheBaseStaysWhileItsDataServerIsAway) {
  answer(ask(session(1, "aa")), 10);
  ASSERT_EQ(received(10), 5u);
  const uint64_t number = told.base;
  auto away = session(1, "aa");
  away.endpoints.clear();
  feed.follow(away, false);
  EXPECT_EQ(feed.triangles(), 5u);
  EXPECT_EQ(told.base, number);
  feed.follow(session(2, "bb"), true);
  EXPECT_EQ(feed.triangles(), 0u) << "other data";
  EXPECT_GT(told.base, number) << "viewers drop it";
  EXPECT_EQ(told.nodes, 0u);
}

}  // namespace
}  // namespace telesplat::packer
