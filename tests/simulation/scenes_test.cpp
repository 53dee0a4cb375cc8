// Scenes of simulated sessions: what the real services need of them, and that they are the same everywhere.
#include <gtest/gtest.h>

#include "common/geometry/chunk_code.h"
#include "common/image/normal.h"
#include "common/volume/session.h"
#include "common/volume/shear.h"
#include "common/volume/voxels.h"
#include "services/sampler/julia/sampler.h"
#include "services/sampler/mesh/tiles.h"
#include "services/sampler/volume/shear/splatter.h"
#include "tests/support/patience.h"
#include "tests/support/simd_targets.h"
#include "tools/lab/simulation/scenes/fields.h"
#include "tools/lab/simulation/scenes/surface.h"
#include "tools/lab/simulation/scenes/surface_parts.h"

namespace telesplat::simulation {
namespace {

constexpr int kWidth = 128, kHeight = 96;
constexpr geometry::Rect kAll{0, 0, kWidth, kHeight};

// Turned by few degrees about y, without a tangent of an angle.
geometry::Camera camera_at(const glm::dvec3& position, double turn = 0) {
  const double w = 1 / std::sqrt(1 + turn * turn);
  return {.pose = {position, {w, 0, turn * w, 0}},
          .left = -0.5,
          .right = 0.5,
          .bottom = -0.375,
          .top = 0.375,
          .width = kWidth,
          .height = kHeight};
}

// FNV-1a.
struct Digest {
  uint64_t value = 0xcbf29ce484222325;
  void add(uint64_t v) { value = (value ^ v) * 0x100000001b3; }
  void add(const image::DepthImage& image) {
    for (size_t i = 0; i < image.pixels(); ++i) add(image.depth[i]), add(image.colour[i]), add(image.normal[i]);
  }
};

class Surfaces : public ::testing::TestWithParam<Surface> {
 protected:
  static geometry::ChunkBytes chunk(size_t id) { return {parts_of(GetParam()).bytes[id], nullptr}; }
  static size_t chunks() { return parts_of(GetParam()).chunks.size() - 1; }  // without the root
  std::unique_ptr<sampler::Sampler> full() const {
    auto out = sample_surface(GetParam());
    for (size_t id = 0; id < chunks(); ++id) EXPECT_TRUE(out->add_chunk({id}, chunk(id)));
    return out;
  }
  const geometry::Camera camera = camera_at({0.05, 0.12, 1.0}, 0.02);
};
INSTANTIATE_TEST_SUITE_P(All, Surfaces, ::testing::Values(Surface::kSpheres, Surface::kTerrain, Surface::kFence));

// The welcome of a session after this data server has said hello.
wire::Welcome welcome_of(const data::Served& served) {
  wire::Hello hello;
  served.describe(hello);
  wire::Welcome out;
  out.master = {7};
  out.epoch = {1};
  out.facts = hello.facts;
  out.facts["kind"] = std::string(scene::name_of(served.kind()));
  out.parameters = hello.parameters;
  out.box_room = hello.box_room;
  return out;
}

size_t covered(const image::DepthImage& image) {
  return size_t(std::count_if(image.depth.begin(), image.depth.end(), [](uint32_t d) { return d != 0; }));
}

TEST_P(Surfaces, ChunksValidateAndTheirBoxesAreThoseOfTheList) {
  const SurfaceParts& surface = parts_of(GetParam());
  EXPECT_GE(chunks(), 4u);
  EXPECT_LE(chunks(), 12u);
  for (const geometry::ChunkInfo& info : surface.chunks) {
    const auto chunk = geometry::decode_chunk(surface.bytes[size_t(info.id.value)]);
    ASSERT_TRUE(chunk) << chunk.error().text;
    EXPECT_EQ(chunk->view.box_room, info.box_room);
    EXPECT_EQ(chunk->view.triangles(), info.triangles);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_GE(info.box_room.lo[axis], -0.401f);
      EXPECT_LE(info.box_room.hi[axis], 0.401f);
    }
  }
}

TEST_P(Surfaces, TheDataServerTellsOfTheMesh) {
  const auto served = serve_surface(GetParam());
  EXPECT_EQ(served->kind(), scene::Kind::kMesh);
  EXPECT_EQ(served->requests().endpoint, "chunks");
  wire::Hello hello;
  served->describe(hello);
  EXPECT_EQ(hello.facts.at("primitives"), std::to_string(parts_of(GetParam()).triangles));
  EXPECT_EQ(hello.facts.at("content_hash").size(), 16u);
  EXPECT_EQ(hello.box_room, parts_of(GetParam()).box_room);
  EXPECT_TRUE(served->notes().empty());
  EXPECT_FALSE(served->busy());
}

// However little memory it has, a sampler gets all chunks of a tile.
TEST_P(Surfaces, TilesFetchTheirChunksFromTheDataServer) {
  net::Context context;
  net::Socket requests(context, net::Kind::kRouter, "requests"), master(context, net::Kind::kDealer, "master");
  net::MasterLink link(context, "inproc://nobody", {});
  metrics::SpanRecorder spans;
  const auto endpoint = requests.bind("tcp://127.0.0.1:*");
  ASSERT_TRUE(endpoint);
  const auto served = serve_surface(GetParam());
  wire::Welcome session = welcome_of(*served);
  session.endpoints["chunks"] = *endpoint;
  for (const uint64_t budget_bytes : {uint64_t{1} << 20, uint64_t{1}}) {
    sampler::MeshTiles tiles(sample_surface(GetParam()), budget_bytes, "sampler", context, link, spans);
    tiles.on_welcome(session);
    for (const geometry::Rect& tile : {geometry::Rect{0, 0, 64, 48}, {64, 48, 64, 48}, {64, 0, 64, 48}}) {
      sampler::HeldLease lease;
      lease.lease.epoch = session.epoch, lease.lease.camera = camera, lease.lease.rect = tile;
      const double until_s = monotonic_s() + test::patient(20);
      const auto fine = [&] {
        const bool ready = tiles.readiness(lease, monotonic_s()).state == sampler::Readiness::State::kReady;
        return ready && !tiles.sample(lease).coarse;
      };
      while (!fine()) {
        ASSERT_LT(monotonic_s(), until_s);
        tiles.fetch(&lease, monotonic_s());
        std::vector<net::Socket*> sockets = tiles.sockets();
        sockets.push_back(&requests);
        net::wait_readable(sockets, 5);
        while (const auto request = requests.receive()) served->answer(*request, {requests, master});
        tiles.receive();
      }
      EXPECT_EQ(tiles.sample(lease).image, full()->sample(camera, tile));
    }
  }
}

TEST_P(Surfaces, ImagesAreCanonicalAndFaceTheEye) {
  const auto image = full()->sample(camera, kAll);
  EXPECT_GT(covered(image), image.pixels() / 4);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const size_t at = size_t(y) * kWidth + size_t(x);
      if (image.depth[at] == 0) {
        EXPECT_EQ(image.colour[at], 0u);
        EXPECT_EQ(image.normal[at], 0u);
        continue;
      }
      EXPECT_EQ(image.normal[at], image::canonical_normal16(image.normal[at]));
      const glm::dvec3 ray = camera.unproject(x + 0.5, y + 0.5, 1) - camera.pose.position_room;
      EXPECT_LT(glm::dot(glm::dvec3(image::decode_normal16(image.normal[at])), ray), 0.03) << x << " " << y;
    }
}

