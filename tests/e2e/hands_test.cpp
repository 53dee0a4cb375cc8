// Pointing, cutting, keeping: what `telesplat ctl` asks of sessions that run, and what it tells.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "common/geometry/clip.h"
#include "tests/support/pipeline_run.h"
#include "tests/support/virtual_display.h"
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
  // Picks at these places, once the view is complete there.
  Json pick_all(PipelineRun& run, const std::vector<std::string>& places) {
    Json answer;
    wait_until(
        [&] {
          answer = pick(run, places);
          if (!answer.is_object()) return false;
          return std::all_of(answer["picks"].begin(), answer["picks"].end(),
                             [](const Json& p) { return p.is_object() && p.contains("error"); });
        },
        40);
    return answer;
  }
  std::vector<std::string> looking() const {
    return {"--duration", "0", "--trajectory",    "still",   "--eye",   "0,0,0.9",
            "--up",       "y", "--sampling-size", "320x200", "--cache", folder_ / "cache"};
  }
  void expect_book(PipelineRun& run, const std::string& mesh);
  TemporaryFolder folder_;
};

// Bookmarks and notes lie beside the data.
void Hands::expect_book(PipelineRun& run, const std::string& mesh) {
  const std::string book = mesh + ".notes.json";
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

  // A book that came with the data changes nothing in the terminal.
  std::ofstream(book) << "{\"telesplat_notes\": 1, \"notes\": [{\"number\": 1, \"text\": \"red \\u001b[31m\\nnext\"}]}";
  ASSERT_EQ(ctl(run, {"notes"}, &out, &err), 0) << err;
  EXPECT_EQ(out.find('\x1b'), std::string::npos) << out;
  EXPECT_NE(out.find("red "), std::string::npos) << out;

  // A broken file is refused and stays.
  std::ofstream(book) << "{\"telesplat_notes\": 1, \"notes\": [";
  const std::string broken = read_text(book);
  EXPECT_EQ(ctl(run, {"notes"}, nullptr, &err), 2);
  EXPECT_NE(err.find(book), std::string::npos) << err;
  EXPECT_EQ(ctl(run, {"notes", "add", "more"}, nullptr, &err), 2);
  EXPECT_EQ(read_text(book), broken);
}

