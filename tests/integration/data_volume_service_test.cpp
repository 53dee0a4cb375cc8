// A volume's data server on sockets: a master that welcomes it, a sampler that asks for voxels.
#include <gtest/gtest.h>

#include <atomic>
#include <fstream>
#include <thread>

#include "common/core/clock.h"
#include "common/net/dispatch.h"
#include "services/data/data_service.h"
#include "services/data/kinds.h"
#include "services/data/mesh/served_mesh.h"
#include "services/data/volume/served_volume.h"
#include "tests/support/files/data_files.h"
#include "tests/support/files/own_folder.h"
#include "tests/support/patience.h"
#include "tests/support/raw_peer.h"
#include "tests/support/volume/samples.h"

namespace telesplat::data {
namespace {

constexpr double kDeadline_s = telesplat::test::patient(30);

// Returns the next message of type M that a peer sends; skips others.
template <class M>
std::optional<std::pair<M, net::Message>> next(net::Socket& socket) {
  for (const double until = monotonic_s() + kDeadline_s; monotonic_s() < until; net::wait_readable({&socket}, 20))
    while (const auto m = socket.receive())
      if (m->type == M::kName)
        if (auto decoded = socket.decode<M>(*m)) return std::pair(std::move(*decoded), *m);
  return std::nullopt;
}

class Service : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(master.bind("inproc://master"));
    options.service.name = "data-1", options.service.master = "inproc://master",
    options.service.bind = "inproc://voxels";
    options.scene = "folder/noise.raw";
    server = std::thread([this] {
      const auto served = serve_volume(store, options.scene);
      exit_code = serve(context, *served, options.service, [this] { return stop.load(); });
    });
  }
  void TearDown() override {
    stop = true;
    if (server.joinable()) server.join();
  }
  wire::Hello welcome(uint64_t epoch, const std::string& transfer = {}) {
    wire::Hello hello;
    if (peer.empty()) {
      const auto said = next<wire::Hello>(master);
      EXPECT_TRUE(said);
      if (!said) return hello;
      hello = said->first, peer = said->second.peer, facts = hello.facts, parameters = hello.parameters;
    }
    wire::Welcome w;
    w.master = InstanceId{5}, w.hello_sent_s = hello.sent_s, w.epoch = EpochId{epoch};
    w.facts = facts, w.parameters = parameters;
    if (!transfer.empty()) w.facts["transfer"] = transfer;
    master.send(w, peer);
    return hello;
  }

  net::Context context;
  net::Socket master{context, net::Kind::kRouter, "master"};
  DataServiceOptions options;
  std::shared_ptr<VolumeStore> store = open_or_fail(noise(3, {40, 30, 100}));
  std::map<std::string, std::string> facts;
  std::map<std::string, double> parameters;
  std::string peer;
  std::atomic<bool> stop = false;
  int exit_code = -1;
  std::thread server;
};

