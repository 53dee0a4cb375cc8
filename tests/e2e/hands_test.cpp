// Pointing, cutting, keeping: what `telesplat ctl` asks of sessions that run, and what it tells.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "common/geometry/clip.h"
#include "tests/support/pipeline_run.h"
#include "tools/common/csv_table.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

// A board of 200 x 100 mm at z = 30 that faces the eye, 50 mm behind it a smaller one of another colour.
void write_boards(const std::string& path) {
  std::ofstream out(path);
  out << "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
         "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 4\n"
         "property list uchar int vertex_indices\nend_header\n";
  for (const double z : {30.0, -20.0})
    for (int corner = 0; corner < 4; ++corner) {
      const double x = (corner & 1 ? 100 : -100) * (z > 0 ? 1 : 0.5), y = (corner & 2 ? 50 : -50) * (z > 0 ? 1 : 0.5);
      out << 1000 + x << " " << y << " " << z << (z > 0 ? " 220 40 40\n" : " 40 40 220\n");
    }
  for (const int first : {0, 4})
    out << "3 " << first << " " << first + 1 << " " << first + 3 << "\n3 " << first << " " << first + 3 << " "
        << first + 2 << "\n";
}

class Hands : public testing::Test {
 protected:
  int ctl(PipelineRun& run, std::vector<std::string> arguments, std::string* out = nullptr,
          std::string* err = nullptr) {
    arguments.insert(arguments.begin(), "ctl");
    arguments.insert(arguments.end(), {"--master", run.master()});
    Program program("telesplat", arguments, run.folder() / ("ctl-" + std::to_string(++asked_)));
    const int code = program.wait(30);
    if (out) *out = program.out();
    if (err) *err = program.err();
    return code;
  }
  Json pick(PipelineRun& run, std::vector<std::string> places) {
    places.insert(places.begin(), "pick");
    places.push_back("--json");
    std::string out, err;
    EXPECT_EQ(ctl(run, places, &out, &err), 0) << err;
    return Json::parse(out, nullptr, false);
  }
  // Until a pick of the middle is as wished.
  bool wait_pick(PipelineRun& run, const std::function<bool(const Json&)>& condition) {
    return wait_until(
        [&] {
          const Json answer = pick(run, {"50%,50%"});
          return answer.is_object() && condition(answer["picks"][0]);
        },
        40);
  }
  std::vector<std::string> looking() const {
    return {"--duration", "0", "--trajectory",    "still",   "--eye",   "0,0,0.9",
            "--up",       "y", "--sampling-size", "320x200", "--cache", folder_ / "cache"};
  }
  TemporaryFolder folder_;
  int asked_ = 0;
};