TEST_F(Hands, PicksMeasuresCutsAndNotesOfAMesh) {
  const std::string mesh = folder_ / "boards.ply";
  write_boards(mesh);
  PipelineRun run(looking(), mesh);
  ASSERT_TRUE(run.wait_showing());
  ASSERT_TRUE(wait_pick(run, [](const Json& p) { return p.is_object(); }));
  // The middle of the front board, in the file's own millimetres.
  const Json front = pick(run, {"50%,50%"})["picks"][0];
  EXPECT_NEAR(front["data"][0].get<double>(), 1000, 1e-4);
  EXPECT_NEAR(front["data"][1].get<double>(), 0, 1e-4);
  EXPECT_NEAR(front["data"][2].get<double>(), 30, 1e-4);
  EXPECT_LT(front["error"].get<double>(), 1e-3) << "a flat board is exact to floats";
  EXPECT_FALSE(front.contains("estimate"));
  EXPECT_NEAR(front["normal"][2].get<double>(), 1, 1e-6);
  EXPECT_EQ(front["colour"], "#dc2828");
  // Places beside it, their distances, the right angle at the middle.
  const Json three = pick(run, {"60%,50%", "50%,50%", "50%,60%"});
  ASSERT_EQ(three["distances"].size(), 2u);
  const double across = three["picks"][0]["data"][0].get<double>() - 1000;
  EXPECT_NEAR(three["distances"][0].get<double>(), across, 1e-3);
  EXPECT_NEAR(three["angle_deg"].get<double>(), 90, 1e-3);
  EXPECT_TRUE(pick(run, {"1,1"})["picks"][0].is_null());

  // The front board is cut away: the one behind it is seen.
  const double epoch = value(run.status(), "viewer-1", "epoch");
  ASSERT_EQ(ctl(run, {"clip", "plane z<=0"}), 0);
  ASSERT_TRUE(wait_pick(run, [](const Json& p) { return p.is_object() && p["data"][2].get<double>() < 0; }));
  const Json back = pick(run, {"50%,50%"})["picks"][0];
  EXPECT_NEAR(back["data"][2].get<double>(), -20, 1e-4);
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
  EXPECT_EQ(ctl(run, {"measure"}, nullptr, &err), 2);
  EXPECT_NE(err.find("no window"), std::string::npos) << err;
  EXPECT_EQ(ctl(run, {"clip", "plane z<"}, nullptr, &err), 2);
  EXPECT_EQ(ctl(run, {"pick", "5000,1"}, nullptr, &err), 2);
  EXPECT_NE(err.find("outside"), std::string::npos) << err;
  EXPECT_EQ(ctl(run, {"pick", "1,1", "--viewer", "nobody"}, nullptr, &err), 2);
  expect_book(run, mesh);
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

// A sheet z = 5 sin(x / 20) + 0.1 y of 100 x 100 with an array of 300 + 10 sin(y / 15) + z.
void write_sheet(const std::string& path) {
  constexpr int kSide = 150;
  const auto height = [](double x, double y) { return 5 * std::sin(x / 20) + 0.1 * y; };
  std::ofstream out(path);
  out << "ply\nformat ascii 1.0\nelement vertex " << (kSide + 1) * (kSide + 1)
      << "\nproperty float x\nproperty float y\nproperty float z\nproperty float heat\nelement face "
      << 2 * kSide * kSide << "\nproperty list uchar int vertex_indices\nend_header\n";
  out.precision(9);
  for (int j = 0; j <= kSide; ++j)
    for (int i = 0; i <= kSide; ++i) {
      const double x = 100.0 * i / kSide, y = 100.0 * j / kSide, z = height(x, y);
      out << x << " " << y << " " << z << " " << 300 + 10 * std::sin(y / 15) + z << "\n";
    }
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i < kSide; ++i) {
      const int a = j * (kSide + 1) + i, b = a + 1, c = a + kSide + 1, d = c + 1;
      out << "3 " << a << " " << b << " " << d << "\n3 " << a << " " << d << " " << c << "\n";
    }
}

TEST_F(Hands, APicksValueIsThatOfItsPlace) {
  const std::string mesh = folder_ / "sheet.ply";
  write_sheet(mesh);
  auto flags = looking();
  flags.insert(flags.end(), {"--colour-by", "heat"});
  PipelineRun run(flags, mesh);
  ASSERT_TRUE(run.wait_showing());
  ASSERT_TRUE(wait_pick(run, [](const Json& p) { return p.is_object() && p.contains("error"); }));
  int picked = 0;
  for (int n = 0; n < 21; n += 3) {
    std::vector<std::string> places;
    for (int i = n; i < n + 3; ++i) places.push_back(fmt::format("{}%,{}%", 34 + 1.6 * i, 35 + (i * 7) % 31));
    const Json answer = pick_all(run, places);
    for (const Json& p : answer["picks"]) {
      if (!p.is_object()) continue;
      ++picked;
      const double x = p["data"][0], y = p["data"][1], z = p["data"][2];
      ASSERT_TRUE(p.contains("error") && p.contains("value_error")) << p.dump();
      EXPECT_LE(std::abs(z - 5 * std::sin(x / 20) - 0.1 * y), p["error"].get<double>()) << p.dump();
      EXPECT_LE(std::abs(p["value"].get<double>() - (300 + 10 * std::sin(y / 15) + z)), p["value_error"].get<double>())
          << p.dump();
      EXPECT_LT(p["error"].get<double>(), 0.1);
      EXPECT_LT(p["value_error"].get<double>(), 0.1);
    }
  }
  EXPECT_GE(picked, 18);
  EXPECT_EQ(run.stop(), 0);
}

