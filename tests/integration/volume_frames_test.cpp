// Frames of a volume over real sockets: two samplers fetch their slabs from a data server and splat leases, the packer
// joins the parts, and a viewer gets the same as by splatting the slabs directly.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "common/core/clock.h"
#include "common/net/dispatch.h"
#include "services/packer/slices/slice_packing.h"
#include "services/sampler/volume/shear/splatter.h"
#include "services/sampler/volume/work.h"
#include "tests/support/keys/lease_key.h"
#include "tests/support/patience.h"
#include "tests/support/volume/slices.h"

namespace telesplat {
namespace {

constexpr double kDeadline_s = test::patient(30);
constexpr int kSide = 32;

volume::Session session() {
  volume::Session s;
  s.grid.size = {kSide, kSide, kSide};
  s.grid.index_to_room = glm::scale(glm::translate(glm::dmat4(1), glm::dvec3(-0.16)), glm::dvec3(0.01));
  s.levels = {0, 1, 64};
  s.range = {0, 63, 0, 63, false};
  s.transfer = *volume::parse_transfer("20:#ff8040:0, 30:#ff8040:0.2, 63:#ffffff:0.6", s.range);
  s.lit = false;
  return s;
}

volume::LevelSet shown(const volume::Session& s) {
  volume::LevelSet out;
  const auto colours = volume::level_colours(s.transfer, s.levels);
  for (size_t l = 0; l < colours.size(); ++l)
    if (colours[l].extinction > 0) out.add(int(l));
  return out;
}

// A ball of values that fall with the distance from the centre.
volume::Voxels voxels(int begin, int end, const volume::LevelSet& show) {
  volume::Voxels v;
  v.k_begin = begin, v.k_end = end;
  v.rows.push_back(0);
  for (int k = begin; k < end; ++k)
    for (int j = 0; j < kSide; ++j) {
      for (int i = 0; i < kSide; ++i) {
        const double c = (kSide - 1) / 2.0;
        const int level = std::max(0, int(63 - 4 * std::hypot(i - c, j - c, k - c)));
        if (show.has(level)) v.i.push_back(uint16_t(i)), v.level.push_back(uint16_t(level));
      }
      v.rows.push_back(uint32_t(v.i.size()));
    }
  return v;
}

TEST(VolumeFrames, AViewerGetsWhatTheSamplersSplat) {
  const auto s = session();
  const auto show = shown(s);
  net::Context context;
  net::Socket data(context, net::Kind::kRouter, "data"),
      tiles(context, net::Kind::kPull, "tiles", {.max_message_bytes = wire::kMaxBulkBytes}),
      state(context, net::Kind::kRouter, "state");
  const auto bind = [](net::Socket& socket) {
    const auto bound = socket.bind("tcp://127.0.0.1:*");
    EXPECT_TRUE(bound);
    return bound ? *bound : "";
  };
  const std::string data_at = bind(data), tiles_at = bind(tiles), state_at = bind(state);
  net::Socket viewer(context, net::Kind::kDealer, "viewer", {.max_message_bytes = wire::kMaxBulkBytes});
  ASSERT_TRUE(viewer.connect(state_at));
  net::Socket control(context, net::Kind::kDealer, "control");
  metrics::SpanRecorder spans;

  wire::Welcome welcome;
  welcome.master = {1};
  welcome.lease_key = test::lease_key();
  welcome.epoch = {1};
  welcome.parameters = volume::to_parameters(s);
  welcome.facts = volume::to_facts(s);
  welcome.facts["kind"] = "volume";

  struct Sampler {
    std::unique_ptr<sampler::VolumeWork> work;
    std::optional<net::Socket> push;
    bool ready = false;
  } samplers[2];
  const int cut[3] = {0, 14, kSide};
  const auto tell = [&](sampler::VolumeWork& work, const auto& m) {
    const auto body = std::make_shared<std::string>(wire::encode(m));
    work.take(control, {"", std::string(m.kName), std::as_bytes(std::span(*body)), body}, true, monotonic_s());
  };
  for (int n = 0; n < 2; ++n) {
    Sampler& one = samplers[n];
    one.work = std::make_unique<sampler::VolumeWork>(
        sampler::make_shear_slabs(1), sampler::VolumeWork::Options{1, uint64_t{1} << 28, "sampler"}, context,
        sampler::VolumeWork::Master{{uint64_t(n) + 1},
                                    [&one](const wire::SlabReady&) { one.ready = true; },
                                    [](const wire::LeaseExtend&) {},
                                    [](double at) { return at; }},
        spans);
    one.push.emplace(context, net::Kind::kPush, "push");
    ASSERT_TRUE(one.push->connect(tiles_at));
    one.work->on_welcome(welcome);
    const uint64_t begin = uint64_t(std::max(cut[n] - 1, 0)), end = uint64_t(std::min(cut[n + 1] + 1, kSide));
    tell(*one.work,
         wire::SlabAssignment{
             1, uint64_t(n), 2, uint64_t(cut[n]), uint64_t(cut[n + 1]), {{uint64_t(n), data_at, begin, end}}});
  }
  std::vector<wire::TileDone> done;
  packer::SlicePacking packing(
      {.tell = [&](const wire::TileDone& m) { done.push_back(m); },
       .to_viewer = [&](std::string_view peer, std::string_view type,
                        std::string body) { return state.send_frames(peer, type, std::move(body)); },
       .master_now = monotonic_s,
       .to_master_s = [](double at) { return at; }},
      spans);
  ASSERT_TRUE(packing.follow(welcome, 0));
  viewer.send(wire::SliceAck{{77}, {0}, 2, false});

  const auto camera = geometry::make_camera({{0.1, 0.05, 0.6}, {1, 0, 0, 0}}, 50, 160, 120);
  wire::SliceLease lease{.frame = {1}, .epoch = {1}, .partition = 1, .slabs = 2};
  lease.shear = *volume::plan_frame(s.grid, std::span(&camera, 1));
  lease.views = {{{77}, {5}, camera, 0}};

  bool leased = false, introduced = false;
  std::optional<net::Message> received;
  for (const double until = monotonic_s() + kDeadline_s; !received && monotonic_s() < until;) {
    std::vector<net::Socket*> sockets{&data, &tiles, &state, &viewer};
    for (auto& one : samplers) {
      one.work->fetch(monotonic_s());
      for (net::Socket* socket : one.work->sockets()) sockets.push_back(socket);
    }
    net::wait_readable(sockets, 5);
    while (const auto message = data.receive())
      net::dispatch<wire::VoxelRequest>(data, *message, [&](const wire::VoxelRequest& r) {
        const auto bytes = volume::encode_voxels(voxels(int(r.begin), int(r.end), show), kSide, kSide);
        wire::VoxelData answer{.epoch = r.epoch, .step = r.step, .begin = r.begin, .end = r.end, .known = true};
        answer.shown = std::as_bytes(show.bytes());
        answer.data = std::as_bytes(std::span(bytes));
        EXPECT_TRUE(data.send(answer, message->peer));
      });
    while (const auto message = tiles.receive())
      net::dispatch<wire::SliceImages>(tiles, *message, [&](const wire::SliceImages& m) {
        EXPECT_TRUE(packing.receive(*message, m, monotonic_s()));
      });
    while (const auto message = state.receive())
      net::dispatch<wire::SliceAck>(state, *message, [&](const wire::SliceAck& m) {
        introduced = true;
        EXPECT_TRUE(packing.acknowledged(message->peer, m, monotonic_s()));
      });
    for (int n = 0; n < 2; ++n) {
      auto& [work, push, ready] = samplers[n];
      work->receive(monotonic_s());
      if (samplers[0].ready && samplers[1].ready && introduced && !leased) {
        for (int slab = 0; slab < 2; ++slab) {
          lease.lease = {uint64_t(slab) + 1}, lease.slab = uint64_t(slab);
          lease.begin = uint64_t(cut[slab]), lease.end = uint64_t(cut[slab + 1]);
          test::seal_lease(lease, {uint64_t(slab) + 1});
          tell(*samplers[slab].work, lease);
        }
        leased = true;
      }
      if (work->leases() > 0 && work->look_at_next(monotonic_s()).state == sampler::Readiness::State::kReady) {
        const auto made = work->sample_next();
        EXPECT_TRUE(push->send_frames({}, made.type, made.body));
      }
    }
    received = viewer.receive();
  }
  ASSERT_TRUE(received);
  const auto frame = viewer.decode<wire::SliceFrame>(*received);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->request.value, 5u);
  EXPECT_EQ(frame->slabs, 2u);
  ASSERT_EQ(done.size(), 2u);
  EXPECT_EQ(done[1].bytes_sent, frame->data.size());