TEST_F(Hands, PicksMeasuresAndCutsAMesh) {
  const std::string mesh = folder_ / "boards.ply";
  write_boards(mesh);
  PipelineRun run(looking(), mesh);
  ASSERT_TRUE(run.wait_showing());
  ASSERT_TRUE(wait_pick(run, [](const Json& p) { return p.is_object(); }));
  // The middle of the front board, in the file's own millimetres.
  const Json front = pick(run, {"50%,50%"})["picks"][0];
  EXPECT_NEAR(front["data"][0].get<double>(), 1000, 1);
  EXPECT_NEAR(front["data"][1].get<double>(), 0, 1);
  EXPECT_NEAR(front["data"][2].get<double>(), 30, 0.5);
  EXPECT_NEAR(front["normal"][2].get<double>(), 1, 0.02);
  EXPECT_EQ(front["colour"], "#dc2828");
  // Places beside it, their distances, the right angle at the middle.
  const Json three = pick(run, {"60%,50%", "50%,50%", "50%,60%"});
  ASSERT_EQ(three["distances"].size(), 2u);
  const double across = three["picks"][0]["data"][0].get<double>() - 1000;
  EXPECT_NEAR(three["distances"][0].get<double>(), across, 1.5);
  EXPECT_NEAR(three["angle_deg"].get<double>(), 90, 2);
  EXPECT_TRUE(pick(run, {"1,1"})["picks"][0].is_null());

  // The front board is cut away: the one behind it is seen.
  const double epoch = value(run.status(), "viewer-1", "epoch");
  ASSERT_EQ(ctl(run, {"clip", "plane z<=0"}), 0);
  ASSERT_TRUE(wait_pick(run, [](const Json& p) { return p.is_object() && p["data"][2].get<double>() < 0; }));
  const Json back = pick(run, {"50%,50%"})["picks"][0];
  EXPECT_NEAR(back["data"][2].get<double>(), -20, 0.5);
  EXPECT_EQ(back["colour"], "#2828dc");
  EXPECT_TRUE(wait_until([&] { return value(run.status(), "viewer-1", "epoch") > epoch; }, 10)) << "it reports";
  EXPECT_EQ(run.status()["clip"], "plane z<=0");
  std::string told;
  EXPECT_EQ(ctl(run, {"clip"}, &told), 0);
  EXPECT_EQ(told, "plane z<=0\n");
  ASSERT_EQ(ctl(run, {"clip", "off"}), 0);
  EXPECT_EQ(ctl(run, {"clip"}, &told), 0);
  EXPECT_EQ(told, "off\n");
  ASSERT_TRUE(wait_pick(run, [](const Json& p) { return p.is_object() && p["data"][2].get<double>() > 0; }));

  std::string err;
  EXPECT_EQ(ctl(run, {"clip", "plane z<"}, nullptr, &err), 2);
  EXPECT_EQ(ctl(run, {"pick", "5000,1"}, nullptr, &err), 2);
  EXPECT_NE(err.find("outside"), std::string::npos) << err;
  EXPECT_EQ(ctl(run, {"pick", "1,1", "--viewer", "nobody"}, nullptr, &err), 2);
  EXPECT_EQ(run.stop(), 0);
  EXPECT_EQ(run.summary()["errors"]["messages_rejected"], 0);
  // The record tells what was cut in which epoch.
  const auto table = tools::CsvTable::read(run.out() + "/epochs.csv", {.rows = 100, .line_bytes = 100000});
  ASSERT_TRUE(table);
  const auto clip = table->column("clip");
  ASSERT_TRUE(clip);
  ASSERT_EQ(table->rows(), 3u);
  EXPECT_EQ(table->text(0, *clip), "");
  EXPECT_EQ(geometry::clip_from_text(table->text(1, *clip))->planes.size(), 1u);
}

// What is displayed of a cut scene is what rays see of it.
TEST_F(Hands, CutScenesAreComparedWithCutScenes) {
  for (const std::string scene : {"mesh", "julia", "volume"}) {
    std::string file = scene;
    if (scene == "mesh") write_terrain(file = folder_ / "hills.ply");
    if (scene == "volume") write_volume(file = folder_ / "balls.mha");
    std::vector<std::string> flags{
        "--clip", "plane x<=55%; plane z>=30%", "--duration", "4", "--hold", "2.5", "--verify", "12", "--sampling-size",
        "320x200"};
    if (scene == "mesh") flags.insert(flags.end(), {"--cache", folder_ / "cache"});
    PipelineRun run(flags, file);
    ASSERT_EQ(run.program().wait(140), 0) << run.program().err();
    const auto s = run.summary();
    ASSERT_TRUE(s.is_object());
    EXPECT_GE(s["quality"]["views"], 2);
    EXPECT_GT(s["quality"]["last_view"]["psnr_db"], 24) << scene;
  }
}

TEST_F(Hands, APickOfAVolumeTellsItsValue) {
  const std::string file = folder_ / "balls.mha";
  write_volume(file);
  PipelineRun run({"--duration", "0", "--trajectory", "still"}, file);
  ASSERT_TRUE(run.wait_status([](const auto& s) { return value(s, "viewer-1", "frames") > 0; }));
  ASSERT_TRUE(wait_pick(run, [](const Json& p) { return p.is_object() && p.contains("value"); }));
  const Json place = pick(run, {"50%,50%"})["picks"][0];
  EXPECT_GT(place["value"].get<double>(), 0);
  EXPECT_LE(place["value"].get<double>(), 255);
  EXPECT_LT(place["value_error"].get<double>(), 2);
  EXPECT_FALSE(place.contains("normal"));
  EXPECT_EQ(ctl(run, {"play", "pause"}), 2) << "one step has nothing to play";
  EXPECT_EQ(run.stop(), 0);
}