// A raster of 30 m in UTM with heights of 2000 + 300 sin(column / 12) metres, shown three times as high.
TEST_F(Hands, ATerrainsPickHasTheFilesCoordinatesAndTrueHeights) {
  const std::string raster = folder_ / "ridges.asc";
  constexpr int kColumns = 160, kRows = 120;
  std::ofstream out(raster);
  out << "ncols " << kColumns << "\nnrows " << kRows
      << "\nxllcorner 432100\nyllcorner 5212300\ncellsize 30\nNODATA_value -9999\n";
  const auto height = [](double x) { return 2000 + 300 * std::sin((x - 432100) / 30 / 12); };
  for (int row = 0; row < kRows; ++row)
    for (int column = 0; column < kColumns; ++column)
      out << fmt::format("{:.3f}{}", height(432100 + 30 * (column + 0.5)), column + 1 < kColumns ? " " : "\n");
  out.close();
  std::ofstream(folder_ / "ridges.prj")
      << R"(PROJCS["WGS 84 / UTM zone 32N",GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],)"
         R"(PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],)"
         R"(PARAMETER["latitude_of_origin",0],PARAMETER["central_meridian",9],PARAMETER["scale_factor",0.9996],)"
         R"(PARAMETER["false_easting",500000],PARAMETER["false_northing",0],UNIT["metre",1]])";
  PipelineRun run({"--duration", "0", "--trajectory", "still", "--z-scale", "3", "--sampling-size", "320x200",
                   "--cache", folder_ / "cache"},
                  raster);
  ASSERT_TRUE(run.wait_showing());
  ASSERT_TRUE(wait_pick(run, [](const Json& p) { return p.is_object() && p.contains("error"); }));
  const Json answer = pick_all(run, {"40%,50%", "45%,50%", "50%,50%"});
  for (const Json& p : answer["picks"]) {
    ASSERT_TRUE(p.is_object() && p.contains("error")) << p.dump();
    const double x = p["data"][0], y = p["data"][1], z = p["data"][2];
    EXPECT_TRUE(x > 432100 && x < 432100 + 30 * kColumns && y > 5212300 && y < 5212300 + 30 * kRows) << p.dump();
    EXPECT_LE(std::abs(z - height(x)), p["error"].get<double>());
    EXPECT_LT(p["error"].get<double>(), 15);
    EXPECT_EQ(p["unit"], "m");
    EXPECT_NE(p["place"].get<std::string>().find("UTM zone 32N"), std::string::npos) << p["place"];
  }
  const auto along = [&](int a) {
    return answer["picks"][0]["data"][a].get<double>() - answer["picks"][1]["data"][a].get<double>();
  };
  EXPECT_NEAR(answer["distances"][0].get<double>(), std::hypot(along(0), along(1), along(2)), 1e-6) << "true lengths";
  // A cut at a height is one at the true height.
  ASSERT_EQ(ctl(run, {"clip", "plane z<=1900"}), 0);
  ASSERT_TRUE(wait_until(
      [&] {
        int below = 0;
        const Json cut = pick(run, {"40%,50%", "45%,50%", "50%,50%"});
        for (const Json& p : cut["picks"])
          if (p.is_object()) {
            if (p["data"][2].get<double>() > 1900.01) return false;
            ++below;
          }
        return below > 0;
      },
      40));
  EXPECT_EQ(run.stop(), 0);
}

