// `telesplat bench steering`: its sessions, clock, tables and pictures, on a scene that is known in closed form.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "tests/support/points_scenes.h"
#include "tools/telesplat/bench/steering/comparison.h"
#include "tools/telesplat/bench/steering/pictures.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

// The ball above the floor of the packer's tests.
class MadeScene : public DirectScene {
 public:
  using DirectScene::draw;
  Result<image::View> draw(const geometry::Camera& camera, const image::ShadingParameters& shading, EpochId,
                           double) override {
    const image::DepthImage sampled = test::sample_scene(camera, {0, 0, camera.width, camera.height});
    const image::Shading shade(shading, camera);
    image::View view{camera.width, camera.height, std::vector<uint32_t>(sampled.pixels(), shade.background()),
                     std::vector<float>(sampled.pixels(), INFINITY)};
    for (size_t i = 0; i < sampled.pixels(); ++i) {
      if (sampled.depth[i] == 0) continue;
      view.depth_m[i] = float(image::decode_depth(sampled.depth[i], camera.near_m));
      view.colour[i] = sampled.colour[i];
    }
    return view;
  }
  Result<image::DepthImage> sample_tile(const geometry::Camera& camera, const geometry::Rect& tile,
                                        const image::PixelMask* mask, EpochId, double) override {
    image::DepthImage out = test::sample_scene(camera, tile);
    for (int y = 0; y < tile.height; ++y)
      for (int x = 0; x < tile.width; ++x) {
        const size_t at = size_t(y) * tile.width + x;
        if (mask && !mask->at(x, y)) out.depth[at] = out.colour[at] = out.normal[at] = 0;
        casts += !mask || mask->at(x, y);
      }
    return out;
  }
  geometry::Box box_room() const override { return test::scene_config().box_room; }
  std::string size() const override { return "a ball"; }
  uint64_t casts = 0;
};

SteeredSessionConfig session_config(bool steering) {
  SteeredSessionConfig c;
  c.name = steering ? "on" : "off";
  c.steering = steering;
  c.plan.model = test::scene_config();
  return c;
}

geometry::Camera camera_at(double x) {
  return geometry::make_camera(geometry::look_at({x, 0.3, 0.8}, {0, 0, 0}), 70, 160, 120);
}

TEST(SteeredSession, CountsEveryRayThatIsCast) {
  MadeScene scene;
  for (const bool steering : {false, true}) {
    SteeredSession session(session_config(steering), scene);
    scene.casts = 0;
    uint64_t told = 0;
    for (const double x : {0.0, 0.01, 0.01}) {
      const auto cost = session.view(x, camera_at(x), 0, nullptr);
      ASSERT_TRUE(cost.ok()) << cost.error().text;
      told += cost->rays;
      EXPECT_EQ(cost->rays, session.cast().count());
      EXPECT_EQ(cost->rays_full, 160u * 120u);
    }
    EXPECT_EQ(told, scene.casts);
    if (steering) {
      EXPECT_LT(told, 2u * 160 * 120) << "the first view whole, the others by their plans";
    } else {
      EXPECT_EQ(told, 3u * 160 * 120);
    }
  }
}

TEST(SteeredSession, AnAuditCountsWhatAPlanMissesAndCastsInVain) {
  MadeScene scene;
  SteeredSession off(session_config(false), scene), on(session_config(true), scene);
  for (const double x : {0.0, 0.05}) {
    const image::DepthImage whole = *scene.sample(camera_at(x), EpochId{1});
    for (SteeredSession* session : {&off, &on}) {
      const auto cost = session->view(x, camera_at(x), 0, &whole);
      ASSERT_TRUE(cost.ok());
      EXPECT_EQ(cost->needed, session->needed().count());
      EXPECT_GT(cost->needed, 0u);
      EXPECT_EQ(cost->rays, cost->needed - cost->missed + cost->vain);
      if (session == &off) EXPECT_EQ(cost->missed, 0u);
    }
  }
}