TEST_F(Service, SaysWhatItHasWeighsItAndSendsIt) {
  const wire::Hello hello = welcome(1);
  EXPECT_EQ(hello.role, "data");
  EXPECT_EQ(hello.facts.at("kind"), "volume");
  EXPECT_EQ(hello.facts.at("scene"), "noise.raw");
  EXPECT_EQ(hello.facts.at("voxels"), "120000");
  EXPECT_EQ(hello.endpoints.at("voxels"), "inproc://voxels");
  EXPECT_EQ(*volume::read_session(hello.parameters, hello.facts), store->session());

  const auto weights = next<wire::SliceWeights>(master);
  ASSERT_TRUE(weights);
  EXPECT_EQ(weights->first.epoch, EpochId{1});
  EXPECT_EQ(weights->first.data, hello.instance);
  ASSERT_EQ(weights->first.voxels.size(), 100u);

  net::Socket sampler(context, net::Kind::kDealer, "sampler", {.max_message_bytes = wire::kMaxBulkBytes});
  ASSERT_TRUE(sampler.connect("inproc://voxels"));
  wire::VoxelRequest request;
  request.epoch = EpochId{2}, request.begin = 10, request.end = 90;
  sampler.send(request);
  EXPECT_FALSE(next<wire::VoxelData>(sampler)->first.known) << "no such epoch yet";

  welcome(2, "100:#ffffff:0, 100:#ffffff:1, 150:#ffffff:1, 150:#ffffff:0");
  const auto again = next<wire::SliceWeights>(master);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->first.epoch, EpochId{2});
  sampler.send_frames({}, wire::VoxelRequest::kName, "nonsense");
  request.end = 500;
  sampler.send(request);  // these slices do not exist
  request.end = 90;
  uint64_t voxels = 0, bytes = 0;
  for (int answers = 0; request.begin < 90; ++answers) {
    ASSERT_LT(answers, 10);
    sampler.send(request);
    const auto got = next<wire::VoxelData>(sampler);
    ASSERT_TRUE(got && got->first.known);
    const wire::VoxelData& d = got->first;
    ASSERT_EQ(d.begin, request.begin);
    const auto decoded = volume::decode_voxels({reinterpret_cast<const uint8_t*>(d.data.data()), d.data.size()}, 40, 30,
                                               int(d.begin), int(d.end), 256);
    ASSERT_TRUE(decoded) << decoded.error().text;
    EXPECT_EQ(decoded->size(), d.voxels);
    for (const uint16_t l : decoded->level) ASSERT_TRUE(l >= 100 && l < 150);
    voxels += d.voxels, bytes += d.data.size();
    request.begin = d.end;
  }
  uint64_t expected = 0;
  for (int k = 10; k < 90; ++k) expected += again->first.voxels[size_t(k)];
  EXPECT_EQ(voxels, expected);

  for (;;) {
    const auto report = next<wire::StatusReport>(master);
    ASSERT_TRUE(report);
    const auto& values = report->first.values;
    if (values.at("voxels_sent") < double(voxels)) continue;  // an earlier second's report
    EXPECT_EQ(values.at("voxels_sent"), double(voxels));
    EXPECT_EQ(values.at("bytes_sent"), double(bytes));
    EXPECT_NEAR(values.at("bytes_per_voxel"), double(bytes) / double(voxels), 1e-9);
    EXPECT_EQ(values.at("requests"), 4);
    EXPECT_EQ(values.at("messages_rejected"), 2);
    break;
  }
  master.send(wire::Shutdown{"enough"}, peer);
  server.join();
  EXPECT_EQ(exit_code, 0);
}

TEST_F(Service, TellsAgainWhatTheScenesNewestEpochWeighs) {
  welcome(1);
  ASSERT_TRUE(next<wire::SliceWeights>(master));
  for (uint64_t epoch = 2; epoch < 40; ++epoch) welcome(epoch);
  for (;;) {
    const auto weights = next<wire::SliceWeights>(master);
    ASSERT_TRUE(weights);
    if (weights->first.epoch == EpochId{39}) break;
  }
}

TEST(DataServer, RefusesAVolumesFlagsWhereThereIsNoVolume) {
  const auto refusal = [](DataServiceOptions o) {
    o.service.name = "data";
    const auto code = run(o);
    EXPECT_FALSE(code);
    return code ? std::string() : code.error().text;
  };
  const std::string mesh = tests::own_folder() + "triangle.off";
  std::ofstream(mesh) << "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  DataServiceOptions julia, file, surface;
  julia.scene = "julia", julia.volume.transfer = "bone";
  file.scene = mesh, file.volume.part = "0/2";
  surface.scene = mesh, surface.mesh.iso = 5, surface.volume.lit = false;
  for (const auto& [text, scene] : {std::pair{refusal(julia), std::string("julia")}, {refusal(file), mesh}}) {
    EXPECT_NE(text.find(scene), std::string::npos) << text;
    EXPECT_NE(text.find("is no volume"), std::string::npos) << text;
  }
  EXPECT_NE(refusal(surface).find("--iso"), std::string::npos);
  julia.volume = {}, julia.mesh.iso = 1;
  EXPECT_NE(refusal(julia).find("--iso"), std::string::npos);
  DataServiceOptions missing;
  missing.scene = "nowhere.raw", missing.volume.raw = "4x4x4:u8";
  EXPECT_NE(refusal(missing).find("nowhere.raw"), std::string::npos);
}

