// A mesh's data server between its sockets: it answers orders of arrays from any master.
#include "services/data/mesh/served_mesh.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "common/net/dispatch.h"

namespace telesplat::data {
namespace {

class NoChunks final : public MeshStore {
 public:
  const MeshStoreInfo& info() const override { return info_; }
  const std::vector<geometry::ChunkInfo>& chunks() const override { return chunks_; }
  geometry::ChunkBytes chunk(ChunkId) const override { return {}; }

 private:
  MeshStoreInfo info_;
  std::vector<geometry::ChunkInfo> chunks_;
};

class ServedMeshTest : public testing::Test {
 protected:
  // Returns the answer for `master` after this order.
  std::string answer(uint64_t master, const std::string& order) {
    wire::Welcome session;
    session.master = InstanceId{master};
    session.facts[scene::kArrayOrderFact] = order;
    EXPECT_TRUE(served->follow(session).ok());
    net::Context context;
    net::Socket nobody(context, net::Kind::kRouter, "nobody", {});
    for (int i = 0; i < 500; ++i) {
      served->send_finished({nobody, nobody});
      if (const auto news = served->news(); !news.empty()) return news.at(scene::kArrayAnswerFact);
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return "";
  }

  std::unique_ptr<Served> served =
      serve_mesh(std::make_shared<NoChunks>(), "hill.ply",
                 {.as_begun = std::nullopt, .map = {}, .open = [](const std::string& array, const Progress&) {
                    using Made = Result<std::shared_ptr<MeshStore>>;
                    return array == "heat" ? Made(std::make_shared<NoChunks>()) : Made(Error{"there is none"});
                  }});
};

TEST_F(ServedMeshTest, OrdersAreAnswered) {
  EXPECT_EQ(answer(1, "1 heat"), "1");
  EXPECT_EQ(answer(1, "2 cold"), "2 there is none");
  EXPECT_EQ(answer(1, "3 heat"), "3") << "it is there already";
}

TEST_F(ServedMeshTest, AnotherMastersOrderOfTheSameWordsIsAnsweredToo) {
  EXPECT_EQ(answer(1, "1 heat"), "1");
  EXPECT_EQ(answer(2, "1 heat"), "1");
}

class CountsChunks final : public MeshStore {
 public:
  const MeshStoreInfo& info() const override { return info_; }
  const std::vector<geometry::ChunkInfo>& chunks() const override { return chunks_; }
  geometry::ChunkBytes chunk(ChunkId) const override {
    ++looked_at;
    return {bytes_, nullptr};
  }
  mutable int looked_at = 0;

 private:
  MeshStoreInfo info_;
  std::vector<std::byte> bytes_ = std::vector<std::byte>(1000);
  std::vector<geometry::ChunkInfo> chunks_{{.id = {0}, .box_room = {}, .triangles = 1, .bytes = 1000}};
};

TEST(ServedMesh, AChunkIsReadOnlyForAPeerWhoseQueueTakesIt) {
  const auto store = std::make_shared<CountsChunks>();
  const auto served = serve_mesh(store, "hill.ply", {.as_begun = std::nullopt, .map = {}, .open = {}});
  net::Context context;
  net::Socket requests(context, net::Kind::kRouter, "requests", {.high_water_mark = 4});
  net::Socket master(context, net::Kind::kRouter, "master", {}),
      asker(context, net::Kind::kDealer, "asker", {.high_water_mark = 100});
  ASSERT_TRUE(requests.bind("inproc://chunks"));
  ASSERT_TRUE(asker.connect("inproc://chunks"));
  constexpr int kAsked = 1000;
  for (int asked = 0; asked < kAsked; ++asked) {
    net::wait_readable({&asker}, 0);  // it learns that its requests were read
    ASSERT_TRUE(asker.send(wire::ChunkRequest{EpochId{1}, ChunkId{0}, ""}));
    ASSERT_TRUE(net::wait_readable({&requests}, 20000));
    served->answer(*requests.receive(), {requests, master});
  }
  int got = 0;
  while (net::wait_readable({&asker}, 200)) got += asker.receive().has_value();
  EXPECT_GT(got, 0);
  EXPECT_LT(got, kAsked) << "it read nothing meanwhile";
  EXPECT_EQ(store->looked_at, got);
}

// Lists are large, and quick to request.
TEST_F(ServedMeshTest, APeerGetsAFewListsAtOnce) {
  net::Context context;
  net::Socket requests(context, net::Kind::kRouter, "requests", {}), master(context, net::Kind::kRouter, "master", {});
  net::Socket asker(context, net::Kind::kDealer, "asker", {}), other(context, net::Kind::kDealer, "other", {});
  ASSERT_TRUE(requests.bind("inproc://requests"));
  ASSERT_TRUE(asker.connect("inproc://requests") && other.connect("inproc://requests"));
  for (int n = 0; n < 100; ++n) asker.send(wire::ChunkListRequest{EpochId{1}, ""});
  other.send(wire::ChunkListRequest{EpochId{1}, ""});
  for (int asked = 0; asked < 101; net::wait_readable({&requests}, 100))
    while (const auto message = requests.receive()) served->answer(*message, {requests, master}), ++asked;
  const auto lists = [](net::Socket& socket) {
    int count = 0;
    while (net::wait_readable({&socket}, 200)) count += socket.receive().has_value();
    return count;
  };
  EXPECT_LE(lists(asker), 5);
  EXPECT_EQ(lists(other), 1);
}

// A store of this many chunks, with this hash.
class CountedStore final : public MeshStore {
 public:
  CountedStore(uint64_t hash, size_t chunks) {
    info_.content_hash = hash;
    for (size_t i = 0; i < chunks; ++i)
      chunks_.push_back({.id = ChunkId{i}, .box_room = {{0, 0, 0}, {1, 1, 1}}, .triangles = 1, .bytes = 1000});
  }
  const MeshStoreInfo& info() const override { return info_; }
  const std::vector<geometry::ChunkInfo>& chunks() const override { return chunks_; }
  geometry::ChunkBytes chunk(ChunkId) const override { return {}; }