TEST_P(Surfaces, APixelDoesNotDependOnItsTileNorOnTheMask) {
  const auto sampler = full();
  const auto all = sampler->sample(camera, kAll);
  for (const geometry::Rect& tile : {geometry::Rect{0, 0, 64, 48}, {64, 48, 64, 48}, {37, 21, 31, 17}}) {
    image::PixelMask mask(tile.width, tile.height);
    for (int y = 0; y < tile.height; ++y)
      for (int x = (y * 7) % 5; x < tile.width; x += 5) mask.set(x, y);
    const auto whole = sampler->sample(camera, tile), some = sampler->sample(camera, tile, &mask);
    for (int y = 0; y < tile.height; ++y)
      for (int x = 0; x < tile.width; ++x) {
        const size_t at = size_t(y) * size_t(tile.width) + size_t(x),
                     from = size_t(tile.y + y) * kWidth + size_t(tile.x + x);
        ASSERT_EQ(whole.depth[at], all.depth[from]);
        ASSERT_EQ(whole.colour[at], all.colour[from]);
        ASSERT_EQ(whole.normal[at], all.normal[from]);
        ASSERT_EQ(some.depth[at], mask.at(x, y) ? all.depth[from] : 0);
      }
  }
}

TEST_P(Surfaces, WhatAMissingChunkHoldsIsEmpty) {
  const auto sampler = full();
  const auto all = sampler->sample(camera, kAll);
  size_t lost = 0;
  for (size_t id = 0; id < chunks(); ++id) {
    sampler->remove_chunk({id});
    const auto without = sampler->sample(camera, kAll);
    for (size_t i = 0; i < all.pixels(); ++i) {
      ASSERT_TRUE(without.depth[i] == all.depth[i] || without.depth[i] == 0) << "what lies behind must not show";
      lost += without.depth[i] != all.depth[i];
    }
    ASSERT_TRUE(sampler->add_chunk({id}, chunk((id + 1) % chunks())));
    EXPECT_EQ(sampler->sample(camera, kAll), without) << "bytes of another chunk are not this one";
    ASSERT_TRUE(sampler->add_chunk({id}, chunk(id)));
  }
  EXPECT_EQ(lost, covered(all)) << "each pixel belongs to one chunk";
}