// The display of a cut scene shows the points that rays hit. Simulated sessions show it for meshes.
TEST_F(Hands, CutScenesAreComparedWithCutScenes) {
  for (const std::string scene : {"julia", "volume"}) {
    std::string file = scene;
    if (scene == "volume") write_volume(file = folder_ / "balls.mha");
    auto flags = kComesToRest;
    flags.insert(flags.end(), {"--clip", "plane x<=55%; plane z>=30%", "--verify", "60", "--sampling-size", "320x200"});
    PipelineRun run(flags, file);
    ASSERT_TRUE(run.wait_at_rest()) << run.program().err();
    ASSERT_EQ(run.stop(), 0) << run.program().err();
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
  ASSERT_TRUE(place.contains("value_error") && place.contains("error")) << place.dump();
  EXPECT_GE(place["value_error"].get<double>(), 0.5) << "half a level at least";
  EXPECT_FALSE(place.contains("normal"));
  EXPECT_EQ(ctl(run, {"play", "pause"}), 2) << "one step has nothing to play";
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
  const double frames = value(run.status(), "viewer-1", "frames");
  ASSERT_TRUE(run.wait_status([&](const auto& s) { return value(s, "viewer-1", "frames") > frames + 10; }));
  EXPECT_EQ(now(), paused);
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

// Marks lie in the window, and are listed, taken away and saved from elsewhere.
TEST_F(Hands, AWindowKeepsWhatIsMeasured) {
  if (!VirtualDisplay::installed()) GTEST_SKIP() << "Xvfb is not installed";
  VirtualDisplay display;
  ASSERT_TRUE(display.ready());
  const std::string mesh = folder_ / "boards.ply";
  write_boards(mesh);
  PipelineRun run({"--size", "640x480", "--eye", "0,0,0.9", "--up", "y", "--cache", folder_ / "cache"}, mesh, "view");
  ASSERT_TRUE(run.wait_showing());
  ASSERT_TRUE(pick_all(run, {"35%,50%", "65%,50%"}).is_object());
  std::string out, err;
  ASSERT_EQ(ctl(run, {"measure", "add", "35%,50%", "65%,50%"}, &out, &err), 0) << err;
  const auto list = [&] {
    EXPECT_EQ(ctl(run, {"measure", "--json"}, &out, &err), 0) << err;
    return Json::parse(out, nullptr, false)["places"];
  };
  ASSERT_TRUE(wait_until([&] {
    const Json places = list();
    return places.size() == 2 && places[0].contains("error") && places[1].contains("error");
  }));
  const Json places = list();
  EXPECT_NEAR(places[0]["data"][2].get<double>(), 30, 1e-4);
  EXPECT_NEAR(places[1]["distance"].get<double>(),
              places[1]["data"][0].get<double>() - places[0]["data"][0].get<double>(), 1e-3);
  // Yellow lies where the line is.
  const auto window = display.find(" fps, ");
  ASSERT_TRUE(window);
  const auto yellow = [&] {
    const auto seen = display.content(*window);
    if (!seen) return false;
    for (int y = seen->height / 2 - 6; y < seen->height / 2 + 6; ++y)
      if ((seen->colour[size_t(y) * size_t(seen->width) + size_t(seen->width) * 40 / 100] & 0xffffff) == 0xf0e442)
        return true;
    return false;
  };
  EXPECT_TRUE(wait_until(yellow));
  // The key measures what lies under the pointer.
  display.move_pointer(*window, 320, 260);
  display.tap("x");
  EXPECT_TRUE(wait_until([&] { return list().size() == 3; }));
  const std::string table = folder_ / "places.csv";
  ASSERT_EQ(ctl(run, {"measure", "save", table}, &out, &err), 0) << err;
  const std::string text = read_text(table);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 4) << text;
  EXPECT_EQ(ctl(run, {"measure", "remove", "77"}, &out, &err), 2);
  ASSERT_EQ(ctl(run, {"measure", "remove", "1"}, &out, &err), 0) << err;
  EXPECT_EQ(list().size(), 2u);
  ASSERT_EQ(ctl(run, {"measure", "clear"}), 0);
  EXPECT_TRUE(wait_until([&] { return !yellow(); }));
  EXPECT_EQ(run.stop(), 0);
}

}  // namespace
}  // namespace telesplat::test