TEST(DataServer, SendsTheChunksOfAMesh) {
  const test::TempFolder folder;
  DataServiceOptions options;
  options.service.name = "data-1", options.service.master = "inproc://master";
  options.service.bind = "inproc://chunks";
  options.scene = folder.write("grid.ply", test::ply_of(test::wavy_grid(20)));
  options.mesh.use_cache = false;
  const auto served = open(options, [](const char*, double) {});
  ASSERT_TRUE(served) << served.error().text;

  net::Context context;
  net::Socket master(context, net::Kind::kRouter, "master");
  ASSERT_TRUE(master.bind("inproc://master"));
  std::atomic<bool> stop = false;
  std::thread server([&] { EXPECT_EQ(serve(context, **served, options.service, [&] { return stop.load(); }), 0); });
  const auto hello = next<wire::Hello>(master);
  net::Socket sampler(context, net::Kind::kDealer, "sampler", {.max_message_bytes = wire::kMaxBulkBytes});
  EXPECT_TRUE(sampler.connect("inproc://chunks"));
  sampler.send(wire::ChunkListRequest{EpochId{3}});
  const auto list = next<wire::ChunkList>(sampler);
  sampler.send(wire::ChunkRequest{EpochId{3}, ChunkId{0}});
  const auto chunk = next<wire::Chunk>(sampler);
  sampler.send(wire::ChunkRequest{EpochId{3}, ChunkId{99}});
  const auto none = next<wire::Chunk>(sampler);
  stop = true;
  server.join();

  ASSERT_TRUE(hello && list && chunk && none);
  EXPECT_EQ(hello->first.facts.at("scene"), "grid.ply");
  EXPECT_EQ(hello->first.facts.at("triangles"), "800");
  EXPECT_EQ(hello->first.endpoints.at("chunks"), "inproc://chunks");
  EXPECT_EQ(list->first.epoch, EpochId{3});
  ASSERT_EQ(list->first.chunks.size(), 1u);
  EXPECT_EQ(chunk->first.data.size(), list->first.chunks[0].bytes);
  EXPECT_TRUE(none->first.data.empty());
}

// A mesh of one chunk, whose content does not matter.
class OneChunk final : public MeshStore {
 public:
  explicit OneChunk(size_t bytes)
      : chunks_{{ChunkId{0}, {{0, 0, 0}, {1, 1, 1}}, 1, bytes}},
        bytes_(std::make_shared<std::vector<std::byte>>(bytes)) {}
  const MeshStoreInfo& info() const override { return info_; }
  const std::vector<geometry::ChunkInfo>& chunks() const override { return chunks_; }
  geometry::ChunkBytes chunk(ChunkId) const override { return {*bytes_, bytes_}; }

 private:
  MeshStoreInfo info_;
  std::vector<geometry::ChunkInfo> chunks_;
  std::shared_ptr<const std::vector<std::byte>> bytes_;
};

// A OneChunk's data server, and its master.
class OneChunkService : public testing::Test {
 protected:
  void start(size_t bytes) {
    options.service.name = "data-1", options.service.master = "inproc://master";
    options.service.bind = "tcp://127.0.0.1:*";
    served = serve_mesh(std::make_shared<OneChunk>(bytes), "one.ply",
                        {.as_begun = std::nullopt, .map = {}, .open = [](const std::string&, const Progress&) {
                           return Result<std::shared_ptr<MeshStore>>(Error{"there is none"});
                         }});
    ASSERT_TRUE(master.bind("inproc://master"));
    server =
        std::thread([this] { EXPECT_EQ(serve(context, *served, options.service, [this] { return stop.load(); }), 0); });
    const auto hello = next<wire::Hello>(master);
    ASSERT_TRUE(hello);
    peer = hello->second.peer;
    endpoint = hello->first.endpoints.at("chunks");
  }
  void TearDown() override {
    stop = true;
    if (server.joinable()) server.join();
  }
  // Welcomes the server and returns a value of its newest report.
  double reported(const std::string& key) {
    master.send(wire::Welcome{.master = InstanceId{5}, .epoch = EpochId{3}}, peer);
    const auto report = next<wire::StatusReport>(master);
    return report && report->first.values.contains(key) ? report->first.values.at(key) : -1;
  }

