// A mesh coloured by its arrays: whole runs of a small one, made here.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include <fmt/format.h>

#include "common/scene/colouring.h"
#include "tests/support/pipeline_run.h"
#include "tools/common/csv_table.h"

namespace telesplat::test {
namespace {

// A bumpy square with the point arrays temperature (0 to 100) and wind (a vector), the cell array part.
void write_vtp(const std::string& path, int n = 60) {
  std::string points, temperature, wind, cells, offsets, part;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) {
      const double x = double(i) / n, y = double(j) / n;
      points += fmt::format("{} {} {} ", x, y, 0.1 * std::sin(9 * x) * std::cos(7 * y));
      temperature += fmt::format("{} ", 50 + 50 * std::sin(5 * x + 3 * y));
      wind += fmt::format("{} {} 0 ", x, -y);
    }
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const int a = j * (n + 1) + i;
      cells += fmt::format("{} {} {} {} ", a, a + 1, a + n + 2, a + n + 1);
      offsets += fmt::format("{} ", 4 * (j * n + i + 1));
      part += fmt::format("{} ", i / 15 + 4 * (j / 15));
    }
  const auto array = [](const char* type, const char* name, int components, const std::string& values) {
    return fmt::format("<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"ascii\">{}</DataArray>",
                       type, name, components, values);
  };
  std::ofstream(path) << fmt::format(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"0.1\" "
      "byte_order=\"LittleEndian\"><PolyData>\n<Piece "
      "NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"{}\">"
      "<PointData>{}{}</PointData><CellData>{}</CellData><Points>{}</Points><Polys>{}{}</Polys></Piece></PolyData>"
      "</VTKFile>\n",
      (n + 1) * (n + 1), n * n, array("Float32", "temperature", 1, temperature), array("Float64", "wind", 3, wind),
      array("Int32", "part", 1, part), array("Float32", "p", 3, points), array("Int64", "connectivity", 1, cells),
      array("Int64", "offsets", 1, offsets));
}

class ColouredRun : public ::testing::Test {
 protected:
  ColouredRun() { write_vtp(mesh()); }
  std::string mesh() const { return folder_ / "plate.vtp"; }
  std::vector<std::string> with(std::vector<std::string> more) const {
    more.insert(more.end(), {"--cache", folder_ / "cache"});
    return more;
  }
  TemporaryFolder folder_;
};

std::vector<scene::Colouring> colourings(const PipelineRun& run) {
  std::vector<scene::Colouring> out;
  const auto table = tools::CsvTable::read(run.out() + "/epochs.csv", {.rows = 100, .line_bytes = 100000});
  EXPECT_TRUE(table.ok()) << (table ? "" : table.error().text);
  if (!table) return out;
  const auto column = table->column("colouring");
  EXPECT_TRUE(column.ok());
  for (size_t row = 0; column && row < table->rows(); ++row) {
    const std::string text = table->text(row, *column);
    const auto read = text.empty() ? Result<scene::Colouring>(scene::Colouring{}) : scene::colouring_from_text(text);
    EXPECT_TRUE(read.ok()) << text;
    if (read) out.push_back(*read);
  }
  return out;
}

bool shows_epoch(PipelineRun& run, double epoch) {
  return run.wait_status([&](const auto& s) { return value(s, "viewer-1", "epoch") == epoch; });
}

TEST_F(ColouredRun, WhatIsDisplayedIsWhatRaysSee) {
  const std::string by = "part:0:20";
  auto flags = with({"--colour-by", by, "--colour-map", "plasma", "--verify", "60", "--sampling-size", "480x300"});
  flags.insert(flags.end(), kComesToRest.begin(), kComesToRest.end());
  PipelineRun run(flags, mesh());
  ASSERT_TRUE(run.wait_showing()) << run.program().err();
  // Frames of the next epoch are compared with rays that see its colours.
  EXPECT_EQ(ctl(run, {"colour", "temperature:20:80", "map", "viridis"}), 0);
  EXPECT_TRUE(shows_epoch(run, 2));
  ASSERT_TRUE(run.wait_at_rest()) << run.program().err();
  const double frames = value(run.status(), "viewer-1", "frames");
  EXPECT_TRUE(run.wait_status([&](const auto& s) { return value(s, "viewer-1", "frames") > frames + 62; }));
  ASSERT_EQ(run.stop(), 0) << run.program().err();
  const auto s = run.summary();
  ASSERT_TRUE(s.is_object());
  EXPECT_EQ(s["errors"]["messages_rejected"], 0);
  EXPECT_GE(s["quality"]["views"], 2);
  EXPECT_GT(s["quality"]["psnr_db"]["median"], 26) << by;
  EXPECT_GT(s["quality"]["last_view"]["psnr_db"], 28) << by;
  const auto told = colourings(run);
  ASSERT_EQ(told.size(), 2u);
  EXPECT_EQ(told[0].array, "part");
  EXPECT_EQ(told[0].map.name, "plasma");
  EXPECT_EQ(told[0].hi, 20);
  const std::string session = read_text(run.out() + "/session.toml");
  EXPECT_NE(session.find(fmt::format("colour_by = \"{}\"", by)), std::string::npos) << session;
  EXPECT_NE(session.find("colour_map = \"plasma\""), std::string::npos) << session;
}

