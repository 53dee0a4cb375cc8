// A mesh's chunks between data server and sampler: the sampler asks for each until it comes, and no more often.
#include "services/sampler/mesh/tiles.h"

#include <gtest/gtest.h>

#include "common/core/clock.h"
#include "common/net/dispatch.h"
#include "tests/support/patience.h"

namespace telesplat::sampler {
namespace {

constexpr double kDeadline_s = test::patient(20);
constexpr std::byte kBad{0xff};  // first byte of an invalid chunk

// Takes chunks of any bytes, except those that begin with kBad.
class Taker final : public Sampler {
 public:
  explicit Taker(std::map<ChunkId, int>& taken) : taken_(taken) {}
  const char* name() const override { return "taker"; }
  Status add_chunk(ChunkId id, geometry::ChunkBytes chunk) override {
    if (chunk.bytes.empty() || chunk.bytes[0] == kBad) return Error{"is no chunk"};
    ++taken_[id];
    return ok_status();
  }
  Status add_chunks(std::vector<std::pair<ChunkId, geometry::ChunkBytes>> chunks) override {
    Status out = ok_status();
    for (auto& [id, bytes] : chunks)
      if (Status s = add_chunk(id, bytes); !s) out = s;
    return out;
  }
  void remove_chunk(ChunkId id) override { taken_.erase(id); }
  void show(const std::vector<ChunkId>&) override {}
  void set_colours(std::shared_ptr<const scene::ColourTable>) override {}
  void set_clip(const geometry::Clip&) override {}
  image::DepthImage sample(const geometry::Camera&, const geometry::Rect& tile, const image::PixelMask*) override {
    return {tile.width, tile.height};
  }

 private:
  std::map<ChunkId, int>& taken_;
};

net::MasterLink make_link(net::Context& context) {
  const wire::Hello nobody;
  return net::MasterLink(context, "inproc://nobody", nobody);
}

class MeshTilesTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto bound = data.bind("tcp://127.0.0.1:*");
    ASSERT_TRUE(bound);
    wire::Welcome w;
    w.master = {1}, w.epoch = {1};
    w.endpoints["chunks"] = *bound;
    w.facts["content_hash"] = "1";
    tiles.on_welcome(w);
  }
  // Passes messages on until `done`. The clock is `now`, which stands still.
  bool until(const auto& done) {
    for (const double deadline = monotonic_s() + kDeadline_s; monotonic_s() < deadline;) {
      tiles.fetch(nullptr, now);
      while (const auto message = data.receive())
        net::dispatch<wire::ChunkListRequest, wire::ChunkRequest>(data, *message, [&](const auto& request) {
          peer = message->peer;
          if constexpr (std::is_same_v<std::decay_t<decltype(request)>, wire::ChunkRequest>)
            asked.push_back(request.chunk.value);
          else
            ++lists_asked;
        });
      if (done()) return true;
      std::vector<net::Socket*> sockets = tiles.sockets();
      sockets.push_back(&data);
      net::wait_readable(sockets, 5);
      tiles.receive();
    }
    return false;
  }
  void give_list(size_t chunks, uint64_t bytes) {
    ASSERT_TRUE(until([&] { return lists_asked > 0; }));
    wire::ChunkList list{EpochId{1}, {}};
    for (size_t i = 0; i < chunks; ++i) list.chunks.push_back({ChunkId{i}, {{0, 0, 0}, {1, 1, 1}}, 10, bytes});
    data.send(list, peer);
  }
  void give(uint64_t id, std::byte first, size_t size = 100) {
    std::vector<std::byte> bytes(size, std::byte{1});
    if (size > 0) bytes[0] = first;
    data.send(wire::Chunk{EpochId{1}, ChunkId{id}, bytes}, peer);
  }

  net::Context context;
  net::Socket data{context, net::Kind::kRouter, "data"};
  net::MasterLink link = make_link(context);
  metrics::SpanRecorder spans;
  std::map<ChunkId, int> taken;
  MeshTiles tiles{std::make_unique<Taker>(taken), 1 << 30, "sampler", context, link, spans};
  std::string peer;
  int lists_asked = 0;
  std::vector<uint64_t> asked;
  double now = monotonic_s();
};

