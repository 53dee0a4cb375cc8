// `telesplat bench codec` as a program: a mesh and a volume that are made here, recorded images, what it refuses.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "common/codec/depth_codec.h"
#include "tests/support/depth_images.h"
#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

class CodecBench : public ::testing::Test {
 protected:
  // Its exit code.
  int run(std::vector<std::string> arguments, const std::vector<std::string>& more = {"--seconds", "0.01"}) {
    arguments.insert(arguments.begin(), {"bench", "codec"});
    arguments.insert(arguments.end(), more.begin(), more.end());
    program = std::make_unique<Program>("telesplat", arguments, folder / "bench");
    return program->wait(120);
  }
  nlohmann::json sets() const { return nlohmann::json::parse(read_text(folder / "out.json")).at("sets"); }

  TemporaryFolder folder;
  std::unique_ptr<Program> program;
};

TEST_F(CodecBench, MeasuresViewsOfAMesh) {
  write_terrain(folder / "terrain.ply", 40);
  ASSERT_EQ(run({folder / "terrain.ply", "--views", "2", "--size", "640x400", "--coders", "lzw,tiff,png,zstd,rvl",
                 "--cache", folder / "cache", "--json", folder / "out.json", "--errors", folder / "errors.png"}),
            0)
      << program->err();
  for (const char* row :
       {"terrain.ply: 2 images", "| telesplat |", "| LZW |", "| PNG |", "| zstd -3 |", "| RVL |", "lossless"})
    EXPECT_NE(program->out().find(row), std::string::npos) << row << "\n" << program->out();
  const auto all = sets();
  ASSERT_EQ(all.size(), 1u);
  const auto& depth = all[0];
  EXPECT_EQ(depth["kind"], "depth");
  EXPECT_EQ(depth["images"], 2);
  EXPECT_GT(depth["covered_pixels"], 1000);
  const auto& bits = depth["bits_per_pixel"];
  EXPECT_GT(bits["telesplat"]["all"], 1);
  for (const char* coder : {"lzw", "tiff", "png", "zstd"}) EXPECT_LT(bits[coder]["ratio"].get<double>(), 1) << coder;
  EXPECT_LT(bits["telesplat"]["depth"], bits["rvl"]["depth"]);
  EXPECT_EQ(depth["errors"]["depth_px"]["largest"], 0);
  EXPECT_GT(fs::file_size(folder / "errors.png"), 100u);
}

TEST_F(CodecBench, MeasuresViewsOfAJuliaSetAndOfAVolume) {
  write_volume(folder / "balls.mha", 24);
  ASSERT_EQ(run({"julia", folder / "balls.mha", "--views", "2", "--size", "320x200", "--coders", "none", "--json",
                 folder / "out.json"}),
            0)
      << program->err();
  const auto all = sets();
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0]["name"], "julia");
  EXPECT_EQ(all[0]["images"], 2);
  EXPECT_GT(all[0]["covered_pixels"], 1000);
  EXPECT_EQ(all[1]["kind"], "slices");
  EXPECT_EQ(all[1]["views"], 2);
  EXPECT_GT(all[1]["bits_per_pixel"]["telesplat"], 0);
  EXPECT_FALSE(all[1]["speeds"].empty());
  EXPECT_EQ(all[1]["errors"]["pixels"], 0);
}

TEST_F(CodecBench, MeasuresRecordedImages) {
  for (const char* name : {"made-1.depth", "made-2.depth"}) {
    const auto bytes = codec::encode(render({.width = 512, .height = 256}));
    std::ofstream(folder / name, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
  }
  ASSERT_EQ(run({folder.path(), "--coders", "lzw", "--json", folder / "out.json"}), 0) << program->err();
  const auto all = sets();
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0]["name"], "made");
  EXPECT_EQ(all[0]["images"], 2);
  EXPECT_EQ(all[0]["full_tiles"], 4);
  EXPECT_FALSE(all[0]["speeds"].empty());
}

TEST_F(CodecBench, RefusesWhatItCannotTake) {
  std::ofstream(folder / "noise.depth") << "this is no depth image";
  struct Wrong {
    std::vector<std::string> arguments;
    std::string said;
  };
  const Wrong cases[] = {{{folder / "noise.depth"}, "noise.depth: "},
                         {{folder / "none.depth"}, "none.depth"},
                         {{folder / "none.ply"}, "none.ply"},
                         {{folder / "noise.depth", "--coders", "lzw,gzip"}, "there is no gzip"},
                         {{folder / "noise.depth", "--views", "0"}, "--views"},
                         {{folder / "noise.depth", "--size", "0x3"}, "--size"},
                         {{folder / "noise.depth", "--trajectory", folder / "none.csv"}, "none.csv"}};
  for (const Wrong& wrong : cases) {
    EXPECT_EQ(run(wrong.arguments), 2) << wrong.said;
    EXPECT_NE(program->err().find(wrong.said), std::string::npos) << program->err();
  }
}

}  // namespace
}  // namespace telesplat::test
