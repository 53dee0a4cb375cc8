// Pictures have the legend of their colours; frames that are compared do not.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "common/colour/colour_map.h"
#include "common/image/legend.h"
#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

// A hill with the property `height`, 0 to 50.
void write_hill(const std::string& path, int n = 50) {
  std::ofstream out(path);
  out << "ply\nformat ascii 1.0\nelement vertex " << n * n << "\nproperty float x\nproperty float y\nproperty float z\n"
      << "property float height\nelement face " << 2 * (n - 1) * (n - 1)
      << "\nproperty list uchar int vertex_indices\nend_header\n";
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const double x = 2.0 * i / (n - 1) - 1, y = 2.0 * j / (n - 1) - 1, z = std::max(0.0, 1 - x * x - y * y);
      out << fmt::format("{} {} {} {}\n", x, y, 0.5 * z, 50 * z);
    }
  for (int j = 0; j + 1 < n; ++j)
    for (int i = 0; i + 1 < n; ++i) {
      const int a = j * n + i;
      out << fmt::format("3 {} {} {}\n3 {} {} {}\n", a, a + 1, a + n + 1, a, a + n + 1, a + n);
    }
}

image::View last_picture(const PipelineRun& run) {
  auto view = image::read_view(newest_picture(run));
  EXPECT_TRUE(view);
  return view ? std::move(*view) : image::View{};
}

// Returns the share of pixels at the legend's place that show the legend; 1: all that it covers wholly.
double matches(const image::View& picture, const image::Legend& legend) {
  const image::View over = image::legend_picture(legend, picture.width, picture.height);
  const auto place = image::legend_place(over, picture.width, picture.height);
  int opaque = 0, same = 0;
  for (int y = 0; y < over.height; ++y)
    for (int x = 0; x < over.width; ++x) {
      const uint32_t wanted = over.colour[size_t(y) * size_t(over.width) + size_t(x)];
      if (wanted >> 24 != 255) continue;
      ++opaque;
      const size_t at = size_t(place.y + y) * size_t(picture.width) + size_t(place.x + x);
      same += (picture.colour[at] & 0xffffff) == (wanted & 0xffffff);
    }
  return double(same) / opaque;
}

TEST(LegendRun, PicturesOfAColouredMeshHaveItUnlessToldOtherwise) {
  TemporaryFolder folder;
  write_hill(folder / "hill.ply");
  const image::Legend expected{"height", 0, 40, *colour::find_colour_map("plasma"), {}};
  for (const std::string legend : {"on", "off"}) {
    PipelineRun run({"--colour-by", "height:0:40", "--colour-map", "plasma", "--duration", "1", "--size", "640x400",
                     "--legend", legend, "--cache", folder / "cache"},
                    folder / "hill.ply");
    ASSERT_EQ(run.program().wait(100), 0) << run.program().err();
    const double share = matches(last_picture(run), expected);
    if (legend == "on")
      EXPECT_EQ(share, 1);
    else
      EXPECT_LT(share, 0.2);
  }
}

TEST(LegendRun, AVolumeTellsItsTransferFunctionAndAPlainMeshNothing) {
  TemporaryFolder folder;
  write_volume(folder / "balls.mha");
  PipelineRun volume({"--duration", "1", "--size", "640x400", "--tf", "grey"}, folder / "balls.mha");
  ASSERT_EQ(volume.program().wait(100), 0) << volume.program().err();
  const auto ink = [](const image::View& v) {
    return std::count_if(v.colour.begin(), v.colour.end(), [](uint32_t c) { return (c & 0xffffff) == 0xf4f4f4; });
  };
  EXPECT_GT(ink(last_picture(volume)), 200);
  PipelineRun mesh({"--duration", "1", "--size", "640x400"});
  ASSERT_EQ(mesh.program().wait(100), 0) << mesh.program().err();
  EXPECT_LT(ink(last_picture(mesh)), 50);
}

TEST(TextureRun, AMissingPictureIsToldAndADamagedOneIsBadInput) {
  TemporaryFolder folder;
  std::ofstream(folder / "quad.obj") << "mtllib quad.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\n"
                                        "vt 0 1\nusemtl m\nf 1/1 2/2 3/3 4/4\n";
  std::ofstream(folder / "quad.mtl") << "newmtl m\nKd 1 0 0\nmap_Kd picture.png\n";
  PipelineRun missing({"--duration", "0.5", "--cache", folder / "cache"}, folder / "quad.obj");
  EXPECT_EQ(missing.program().wait(60), 0) << missing.program().err();
  EXPECT_NE(missing.program().err().find("picture.png is not there"), std::string::npos) << missing.program().err();
  std::ofstream(folder / "picture.png") << "this is no picture";
  PipelineRun damaged({"--duration", "0.5", "--cache", folder / "cache"}, folder / "quad.obj");
  EXPECT_EQ(damaged.program().wait(60), 2);
  EXPECT_NE(damaged.program().err().find("picture.png"), std::string::npos) << damaged.program().err();
}

}  // namespace
}  // namespace telesplat::test