  // Splats each slab's voxels directly for comparison.
  const auto slices = volume::parse_slices({reinterpret_cast<const uint8_t*>(frame->data.data()), frame->data.size()},
                                           lease.shear.width, lease.shear.height, int(lease.shear.layers.size()));
  ASSERT_TRUE(slices) << slices.error().text;
  const auto colours = volume::level_colours(s.transfer, s.levels);
  const auto make = sampler::make_shear_slabs(1);
  size_t compared = 0, covered = 0;
  for (int n = 0; n < 2; ++n) {
    const int begin = std::max(cut[n] - 1, 0), end = std::min(cut[n + 1] + 1, kSide);
    uint64_t count = 0;
    for (const auto& expected :
         make(s.grid, voxels(begin, end, show))->splat(colours, lease.shear, cut[n], cut[n + 1], {}, count)) {
      const auto slice = std::find_if(slices->begin(), slices->end(), [&](const auto& e) {
        return e.layer == expected.layer && e.k_begin == expected.k_begin;
      });
      ASSERT_NE(slice, slices->end()) << "layer " << expected.layer << " of slab " << n;
      const auto image = volume::decode_slice(*slice, lease.shear.width, lease.shear.height);
      ASSERT_TRUE(image);
      ++compared;
      const auto& r = expected.rect;
      for (int y = 0; y < r.height; ++y)
        for (int x = 0; x < r.width; ++x) {
          const uint32_t pixel = expected.pixels[size_t(y) * size_t(r.width) + size_t(x)];
          if (pixel == 0) continue;
          ++covered;
          const int ix = r.x + x - image->rect.x, iy = r.y + y - image->rect.y;
          ASSERT_TRUE(ix >= 0 && iy >= 0 && ix < image->rect.width && iy < image->rect.height);
          ASSERT_EQ(image->pixels[size_t(iy) * size_t(image->rect.width) + size_t(ix)], pixel);
        }
    }
  }
  EXPECT_EQ(compared, slices->size());
  EXPECT_GT(covered, 1000u);
}

}  // namespace
}  // namespace telesplat