TEST_P(Surfaces, RefusesDamagedChunks) {
  auto bytes = parts_of(GetParam()).bytes[0];
  bytes[0] = std::byte{0};
  const auto sampler = sample_surface(GetParam());
  EXPECT_FALSE(sampler->add_chunk({0}, {bytes, nullptr}));
  EXPECT_EQ(covered(sampler->sample(camera, kAll)), 0u);
}

// A view that needs a hit's chunk must find it in the frustum.
TEST_P(Surfaces, ChunksHoldTheHits) {
  const auto image = full()->sample(camera, kAll);
  for (size_t i = 0; i < image.pixels(); ++i) {
    if (image.depth[i] == 0) continue;
    const glm::vec3 p(camera.unproject(double(i % kWidth) + 0.5, double(i / kWidth) + 0.5,
                                       image::decode_depth(image.depth[i], camera.near_m)));
    const auto& all = parts_of(GetParam()).chunks;
    EXPECT_TRUE(std::any_of(all.begin(), all.end(), [&](const geometry::ChunkInfo& c) {
      return glm::all(glm::greaterThan(p, c.box_room.lo - 1e-4f)) && glm::all(glm::lessThan(p, c.box_room.hi + 1e-4f));
    }));
  }
}

TEST_P(Surfaces, AClipShowsWhatLayBehindIt) {
  const auto sampler = full();
  const auto all = sampler->sample(camera, kAll);
  geometry::Clip clip{{{{0, 0, -1}, 0.0}}};  // keeps z <= 0
  sampler->set_clip(clip);
  const auto cut = sampler->sample(camera, kAll);
  size_t uncovered = 0;
  for (size_t i = 0; i < all.pixels(); ++i) {
    if (cut.depth[i] == 0) continue;
    const glm::dvec3 p = camera.unproject(double(i % kWidth) + 0.5, double(i / kWidth) + 0.5,
                                          image::decode_depth(cut.depth[i], camera.near_m));
    EXPECT_LE(p.z, 1e-5);
    uncovered += cut.depth[i] < all.depth[i];
  }
  EXPECT_GT(uncovered, 50u);
  const auto truth = render_surface(GetParam(), camera, {{}, camera}, clip);
  for (size_t i = 0; i < all.pixels(); ++i) EXPECT_EQ(cut.depth[i] == 0, std::isinf(truth.depth_m[i]));
  sampler->set_clip({});
  EXPECT_EQ(sampler->sample(camera, kAll), all);
}

TEST_P(Surfaces, TheTruthIsTheSampleShaded) {
  const auto image = full()->sample(camera, kAll);
  const image::Shading shading({}, camera);
  const auto truth = render_surface(GetParam(), camera, shading);
  for (size_t i = 0; i < image.pixels(); ++i) {
    if (image.depth[i] == 0) {
      ASSERT_EQ(truth.colour[i], shading.background());
      ASSERT_TRUE(std::isinf(truth.depth_m[i]));
      continue;
    }
    ASSERT_NEAR(image::decode_depth(image.depth[i], camera.near_m) / double(truth.depth_m[i]), 1, 1e-5);
    const uint32_t shaded = image::Shading::apply(image.colour[i], shading.table()[image.normal[i]]);
    for (const int shift : {0, 8, 16})
      ASSERT_NEAR(int(shaded >> shift & 255), int(truth.colour[i] >> shift & 255), 6) << i;
  }
}

