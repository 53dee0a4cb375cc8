// The viewer's flags and the columns of its tables.
#include <gtest/gtest.h>

#include <fstream>

#include <algorithm>

#include "client/viewer/coupling/stage_table.h"
#include "client/viewer/display/frame_table.h"
#include "client/viewer/viewer_options.h"
#include "services/master/record/measured.h"
#include "tests/support/files/own_folder.h"

namespace telesplat::viewer {
namespace {

using Texts = std::vector<std::string>;

Texts names_of(const options::Table& table, auto&& which) {
  Texts out;
  for (const auto& row : table)
    if (which(row)) out.push_back(options::name_of(row));
  return out;
}

TEST(ViewerFlags, ThoseOfPointsFitMeshesAndJuliaSetsAlone) {
  ViewerOptions o;
  const auto points = names_of(table(o), [](const options::Row& r) { return !r.fits.has(scene::Kind::kVolume); });
  EXPECT_EQ(points, (Texts{"--detail-budget", "--least-detail", "--speed-detail", "--splat", "--splat-scale",
                           "--finish", "--still-samples"}));
}

TEST(ViewerFlags, WhatAPictureDependsOnIsRecorded) {
  ViewerOptions o;
  const auto recorded =
      names_of(view_table(o), [](const options::Row& r) { return r.reach == options::Reach::kRecorded; });
  EXPECT_EQ(recorded, (Texts{"--size", "--fov", "--near", "--background", "--shading", "--legend", "--stereo",
                             "--eye-separation", "--screen-distance", "--swap-eyes", "--barrier", "--stereo-pattern"}));
}

TEST(ViewerFlags, StillPicturesHaveOneFourOrSixteenSamples) {
  for (const auto& [text, samples] : {std::pair{"1", 1}, {"4", 4}, {"16", 16}}) {
    ViewerOptions o;
    o.drawing.still_samples = text;
    ASSERT_TRUE(settle(o).ok());
    EXPECT_EQ(o.display.still_samples, samples);
  }
}

TEST(ViewerFlags, SayWhatDiffersAndReadItBack) {
  ViewerOptions usual, o;
  EXPECT_EQ(options::arguments(table(o), table(usual)), Texts{}) << "what nobody gave is not passed on";
  o.size = "640x400";
  o.least_sampling = 0.4;
  o.display.detail.by_budget = false;
  o.display.kept.exr = true;
  o.coupling.buffers = 5;
  const auto arguments = options::arguments(table(o), table(usual));
  EXPECT_EQ(arguments,
            (Texts{"--size=640x400", "--least-sampling=0.4", "--detail-budget=off", "--buffers=5", "--exr"}));
  const auto again = table(usual);
  for (const auto& argument : arguments) {
    const size_t equals = argument.find('=');
    const auto* row = options::find(again, argument.substr(0, equals));
    ASSERT_NE(row, nullptr) << argument;
    EXPECT_TRUE(options::set(*row, equals == std::string::npos ? "true" : argument.substr(equals + 1)).ok());
  }
  EXPECT_EQ(usual.least_sampling, 0.4);
  EXPECT_EQ(options::arguments(table(o), table(usual)), Texts{});
}

TEST(ViewerFlags, HaveLimits) {
  ViewerOptions o;
  const auto rows = table(o);
  for (const auto& [flag, text] : {std::pair{"--least-sampling", "0.05"},
                                   {"--least-sampling", "nan"},
                                   {"--fov", "171"},
                                   {"--fov", "nan"},
                                   {"--near", "nan"},
                                   {"--hold", "nan"},
                                   {"--duration", "nan"},
                                   {"--duration", "inf"},
                                   {"--target-fps", "nan"},
                                   {"--clock-from", "nan"},
                                   {"--frames", "-1"},
                                   {"--frames", "99999999999999999999"},
                                   {"--record-every", "-1"},
                                   {"--record-points", "-1"},
                                   {"--verify", "-1"},
                                   {"--buffers", "9"},
                                   {"--finish", "fill,shine"},
                                   {"--shading", "dim"},
                                   {"--splat", "cube"},
                                   {"--record-points", "1048577"},
                                   {"--coupling", "tight"},
                                   {"--detail-budget", "yes"}})
    EXPECT_FALSE(options::set(*options::find(rows, flag), text).ok()) << flag << " " << text;
}

TEST(ViewerFlags, AreSettledOrRefused) {
  ViewerOptions o;
  o.size = "640x400";
  o.wall.name = "3x2";
  o.wall.tile = 5;
  o.coupling.mode = "loose";
  ASSERT_TRUE(settle(o).ok());
  EXPECT_EQ(o.display.width, 640);
  EXPECT_EQ(o.display.wall.tile, 5);
  EXPECT_EQ(o.requests.buffers, 3u);
  EXPECT_TRUE(o.requests.adaptive);
  o.wall.tile = 6;
  const Status s = settle(o);
  ASSERT_FALSE(s.ok());
  EXPECT_EQ(s.error().text, "--wall-tile 6: --wall 3x2 has the tiles 0..5");
}

// Writes a wall's description into the test's own folder; returns its path.
std::string description(const std::string& anchor) {
  const std::string path = tests::own_folder() + anchor + ".toml";
  std::ofstream(path) << "[wall]\nanchor = \"" << anchor
                      << "\"\n[head]\nposition = [0, 0.5, 1]\n[[planar]]\ncolumns = 2\nsize = [0.4, 0.3]\n"
                         "resolution = [400, 300]\nsampling = [200, 150]\n";
  return path;
}

TEST(Wall, AScreenOfADescriptionHasItsSizeAndSampling) {
  ViewerOptions o;
  o.wall.name = description("head");
  o.wall.tile = 1;
  o.wall.scale = 0.5;
  ASSERT_TRUE(settle(o).ok());
  ASSERT_TRUE(o.display.wall.described);
  EXPECT_EQ(o.display.width, 200);
  EXPECT_EQ(o.display.height, 150);
  EXPECT_FALSE(o.requests.adaptive);
  EXPECT_EQ(o.requests.sampling_width, 100);
  EXPECT_EQ(o.head.trajectory, "orbit");
  EXPECT_TRUE(in_step(o));
  o.wall.swap_barrier = false;
  EXPECT_FALSE(in_step(o));
  o.wall.tile = 2;
  const Status s = settle(o);
  ASSERT_FALSE(s.ok());
  EXPECT_NE(s.error().text.find("has the screens 0..1"), std::string::npos) << s.error().text;
}

TEST(Wall, AHeadStandsBeforeAWallThatStandsInTheRoom) {
  ViewerOptions o;
  o.wall.name = description("room");
  ASSERT_TRUE(settle(o).ok());
  EXPECT_EQ(o.head.trajectory, "still");
  ASSERT_TRUE(o.head.movement.eye);
  EXPECT_EQ(*o.head.movement.eye, glm::dvec3(0, 0.5, 1));
  o.head.trajectory = "orbit";
  const Status s = settle(o);
  ASSERT_FALSE(s.ok());
  EXPECT_NE(s.error().text.find("stands in the room"), std::string::npos) << s.error().text;
}

TEST(Wall, WhatIsNoDescriptionIsToldByFileAndKey) {
  ViewerOptions o;
  o.wall.name = tests::own_folder() + "none.toml";
  EXPECT_NE(settle(o).error().text.find("none.toml: cannot be read"), std::string::npos);
  o.wall.name = "2by1";
  EXPECT_NE(settle(o).error().text.find("neither a file NAME.toml nor COLUMNSxROWS"), std::string::npos);
}

TEST(Wall, HasNoMoreTilesThanItMay) {
  EXPECT_EQ(parse_wall("4x4", 16).value(), (WallLayout{4, 4}));
  EXPECT_FALSE(parse_wall("5x4", 16).ok());
  EXPECT_EQ(parse_wall("16x16").value().tiles(), 256);
}

TEST(ViewerTables, FramesHaveTheirColumnsInTheirOrder) {
  EXPECT_EQ(frame_columns(), metrics::viewer_columns("frames"));
  MeasuredFrame f{.number = 7, .start_s = 1, .previous_s = 2, .begin_s = 3, .end_s = 3.5, .presented_s = 3.75};
  f.drawn.chosen_s = 3.25;
  f.filled = 2;
  f.begin_master_s = 4;
  f.drawn.summaries = 9;
  f.drawn.refined = {0.5, 6, 4};
  f.drawn.halved = true;
  f.coupling = {CouplingMode::kLoose, 5};
  f.seen = {.at_s = 4.5, .refresh_s = 0.0625, .lead_s = 0.25, .missed = 3};
  f.posed = {2.75, 0.5};
  f.look = {{splat::Kernel::kEwa, {.fill = true, .smooth = false, .antialias = true}}, false};
  f.look.head_light = true;
  f.look.background = 0xffeedd;
  const auto row = frame_row(f);
  ASSERT_EQ(row.size(), frame_columns().size());
  EXPECT_EQ((std::vector<double>(row.begin(), row.begin() + 6)), (std::vector<double>{7, 2, 1500, 500, 250, 250}));
  EXPECT_EQ((std::vector<double>(row.end() - 31, row.end() - 15)),
            (std::vector<double>{2, 9, 3, 5, 0, 4, 0.5, 6, 4, 2, 5, 1, 0xffeedd, 0, 0, -1}));
  EXPECT_EQ((std::vector<double>(row.end() - 15, row.end())),
            (std::vector<double>{0, 0, 0, 0, 0, 0, 0, 0, 250, 3, 1750, 500, 62.5, 0, 1}));
  f.stereo = {stereo::Mode::kRows, {.screen_m = 0.75}};
  f.stereo.pair.eyes[0].pose.position_room = {1, 2, 3};
  f.stereo.pair.eyes[1].pose.position_room = {4, 5, 6};
  const auto seen_by_two = frame_row(f);
  EXPECT_EQ((std::vector<double>(seen_by_two.end() - 15, seen_by_two.end() - 7)),
            (std::vector<double>{double(stereo::Mode::kRows), 0.75, 1, 2, 3, 4, 5, 6}));
  f.drawn.still = true;
  const auto stands = frame_row(f);
  EXPECT_EQ((std::vector<double>(stands.end() - 5, stands.end() - 1)), (std::vector<double>{-1, 500, 62.5, 1}))
      << "a picture that stands shows no motion";
}

TEST(ViewerTables, RefreshesThatShowedNothingNewAreMissed) {
  const double hz = 1.0 / 60;
  EXPECT_EQ(refreshes_missed(0, 7, hz), 0) << "nothing was presented before";
  EXPECT_EQ(refreshes_missed(5, 5 + hz, hz), 0);
  EXPECT_EQ(refreshes_missed(5, 5 + 1.4 * hz, hz), 0) << "clocks and swaps are a little off";
  EXPECT_EQ(refreshes_missed(5, 5 + 2 * hz, hz), 1);
  EXPECT_EQ(refreshes_missed(5, 5 + 6.1 * hz, hz), 5);
  EXPECT_EQ(refreshes_missed(5, 5 + 0.1 * hz, hz), 0);
  EXPECT_EQ(refreshes_missed(5, 6, 0), 0) << "no refresh is known";
}

TEST(ViewerTables, UpdatesHaveTheirColumnsInTheirOrder) {
  EXPECT_EQ(update_columns(), metrics::viewer_columns("updates"));
  ViewRequester::Update u;
  u.requested_s = 1, u.first_s = 1.25, u.complete_s = 1.5;
  u.samples = 100, u.points = 25, u.eliminated = 75;
  u.extra = {8, 16};
  const auto row = update_row({u, {.left_out = 3}});
  EXPECT_EQ(row[5], 500);
  EXPECT_EQ(row[6], 250);
  EXPECT_EQ(row[11], 0.75);
  EXPECT_EQ((std::vector<double>(row.end() - 3, row.end())), (std::vector<double>{8, 16, 3}));
}

TEST(LeastSampling, IsWhatTheSessionTellsWithinItsLimits) {
  for (const auto& [told, scale] : {std::pair{0.4, 0.4}, {0.01, 0.1}, {7.0, 1.0}, {std::nan(""), 0.1}}) {
    ViewRequester requester({.max_rate_hz = 1000, .adaptive = true, .target_latency_s = 0.01}, {5});
    requester.set_min_scale(told);
    geometry::Camera display = geometry::make_camera({}, 90, 2000, 2000);
    int width = 0;
    // The head turns and every update takes far too long: sampling becomes as coarse as allowed.
    for (int i = 0; i < 60; ++i) {
      const double now_s = i * 2.0;
      for (int k = 0; k < 5; ++k) {
        display.pose.orientation = glm::angleAxis(0.002 * (5 * i + k), glm::dvec3(0, 1, 0));
        requester.on_pose(now_s + k * 0.02, display);
      }
      const auto request = requester.next(now_s + 0.1);
      ASSERT_TRUE(request);
      width = request->camera.width;
      const double wider = (request->camera.right - request->camera.left) / (display.right - display.left);
      width = int(std::lround(width / wider));
      requester.on_part({.viewer = {5}, .request = request->request, .complete = true}, now_s + 1.9);
    }
    EXPECT_NEAR(width, 2000 * scale, 16) << told;
  }
}

}  // namespace
}  // namespace telesplat::viewer