TEST(SteeredSession, OfAStillViewNothingIsLeftToCastAtLast) {
  MadeScene scene;
  SteeredSession session(session_config(true), scene);
  EXPECT_TRUE(session.exhausted()) << "nothing was asked for yet";
  for (int i = 0; i < 2; ++i) ASSERT_TRUE(session.view(i, camera_at(0), 0, nullptr).ok());
  EXPECT_FALSE(session.exhausted());
  uint64_t rays = 0;
  for (int i = 0; i < 300 && !session.exhausted(); ++i) {
    const auto cost = session.extra(2 + i, 20000);
    ASSERT_TRUE(cost.ok());
    rays += cost->rays;
  }
  EXPECT_TRUE(session.exhausted());
  EXPECT_GT(rays, 0u);
}

TEST(SteeredSession, DrawsWhatItHasSampled) {
  MadeScene scene;
  SteeredSession session(session_config(true), scene);
  ASSERT_TRUE(session.view(0, camera_at(0), 0, nullptr).ok());
  const image::View plain = session.draw(camera_at(0), false);
  const auto truth = scene.draw(camera_at(0), {}, EpochId{1});
  size_t shown = 0, there = 0;
  for (size_t i = 0; i < plain.depth_m.size(); ++i) {
    shown += plain.depth_m[i] < INFINITY, there += truth->depth_m[i] < INFINITY;
  }
  EXPECT_NEAR(double(shown), double(there), 0.05 * double(there));
  const image::View refined = session.draw(camera_at(0), true);
  EXPECT_EQ(refined.colour.size(), plain.colour.size());
}

TimingConfig timing(double latency_s) {
  TimingConfig out;
  out.cores = 0, out.latency_s = latency_s;
  out.requests.sampling_width = 160, out.requests.sampling_height = 120;
  return out;
}

TEST(TimedSession, ViewsTakeAsLongAsTheyAreTold) {
  MadeScene scene;
  TimedSession session(std::make_unique<SteeredSession>(session_config(true), scene), timing(0.2), {});
  for (int i = 0; i < 120; ++i) ASSERT_TRUE(session.display(i / 60.0, camera_at(0.001 * i)).ok());
  const auto& views = session.views();
  ASSERT_GT(views.size(), 5u);
  EXPECT_LE(views.size(), 10u) << "in two seconds";
  for (size_t i = 0; i < views.size(); ++i) {
    EXPECT_NEAR(views[i].complete_s - views[i].t_s, 0.2, 1e-9);
    EXPECT_GE(views[i].t_s, views[i].requested_s - 1e-9);
    if (i > 0) EXPECT_GE(views[i].t_s, views[i - 1].complete_s - 1e-9) << "one after the other";
  }
}

TEST(TimedSession, ExtraFramesFillTheTimeBetweenViewsAndCountApart) {
  MadeScene scene;
  TimedSession session(std::make_unique<SteeredSession>(session_config(true), scene), timing(0.02), {});
  for (int i = 0; i < 180; ++i) ASSERT_TRUE(session.display(i / 60.0, camera_at(0)).ok());
  uint64_t rays = 0, extra = 0, frames = 0;
  for (const ViewCost& v : session.views()) rays += v.rays, extra += v.extra_rays, frames += v.extra_frames;
  EXPECT_GT(frames, 0u);
  EXPECT_GT(extra, 0u);
  EXPECT_EQ(rays + extra, scene.casts);
  EXPECT_TRUE(session.session().exhausted());
}

