// `telesplat compare`: a run's poses drawn again, from its folder alone.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <set>
#include <sstream>

#include "common/image/file.h"
#include "tests/support/patience.h"
#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

using Row = std::map<std::string, std::string>;

std::vector<Row> read_csv(const std::string& path) {
  std::istringstream in(read_text(path));
  const auto split = [](const std::string& line) {
    std::vector<std::string> out;
    std::istringstream fields(line);
    for (std::string f; std::getline(fields, f, ',');) out.push_back(f);
    return out;
  };
  std::string line;
  std::getline(in, line);
  const auto header = split(line);
  std::vector<Row> rows;
  while (std::getline(in, line)) {
    const auto fields = split(line);
    Row row;
    for (size_t i = 0; i < std::min(header.size(), fields.size()); ++i) row[header[i]] = fields[i];
    EXPECT_EQ(fields.size(), header.size());
    rows.push_back(row);
  }
  return rows;
}

double number(const Row& row, const std::string& key) {
  const auto it = row.find(key);
  EXPECT_NE(it, row.end()) << key;
  return it == row.end() ? NAN : std::strtod(it->second.c_str(), nullptr);
}

// least_ssim: without finish pin-holes stay.
void expect_plausible(const Row& row, double least_ssim = 0.4) {
  const std::string name = row.at("kernel") + " " + row.at("renderer");
  EXPECT_GT(number(row, "psnr_db"), 15) << name;
  EXPECT_LE(number(row, "psnr_db"), 99) << name;
  for (const char* key : {"ssim", "flip", "hole_fraction", "error_silhouette", "error_depth_edge", "error_interior",
                          "pixels_silhouette", "pixels_depth_edge"}) {
    EXPECT_GE(number(row, key), 0) << name << " " << key;
    EXPECT_LE(number(row, key), 1) << name << " " << key;
  }
  EXPECT_NEAR(number(row, "error_silhouette") + number(row, "error_depth_edge") + number(row, "error_interior"), 1,
              1e-3);
  EXPECT_GT(number(row, "ssim"), least_ssim) << name;
  EXPECT_LT(number(row, "flip"), 0.3) << name;
  EXPECT_LT(number(row, "hole_fraction"), 0.2) << name;
  EXPECT_GT(number(row, "object_pixels"), 1000) << name;
  EXPECT_GT(number(row, "frame_ms"), 0) << name;
  EXPECT_GT(number(row, "points_drawn"), 1000) << name;
}

