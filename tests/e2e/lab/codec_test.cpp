// `telesplat-lab codec` as a program: recorded images, and what it refuses.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "common/codec/depth_codec.h"
#include "tests/support/depth_images.h"
#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

class CodecTable : public ::testing::Test {
 protected:
  // Its exit code.
  int run(const std::string& path) {
    program = std::make_unique<Program>("telesplat-lab", std::vector<std::string>{"codec", path}, folder / "lab");
    return program->wait(120);
  }

  TemporaryFolder folder;
  std::unique_ptr<Program> program;
};

TEST_F(CodecTable, HasARowForAFolderOfImages) {
  std::filesystem::create_directories(folder / "walk/depth");
  for (const char* name : {"walk/depth/frame-1.depth", "walk/depth/frame-2.depth"}) {
    const auto bytes = codec::encode(render({.width = 512, .height = 256}));
    std::ofstream(folder / name, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
  }
  ASSERT_EQ(run(folder / "walk"), 0) << program->err();
  EXPECT_NE(program->out().find("| walk | 2 | 4 |"), std::string::npos) << program->out();
}

TEST_F(CodecTable, RefusesWhatHoldsNoDepthImage) {
  std::ofstream(folder / "noise.depth") << "this is no depth image";
  for (const char* name : {"noise.depth", "none.depth", "none"}) {
    EXPECT_EQ(run(folder / name), 2) << name;
    EXPECT_NE(program->err().find(std::string(name) + ": "), std::string::npos) << program->err();
  }
}

}  // namespace
}  // namespace telesplat::test