TEST(SteeringComparison, WalksWithAndWithoutSteering) {
  const std::string folder = (fs::temp_directory_path() / "telesplat-steering-test").string();
  fs::remove_all(folder);
  fs::create_directories(folder);
  MadeScene scene;
  SteeringBenchOptions o;
  o.duration_s = 1, o.hold_s = 0.3, o.modes = "off,on", o.reference_samples = 4, o.compare_every_s = 0.4;
  o.pictures = 1, o.out = folder, o.audit = true, o.threads = 2;
  const auto walk = Walk::open("orbit");
  ASSERT_TRUE(walk.ok());
  SteeringComparison comparison(o, "made ball.ply", scene, *walk, {160, 120}, timing(0.05));
  const auto reports = comparison.run([](double, double) {});
  ASSERT_TRUE(reports.ok()) << reports.error().text;
  ASSERT_EQ(reports->size(), 2u);
  uint64_t rays[2] = {};
  for (int i = 0; i < 2; ++i) {
    const ModeReport& r = (*reports)[size_t(i)];
    EXPECT_EQ(r.mode, i == 0 ? "off" : "on");
    EXPECT_GE(r.quality.size(), 2u);
    for (const ViewCost& v : r.views) rays[i] += v.rays;
  }
  EXPECT_LT(rays[1], rays[0] / 2);
  ASSERT_TRUE(write_report(*reports, folder).ok());
  for (const char* name : {"steering-views.csv", "steering-quality.csv", "steering-table.txt",
                           "made-ball-off-00.50s.png", "made-ball-on-00.50s.png", "made-ball-still-0.2s.png"})
    EXPECT_TRUE(fs::exists(folder + "/" + name)) << name;
  fs::remove_all(folder);
}

TEST(SteeringReport, SaysSharesOfTheFirstMode) {
  ModeReport off{"scene", "off", {}, {}}, on{"scene", "on", {}, {}};
  for (int i = 0; i < 4; ++i) {
    ViewCost v;
    v.t_s = v.requested_s = i, v.complete_s = i + 0.1;
    v.rays_full = v.rays = 1000, v.bytes = 5000, v.sample_cpu_ms = 8;
    off.views.push_back(v);
    v.rays = 100, v.extra_rays = 50, v.bytes = 1000, v.sample_cpu_ms = 2;
    v.figures["rays.edge"] = 20;
    on.views.push_back(v);
  }
  const std::string text = to_markdown({off, on});
  EXPECT_NE(text.find("| scene | off | 1.000 | 0.000 | 1.000 | 1.000 |"), std::string::npos) << text;
  EXPECT_NE(text.find("| scene | on | 0.100 | 0.050 | 0.200 | 0.250 |"), std::string::npos) << text;
  EXPECT_NE(text.find("| scene | on | 2.00 |"), std::string::npos) << text;
  EXPECT_NE(text.find(" 100 | 1.0 |"), std::string::npos) << "latency and rate: " << text;
}

TEST(SteeringPictures, TellWhatWasCastAndWhatWasLacked) {
  const image::View truth{4, 1, {0x808080, 0x808080, 0x808080, 0x808080}, {}};
  image::PixelMask cast(4, 1), needed(4, 1);
  cast.set(0, 0), cast.set(1, 0);
  needed.set(0, 0), needed.set(2, 0);
  const image::View picture = cast_picture(truth, cast, needed);
  EXPECT_EQ(picture.colour[0], 0xffffffu);
  EXPECT_EQ(picture.colour[1], 0xff3030u);
  EXPECT_EQ(picture.colour[2], 0x30a0ffu);
  EXPECT_NE(picture.colour[3], 0u) << "the scene, darker";
  const image::View unknown = cast_picture(truth, cast, {});
  EXPECT_EQ(unknown.colour[1], 0xffffffu);
  EXPECT_EQ(unknown.colour[2], unknown.colour[3]);
  EXPECT_EQ(file_stem("/a/b c.d.ply"), "b-c.d");
}

TEST(SteeringModes, AreNamed) {
  EXPECT_TRUE(check_modes("off,on,no-cell").ok());
  EXPECT_NE(check_modes("off,of").error().text.find("of is none"), std::string::npos);
  EXPECT_FALSE(check_modes("").ok());
}

TEST(BenchWalks, GoRoundAndRefuseWhatTakesNoTime) {
  const auto walk = Walk::open("orbit,orbit");
  ASSERT_TRUE(walk.ok());
  EXPECT_EQ(walk->length_s(), 40);
  EXPECT_LT(glm::length(walk->at(3).position_room - walk->at(43).position_room), 1e-9);
  EXPECT_FALSE(Walk::open("/nowhere.csv").ok());
  EXPECT_FALSE(Walk::open("").ok());
}

}  // namespace
}  // namespace telesplat::launcher