TEST_F(ColouredRun, ColoursChangeWhileItRuns) {
  PipelineRun run(with({"--duration", "0", "--trajectory", "still", "--target-fps", "20"}), mesh());
  ASSERT_TRUE(run.wait_showing()) << run.program().err();
  std::string out, err;
  // Another array is fetched, and then its epoch begins.
  EXPECT_EQ(ctl(run, {"colour", "temperature:20:80"}, &out, &err), 0) << err;
  EXPECT_NE(out.find("temperature"), std::string::npos) << out;
  EXPECT_TRUE(shows_epoch(run, 2)) << run.status().dump(1);
  // Its map and range change at once.
  EXPECT_EQ(ctl(run, {"colour", "map", "magma"}, &out, &err), 0) << err;
  EXPECT_NE(out.find("epoch 3"), std::string::npos) << out;
  EXPECT_TRUE(shows_epoch(run, 3));
  EXPECT_EQ(ctl(run, {"colour", "temperature", "map", "viridis"}, &out, &err), 0) << err;
  EXPECT_TRUE(shows_epoch(run, 4));
  std::ofstream(run.folder() / "map.json") << R"([{"Name": "two", "RGBPoints": [0, 0, 0, 1, 1, 1, 1, 0]}])";
  EXPECT_EQ(ctl(run, {"colour", "wind.y", "map", run.folder() / "map.json"}, &out, &err), 0) << err;
  EXPECT_TRUE(shows_epoch(run, 5));
  EXPECT_EQ(ctl(run, {"colour", "none"}, &out, &err), 0) << err;
  EXPECT_TRUE(shows_epoch(run, 6));

  EXPECT_EQ(ctl(run, {"colour", "pressure"}, &out, &err), 2);
  EXPECT_NE(err.find("temperature, wind (.x, .y ...), part"), std::string::npos) << err;
  for (const std::vector<std::string>& wrong : {std::vector<std::string>{"colour"},
                                                {"colour", "temperature:9:1"},
                                                {"colour", "map", "nonesuch"},
                                                {"colour", "map", "viridis"},
                                                {"colour", "a", "b"},
                                                {"colour", "map", run.folder() / "none.json"}})
    EXPECT_EQ(ctl(run, wrong), 2);
  EXPECT_EQ(value(run.status(), "viewer-1", "epoch"), 6) << "what was refused changed something";

  ASSERT_EQ(run.stop(), 0) << run.program().err();
  const auto told = colourings(run);
  ASSERT_EQ(told.size(), 6u);
  EXPECT_EQ(told[0].array, "");
  EXPECT_EQ(told[1].lo, 20);
  EXPECT_EQ(told[2].map.name, "magma");
  EXPECT_NEAR(told[3].hi, 100, 1);
  EXPECT_EQ(told[4].array, "wind.y");
  EXPECT_EQ(told[4].map.stops.size(), 2u);
  EXPECT_EQ(told[5].array, "");
  EXPECT_TRUE(run.all_gone());
}

TEST_F(ColouredRun, WhatIsWrongEndsWithCode2) {
  std::ofstream(folder_ / "t.off") << "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  struct Wrong {
    std::vector<std::string> words;
    std::string says;
  };
  for (const Wrong& wrong : {Wrong{{mesh(), "--colour-by", "pressure"}, "temperature, wind (.x, .y ...), part"},
                             Wrong{{mesh(), "--colour-by", "temperature:5:1"}, "--colour-by"},
                             Wrong{{mesh(), "--colour-by", "temperature", "--colour-map", "nonesuch"}, "--colour-map"},
                             Wrong{{folder_ / "t.off", "--colour-by", "temperature"}, "has no arrays"},
                             Wrong{{"julia", "--colour-by", "temperature"}, "--colour-by"}}) {
    std::vector<std::string> words{"run"};
    words.insert(words.end(), wrong.words.begin(), wrong.words.end());
    words.insert(words.end(), {"--out", folder_ / "run", "--duration", "1", "--size", "160x100"});
    Program program("telesplat", words, folder_ / "wrong");
    EXPECT_EQ(program.wait(60), 2) << wrong.says;
    EXPECT_NE(program.err().find(wrong.says), std::string::npos) << program.err();
  }
}

}  // namespace
}  // namespace telesplat::test