 private:
  MeshStoreInfo info_;
  std::vector<geometry::ChunkInfo> chunks_;
};

class ProvisionalMesh : public testing::Test {
 protected:
  void serve(const Result<std::shared_ptr<MeshStore>>& whole) {
    served = serve_mesh(std::make_shared<CountedStore>(1, 3), "hill.ply",
                        {.as_begun = std::nullopt, .map = *colour::find_colour_map("viridis"), .open = nullptr},
                        [this, whole](const Progress& progress) {
                          while (!go)
                            progress(kReading, 0.5), std::this_thread::sleep_for(std::chrono::milliseconds(1));
                          return whole;
                        });
    ASSERT_TRUE(requests.bind("inproc://provisional"));
    ASSERT_TRUE(asker.connect("inproc://provisional"));
  }
  void finish() {
    go = true;
    while (served->failure() && !served->take_changed()) {
      served->send_finished({requests, master});
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  // Number of chunks in the list that an asker of this epoch gets.
  size_t listed(uint64_t epoch) {
    asker.send(wire::ChunkListRequest{EpochId{epoch}, ""});
    EXPECT_TRUE(net::wait_readable({&requests}, 20000));
    served->answer(*requests.receive(), {requests, master});
    EXPECT_TRUE(net::wait_readable({&asker}, 20000));
    size_t out = 0;
    net::dispatch<wire::ChunkList>(asker, *asker.receive(),
                                   [&](const wire::ChunkList& list) { out = list.chunks.size(); });
    return out;
  }
  wire::Welcome session(uint64_t epoch) const {
    wire::Hello hello;
    served->describe(hello);
    return {.master = InstanceId{1}, .epoch = EpochId{epoch}, .facts = hello.facts};
  }

  net::Context context;
  net::Socket requests{context, net::Kind::kRouter, "requests", {}}, master{context, net::Kind::kRouter, "master", {}};
  net::Socket asker{context, net::Kind::kDealer, "asker", {}};
  std::atomic<bool> go{false};
  std::unique_ptr<Served> served;
};

TEST_F(ProvisionalMesh, AnswersEarlierEpochsFromTheProvisionalStore) {
  serve(std::shared_ptr<MeshStore>(std::make_shared<CountedStore>(2, 5)));
  EXPECT_TRUE(served->follow(session(7)).ok());
  ASSERT_EQ(served->notes().size(), 1u);
  EXPECT_EQ(listed(7), 3u);
  const wire::Welcome before = session(7);
  finish();
  EXPECT_TRUE(served->notes().empty());
  EXPECT_NE(session(8).facts.at("content_hash"), before.facts.at("content_hash"));
  EXPECT_EQ(listed(7), 3u) << "no epoch of the whole store has begun";
  EXPECT_TRUE(served->follow(before).ok());
  EXPECT_TRUE(served->follow(session(8)).ok());
  EXPECT_EQ(listed(8), 5u);
  EXPECT_EQ(listed(7), 3u) << "a sampler may not know yet";
}

TEST_F(ProvisionalMesh, EndsWhenTheWholeStoreCannotBeMade) {
  serve(Error{"hill.ply: triangle 7 names vertex 9, there are 8"});
  EXPECT_TRUE(served->failure().ok());
  finish();
  ASSERT_FALSE(served->failure().ok());
  EXPECT_EQ(served->failure().error().text, "hill.ply: triangle 7 names vertex 9, there are 8");
}

}  // namespace
}  // namespace telesplat::data