TEST_F(Hands, BookmarksAndNotesLieBesideTheData) {
  const std::string mesh = folder_ / "boards.ply", book = mesh + ".notes.json";
  write_boards(mesh);
  PipelineRun run(looking(), mesh);
  ASSERT_TRUE(run.wait_showing());
  ASSERT_TRUE(wait_pick(run, [](const Json& p) { return p.is_object(); }));
  std::string out, err;
  ASSERT_EQ(ctl(run, {"bookmark", "add", "in", "front"}, &out, &err), 0) << err;
  ASSERT_EQ(ctl(run, {"notes", "add", "a scratch", "--at", "50%,50%"}, &out, &err), 0) << err;
  const Json json = Json::parse(read_text(book), nullptr, false);
  ASSERT_TRUE(json.is_object());
  EXPECT_EQ(json["bookmarks"][0]["name"], "in front");
  EXPECT_NEAR(json["bookmarks"][0]["position"][2].get<double>(), 0.9, 1e-6);
  EXPECT_EQ(json["notes"][0]["text"], "a scratch");
  EXPECT_NEAR(json["notes"][0]["place"][2].get<double>(), 30, 0.5);
  ASSERT_EQ(ctl(run, {"notes"}, &out), 0);
  EXPECT_NE(out.find("a scratch"), std::string::npos) << out;
  EXPECT_EQ(ctl(run, {"bookmark", "go", "in front"}, nullptr, &err), 2) << "a head on a trajectory stays on it";
  EXPECT_EQ(ctl(run, {"bookmark", "go", "nowhere"}, nullptr, &err), 2);
  EXPECT_EQ(ctl(run, {"notes", "add", "nothing", "--at", "1,1"}, nullptr, &err), 2);
  EXPECT_EQ(ctl(run, {"notes", "remove", "7"}, nullptr, &err), 2);

  // A broken file is refused and stays.
  std::ofstream(book) << "{\"telesplat_notes\": 1, \"notes\": [";
  const std::string broken = read_text(book);
  EXPECT_EQ(ctl(run, {"notes"}, nullptr, &err), 2);
  EXPECT_NE(err.find(book), std::string::npos) << err;
  EXPECT_EQ(ctl(run, {"notes", "add", "more"}, nullptr, &err), 2);
  EXPECT_EQ(read_text(book), broken);
  EXPECT_EQ(run.stop(), 0);
}

TEST_F(Hands, AnAnimationIsPausedAndGoesStepByStep) {
  PipelineRun run({"--animate", "c.y=-0.5:0.5:20s", "--duration", "0", "--sampling-size", "160x100"}, "julia");
  ASSERT_TRUE(run.wait_showing());
  std::string out;
  ASSERT_EQ(ctl(run, {"play", "pause"}, &out), 0);
  EXPECT_NE(out.find("paused"), std::string::npos) << out;
  const auto now = [&] { return run.status()["parameters"]["c.y"].get<double>(); };
  const double paused = now();
  EXPECT_FALSE(wait_until([&] { return now() != paused; }, 1.5));
  // A second of twenty, in which it swings there and back; and the same back.
  ASSERT_EQ(ctl(run, {"play", "step", "10"}), 0);
  const double later = now();
  EXPECT_GT(std::abs(later - paused), 0.001);
  EXPECT_LT(std::abs(later - paused), 0.2);
  ASSERT_EQ(ctl(run, {"play", "step", "-10"}), 0);
  EXPECT_NEAR(now(), paused, 1e-6);
  ASSERT_EQ(ctl(run, {"play"}), 0);
  EXPECT_TRUE(wait_until([&] { return std::abs(now() - paused) > 0.08; }, 20));
  EXPECT_EQ(run.stop(), 0);
}

}  // namespace
}  // namespace telesplat::test