TEST_F(MeshTilesTest, ARefusedChunkIsAskedForAgain) {
  give_list(2, 100);
  ASSERT_TRUE(until([&] { return asked.size() == 2; }));
  give(0, std::byte{1});
  give(1, kBad);
  ASSERT_TRUE(until([&] { return asked.size() == 3; }));
  EXPECT_EQ(asked.back(), 1u);
  EXPECT_EQ(taken.size(), 1u) << "the other one is there";
  give(1, std::byte{1});
  ASSERT_TRUE(until([&] { return taken.size() == 2; }));
}

TEST_F(MeshTilesTest, AChunkThatIsNoneInTheEndIsAHole) {
  give_list(2, 100);
  ASSERT_TRUE(until([&] { return asked.size() == 2; }));
  give(0, std::byte{1});
  for (size_t n = 0; n < ChunkCache::kTries; ++n) {
    ASSERT_TRUE(until([&] { return asked.size() == 2 + n; })) << n;
    EXPECT_EQ(asked[n == 0 ? 0 : n + 1], 1u);
    give(1, kBad, n == 1 ? 0 : 100);  // also: there is no such chunk
  }
  net::MasterLink::Values values;
  ASSERT_TRUE(until([&] {
    values.clear();
    tiles.add_status(values);
    return values.at("chunks_lacking") == 1;
  }));
  EXPECT_EQ(values.at("chunks_refused"), ChunkCache::kTries);
  EXPECT_EQ(asked.size(), 4u) << "no more than that";
}

// A chunk that is asked for twice comes twice and makes a slow link slower.
TEST_F(MeshTilesTest, SlowChunksAreAskedForOnceAndFewAtATime) {
  give_list(40, 3 << 20);
  ASSERT_TRUE(until([&] { return asked.size() >= 2; }));
  for (int n = 0; n < 20; ++n) {
    now += 0.5;
    tiles.fetch(nullptr, now);
  }
  net::wait_readable({&data}, 100);
  ASSERT_TRUE(until([&] { return true; }));
  EXPECT_EQ(asked, (std::vector<uint64_t>{39, 38})) << "8 MB of chunks of 3 MB, the last of the list first";
  // A link without answers is not a slow link: after kFirst_s the sampler asks again.
  now += RetryClock::kFirst_s;
  ASSERT_TRUE(until([&] { return asked.size() >= 4; }));
  EXPECT_EQ(asked[2], 39u);
}

class MeshLeases : public MeshTilesTest {
 protected:
  void SetUp() override {
    ASSERT_TRUE(master.bind("inproc://nobody"));
    MeshTilesTest::SetUp();
    held.received_s = now;
    held.lease.lease = {7};
  }
  // Returns how many times the sampler asked for more time within `seconds`.
  int extended(double seconds) {
    for (const double end = now + seconds; now < end; now += 0.05) tiles.fetch(&held, now);
    int times = 0;
    while (net::wait_readable({&master}, 200))
      while (const auto message = master.receive())
        net::dispatch<wire::LeaseExtend>(master, *message, [&](const auto& m) { times += m.lease.value == 7; });
    return times;
  }
  net::Socket master{context, net::Kind::kRouter, "master"};
  HeldLease held;
};

// An array makes its list late. Without more time the master would think the sampler dead and give its tiles to others.
TEST_F(MeshLeases, TheListIsWaitedForLikeChunks) { EXPECT_GE(extended(2), 10); }

TEST_F(MeshLeases, WhereNothingComesNoMoreTimeIsAskedFor) {
  EXPECT_GE(extended(RetryClock::kFirst_s + 0.2), 10 * RetryClock::kFirst_s / 2);
  EXPECT_EQ(extended(20), 0);
}

}  // namespace
}  // namespace telesplat::sampler