  net::Context context;
  net::Socket master{context, net::Kind::kRouter, "master"};
  DataServiceOptions options;
  std::unique_ptr<Served> served;
  std::string peer, endpoint;
  std::atomic<bool> stop = false;
  std::thread server;
};

const wire::ChunkRequest kAsk{EpochId{3}, ChunkId{0}};

TEST_F(OneChunkService, AFloodOfRequestsIsDroppedAndCountedAndOthersAreServed) {
  options.service.max_messages = 100;
  start(100);
  net::Socket flooder(context, net::Kind::kDealer, "flooder"), other(context, net::Kind::kDealer, "other");
  ASSERT_TRUE(flooder.connect(endpoint) && other.connect(endpoint));
  constexpr int kFlood = 3000;
  const double begin_s = monotonic_s();
  for (int n = 0; n < kFlood; ++n)
    while (!flooder.send(kAsk)) std::this_thread::yield();
  other.send(kAsk);
  EXPECT_TRUE(next<wire::Chunk>(other)) << "others are served";
  double refused = 0;
  while (refused < kFlood / 2 && monotonic_s() < begin_s + kDeadline_s) refused = reported("messages_refused");
  EXPECT_GE(refused, kFlood / 2);
  EXPECT_LE(refused, kFlood - 200);
}