TEST_P(Surfaces, BitsAreTheSameOnEveryMachine) {
  Digest digest;
  const auto sampler = full();
  for (const double z : {0.6, 0.9, 1.3}) {
    const auto view = camera_at({0.3 - 0.2 * z, 0.1 * z, z}, 0.1 * z - 0.08);
    digest.add(sampler->sample(view, kAll));
    for (const uint32_t c : render_surface(GetParam(), view, {{}, view}).colour) digest.add(c);
  }
  constexpr uint64_t kExpected[] = {6059239088662779875u, 12420893594646991378u, 16416144061803486836u};
  EXPECT_EQ(digest.value, kExpected[size_t(GetParam())]);
}

TEST(JuliaSet, IsTheSameOnEveryTargetAndMachine) {
  const auto served = serve_julia_set();
  const wire::Welcome session = welcome_of(*served);
  const auto parameters = julia::from_map(session.parameters);
  const auto placement = julia::placement_from_map(session.parameters, session.box_room);
  ASSERT_TRUE(parameters && placement);
  const sampler::JuliaScene scene(*parameters, *placement);
  for (const int64_t target : testing::simd_targets()) {
    const testing::OnTarget on(target);
    Digest digest;
    size_t pixels = 0;
    for (const double z : {0.6, 1.0, 1.6}) {
      const auto image = sampler::JuliaSampler(1).sample(scene, camera_at({0.1 * z, 0.1, z}, 0.03), kAll, 1);
      digest.add(image);
      pixels += covered(image);
    }
    EXPECT_EQ(digest.value, 18053867813431576254u) << hwy::TargetName(target);
    EXPECT_GT(pixels, 10000u);
  }
}

TEST(BallVolume, AnswersInTheCallersTurnsAndIsTheSameOnEveryTargetAndMachine) {
  const auto served = serve_ball_volume();
  net::Context context;
  net::Socket requests(context, net::Kind::kRouter, "requests"), session(context, net::Kind::kRouter, "session"),
      master(context, net::Kind::kDealer, "master"), asker(context, net::Kind::kDealer, "asker");
  const auto asked = requests.bind("tcp://127.0.0.1:*"), told = session.bind("tcp://127.0.0.1:*");
  ASSERT_TRUE(asked && told && asker.connect(*asked) && master.connect(*told));
  const data::Outlets outlets{requests, master};

  served->begin({5});
  EXPECT_FALSE(served->busy());
  const wire::Welcome welcome = welcome_of(*served);
  ASSERT_TRUE(served->follow(welcome));
  ASSERT_TRUE(served->busy());
  served->send_finished(outlets);
  EXPECT_FALSE(served->busy());
  ASSERT_TRUE(net::wait_readable({&session}, 20'000));
  const auto weights_message = session.receive();
  const auto weights = wire::decode<wire::SliceWeights>(weights_message->body);
  ASSERT_TRUE(weights);
  ASSERT_EQ(weights->voxels.size(), 32u);
  EXPECT_GT(weights->voxels[16], 400u);

  asker.send(wire::VoxelRequest{.epoch = {1}, .step = 0, .begin = 0, .end = 32});
  ASSERT_TRUE(net::wait_readable({&requests}, 20'000));
  served->answer(*requests.receive(), outlets);
  ASSERT_TRUE(served->busy());
  served->send_finished(outlets);
  ASSERT_TRUE(net::wait_readable({&asker}, 20'000));
  const auto answer = asker.receive();
  const auto data = wire::decode<wire::VoxelData>(answer->body);
  ASSERT_TRUE(data && data->known);
  EXPECT_EQ(data->end, 32u);

  const auto scene = volume::read_session(welcome.parameters, welcome.facts);
  ASSERT_TRUE(scene);
  const auto voxels = volume::decode_voxels({reinterpret_cast<const uint8_t*>(data->data.data()), data->data.size()},
                                            32, 32, 0, 32, scene->levels.count);
  ASSERT_TRUE(voxels);
  const auto camera = camera_at({0.1, 0.1, 1.0}, 0.03);
  const auto frame = volume::plan_frame(scene->grid, std::span(&camera, 1));
  ASSERT_TRUE(frame);
  const auto slab = sampler::make_shear_slabs(1)(scene->grid, *voxels);
  for (const int64_t target : testing::simd_targets()) {
    const testing::OnTarget on(target);
    Digest digest;
    uint64_t splatted = 0;
    for (const auto& image :
         slab->splat(volume::level_colours(scene->transfer, scene->levels), *frame, 0, 32, {}, splatted))
      for (const uint32_t pixel : image.pixels) digest.add(pixel);
    EXPECT_GT(splatted, 5000u);
    EXPECT_EQ(digest.value, 4505414584431123979u) << hwy::TargetName(target);
  }
}

}  // namespace
}  // namespace telesplat::simulation