TEST(Compare, DrawsARunsPosesWithEveryKernelAndRenderer) {
  PipelineRun run({"--duration", "2", "--hold", "1", "--splat", "disc", "--renderer", "cpu"});
  ASSERT_EQ(run.program().wait(90), 0) << run.program().err();
  const std::string out = run.out() + "/compare";
  {
    Program compare("telesplat", {"compare", run.out(), "--poses", "2", "--repeat", "2"}, run.folder() / "compare");
    ASSERT_EQ(compare.wait(120), 0) << compare.err();
    EXPECT_NE(compare.out().find("ellipse"), std::string::npos) << compare.out();
  }
  // A row for each pose, kernel and renderer; gl is there if the machine has it.
  const auto rows = read_csv(out + "/compare.csv");
  std::set<std::string> frames, kernels, renderers, cells;
  for (const Row& row : rows) {
    expect_plausible(row);
    frames.insert(row.at("frame")), kernels.insert(row.at("kernel")), renderers.insert(row.at("renderer"));
    cells.insert(row.at("frame") + row.at("kernel") + row.at("renderer"));
  }
  EXPECT_EQ(frames.size(), 2u);
  EXPECT_EQ(kernels, (std::set<std::string>{"square", "disc", "ellipse", "ewa"}));
  EXPECT_TRUE(renderers.contains("cpu"));
  EXPECT_EQ(cells.size(), frames.size() * kernels.size() * renderers.size());
  EXPECT_EQ(rows.size(), cells.size());

  const auto json = nlohmann::json::parse(read_text(out + "/compare.json"), nullptr, false);
  ASSERT_TRUE(json.is_object());
  ASSERT_EQ(json["poses"].size(), 2u);
  EXPECT_EQ(json["medians"].size(), rows.size() / 2);
  EXPECT_EQ(json["samples"], 16);
  EXPECT_EQ(json["size"], nlohmann::json({480, 300}));
  EXPECT_NEAR(json["poses"][0]["cells"][0]["psnr_db"].get<double>(), number(rows[0], "psnr_db"), 1e-3);
  EXPECT_GT(json["poses"][1]["points_cached"], 1000);

  // Sheets: wide enough for two pictures, higher with every row, and not of one colour.
  for (const std::string& name : {std::string("contact-sheet"), fmt::format("pose-{:0>6}", *frames.begin())}) {
    const auto sheet = image::read_view(out + "/" + name + ".png");
    ASSERT_TRUE(sheet.ok()) << sheet.error().text;
    EXPECT_GT(sheet->width, 800) << name;
    EXPECT_GT(sheet->height, int(150 * rows.size() / 2)) << name;
    EXPECT_GT(std::set<uint32_t>(sheet->colour.begin(), sheet->colour.end()).size(), 500u) << name;
  }

  // A replay shows the frames that were displayed: the run's last picture, drawn again, is the same or nearly so.
  std::string last;
  for (const auto& entry : fs::directory_iterator(run.out() + "/images"))
    last = std::max(last, entry.path().filename().string());
  const std::string digits = last.substr(6, 6);
  Program again("telesplat",
                {"compare", run.out(), "--frames", std::to_string(std::stoul(digits)), "--kernels", "disc",
                 "--renderers", "cpu", "--repeat", "1", "--pictures", "--out", run.folder() / "again"},
                run.folder() / "again-log");
  ASSERT_EQ(again.wait(60), 0) << again.err();
  const auto displayed = image::read_view(run.out() + "/images/" + last);
  const auto drawn = image::read_view(run.folder() / ("again/pose-" + digits + "-disc-cpu.png"));
  ASSERT_TRUE(displayed.ok() && drawn.ok());
  ASSERT_EQ(displayed->colour.size(), drawn->colour.size());
  // Tiles of a still picture that waited for their turn when points had just come are replayed with these.
  EXPECT_GT(psnr_db(*displayed, *drawn), 34);
  EXPECT_TRUE(fs::exists(run.folder() / ("again/pose-" + digits + "-disc-cpu-flip.png")));
  EXPECT_TRUE(fs::exists(run.folder() / ("again/pose-" + digits + "-reference.png")));

  // The data was moved: that is said, and --scene helps.
  fs::rename(run.folder() / "terrain.ply", run.folder() / "moved.ply");
  Program lost("telesplat", {"compare", run.out(), "--out", run.folder() / "lost"}, run.folder() / "lost-log");
  EXPECT_EQ(lost.wait(60), 2);
  EXPECT_NE(lost.err().find("terrain.ply"), std::string::npos) << lost.err();
  EXPECT_NE(lost.err().find("--scene"), std::string::npos) << lost.err();
  EXPECT_FALSE(fs::exists(run.folder() / "lost"));
  Program found("telesplat",
                {"compare", "--scene", run.folder() / "moved.ply", "--out", run.folder() / "found", "--poses", "1",
                 "--repeat", "1", "--finish", "off", "--renderers", "cpu", "--kernels", "ellipse", run.out()},
                run.folder() / "found-log");
  EXPECT_EQ(found.wait(60), 0) << found.err();
  const auto found_rows = read_csv(run.folder() / "found/compare.csv");
  ASSERT_EQ(found_rows.size(), 1u);
  expect_plausible(found_rows[0], test::kSlow ? 0.2 : 0.25);  // slow programs have sampled less by then

  // Told to stop, it keeps the poses that it has and says so.
  Program stopped("telesplat",
                  {"compare", run.out(), "--scene", run.folder() / "moved.ply", "--out", run.folder() / "stopped",
                   "--poses", "1000", "--kernels", "square", "--renderers", "cpu", "--repeat", "100"},
                  run.folder() / "stopped-log");
  ASSERT_TRUE(wait_until([&] {
    std::error_code error;
    return fs::directory_iterator(run.folder() / "stopped", error) != fs::directory_iterator();
  }));
  stopped.signal(SIGINT);
  EXPECT_EQ(stopped.wait(30), 1) << stopped.err();
  EXPECT_NE(stopped.err().find("told to stop"), std::string::npos) << stopped.err();
  EXPECT_FALSE(read_csv(run.folder() / "stopped/compare.csv").empty());
  for (const auto& entry : fs::directory_iterator(run.folder() / "stopped"))
    EXPECT_NE(entry.path().extension(), ".part") << entry.path();
}

}  // namespace
}  // namespace telesplat::test