// A sampler asks for as many chunks at a time as samplers do, as fast as the server answers.
TEST_F(OneChunkService, ASamplerAtFullSpeedLosesNoRequest) {
  start(20'000);
  net::Socket sampler(context, net::Kind::kDealer, "sampler");
  ASSERT_TRUE(sampler.connect(endpoint));
  constexpr int kChunks = 30'000, kAtOnce = 8;
  const double until_s = monotonic_s() + kDeadline_s;
  int asked = 0, got = 0;
  for (; got < kChunks && monotonic_s() < until_s; net::wait_readable({&sampler}, 5)) {
    while (const auto m = sampler.receive()) got += m->type == wire::Chunk::kName;
    for (; asked < std::min(got + kAtOnce, kChunks); ++asked) ASSERT_TRUE(sampler.send(kAsk));
  }
  EXPECT_EQ(got, kChunks);
  EXPECT_EQ(reported("messages_refused"), 0);
  EXPECT_EQ(reported("queue_refused"), 0);
}

// Few megabytes wait for a peer that does not read, for any number of messages.
TEST_F(OneChunkService, AnswersThatNobodyReadsAreDroppedAndCounted) {
  options.service.queue_limit_mb = 4;
  start(1'000'000);
  telesplat::test::RawPeer deaf(endpoint);
  ASSERT_TRUE(deaf.shake_hands("DEALER"));
  const std::string ask = telesplat::test::zmtp_frame(wire::ChunkRequest::kName, true) +
                          telesplat::test::zmtp_frame(wire::encode(kAsk), false);
  for (int n = 0; n < 100; ++n) ASSERT_TRUE(deaf.send(ask));
  double refused = 0;
  for (const double until_s = monotonic_s() + kDeadline_s; refused < 70 && monotonic_s() < until_s;)
    refused = reported("queue_refused");
  EXPECT_GE(refused, 70) << "4 MB wait, and what kernels keep for a connection";
  EXPECT_LE(refused, 96);
}

TEST(DataServer, AFloodOfChunkRequestsQueuesFew) {
  DataServiceOptions options;
  options.service.name = "data-1", options.service.master = "inproc://master";
  options.service.bind = "tcp://127.0.0.1:*";
  const auto served = serve_mesh(std::make_shared<OneChunk>(1 << 20), "large.ply",
                                 {.as_begun = std::nullopt, .map = {}, .open = [](const std::string&, const Progress&) {
                                    return Result<std::shared_ptr<MeshStore>>(Error{"there is none"});
                                  }});
  net::Context context;
  net::Socket master(context, net::Kind::kRouter, "master");
  ASSERT_TRUE(master.bind("inproc://master"));
  std::atomic<bool> stop = false;
  std::thread server([&] { EXPECT_EQ(serve(context, *served, options.service, [&] { return stop.load(); }), 0); });
  const auto hello = next<wire::Hello>(master);
  const net::SocketOptions few{.high_water_mark = 4, .max_message_bytes = wire::kMaxBulkBytes};
  net::Socket flooder(context, net::Kind::kDealer, "flooder", few), other(context, net::Kind::kDealer, "other", few);
  const std::string endpoint = hello ? hello->first.endpoints.at("chunks") : "inproc://nowhere";
  EXPECT_TRUE(flooder.connect(endpoint) && other.connect(endpoint));
  const double before_mb = net::resident_mb();
  // The peer reads none of the answers.
  const double until_s = monotonic_s() + kDeadline_s;
  for (int sent = 0; sent < 1000 && monotonic_s() < until_s;)
    if (flooder.send(wire::ChunkRequest{EpochId{3}, ChunkId{0}}))
      ++sent;
    else
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_LT(monotonic_s(), until_s);
  other.send(wire::ChunkRequest{EpochId{3}, ChunkId{0}});
  EXPECT_TRUE(next<wire::Chunk>(other)) << "others are served";
  EXPECT_LT(net::resident_mb() - before_mb, 100);
  stop = true;
  server.join();
}

// A store whose memory has run out.
class NoMemory final : public VolumeStore {
 public:
  explicit NoMemory(std::shared_ptr<VolumeStore> store) : store_(std::move(store)) {}
  const volume::Session& session() const override { return store_->session(); }
  const volume::Histogram& histogram() const override { return store_->histogram(); }
  std::string format() const override { return store_->format(); }
  std::string remark() const override { return store_->remark(); }
  const scene::Placement& placement() const override { return store_->placement(); }
  uint64_t content_hash() const override { return store_->content_hash(); }
  Result<volume::Voxels> voxels(int, int, int, const volume::LevelSet&, const volume::LevelSet&) override {
    throw std::bad_alloc();
  }
  Result<scene::Probed> cast(int, const volume::TransferFunction&, const geometry::Clip&,
                             const scene::Probe&) override {
    throw std::bad_alloc();
  }
  Result<std::vector<uint32_t>> slice_weights(int, const volume::LevelSet&) override { throw std::bad_alloc(); }

 private:
  std::shared_ptr<VolumeStore> store_;
};

// main() prints the error in one line and ends with code 1: the exception must leave the serve loop.
TEST(DataServer, AnAnswerThatThrowsEndsTheServerInOrder) {
  DataServiceOptions options;
  options.service.name = "data-1", options.service.master = "inproc://master";
  options.service.bind = "inproc://voxels";
  const auto served = serve_volume(std::make_shared<NoMemory>(open_or_fail(noise(3, {40, 30, 100}))), "noise.raw");
  net::Context context;
  net::Socket master(context, net::Kind::kRouter, "master");
  ASSERT_TRUE(master.bind("inproc://master"));
  std::atomic<bool> ended = false, threw = false;
  const double until_s = monotonic_s() + kDeadline_s;
  std::thread server([&] {
    try {
      serve(context, *served, options.service, [&] { return monotonic_s() > until_s; });
    } catch (const std::bad_alloc&) {
      threw = true;
    }
    ended = true;
  });
  const auto hello = next<wire::Hello>(master);
  if (hello) {
    wire::Welcome w;
    w.master = InstanceId{5}, w.epoch = EpochId{1};
    w.facts = hello->first.facts, w.parameters = hello->first.parameters;
    master.send(w, hello->second.peer);
  }
  while (!ended) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  server.join();
  EXPECT_TRUE(hello);
  EXPECT_TRUE(threw);
}

}  // namespace
}  // namespace telesplat::data
