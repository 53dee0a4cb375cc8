// The programs' own descriptions beside --help: versions, manual pages, completion.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "common/core/version.h"
#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPrograms[] = {"telesplat",        "telesplat-master", "telesplat-data",   "telesplat-sampler",
                                     "telesplat-packer", "telesplat-viewer", "telesplat-health", "telesplat-wan-relay"};

std::string output_of(const TemporaryFolder& folder, const std::string& name, std::vector<std::string> arguments) {
  Program program(name, std::move(arguments), folder / "program");
  EXPECT_EQ(program.wait(30), 0) << name << ": " << program.err();
  return program.out();
}

TEST(Manuals, EveryProgramTellsItsVersion) {
  TemporaryFolder folder;
  for (const char* name : kPrograms)
    EXPECT_EQ(output_of(folder, name, {"--version"}).substr(0, std::string(name).size() + 1), std::string(name) + " ");
  EXPECT_EQ(output_of(folder, "telesplat", {"--version"}), "telesplat " + version() + "\n");
}

TEST(Manuals, EveryProgramAndCommandHasAPageThatGroffTakes) {
  TemporaryFolder folder;
  output_of(folder, "telesplat", {"man", "--out", folder / "pages"});
  for (const char* name : kPrograms) EXPECT_TRUE(fs::exists(folder / "pages/" + name + ".1")) << name;
  const std::string run = read_text(folder / "pages/telesplat-run.1");
  for (const char* flag : {"\\-\\-duration", "\\-\\-samplers", "\\-\\-packing.max_points"})
    EXPECT_NE(run.find(flag), std::string::npos) << flag;
  if (std::system("command -v groff > /dev/null 2>&1") != 0) GTEST_SKIP() << "groff is not installed";
  for (const auto& page : fs::directory_iterator(folder / "pages")) {
    const std::string said = folder / "said",
                      command = "groff -man -ww -Tutf8 " + page.path().string() + " 2> " + said + " > /dev/null";
    EXPECT_EQ(std::system(command.c_str()), 0);
    EXPECT_EQ(read_text(folder / "said"), "") << page.path();
  }
}

TEST(Manuals, BashCompletesARunsFlagsAndValues) {
  TemporaryFolder folder;
  std::ofstream(folder / "telesplat.bash") << output_of(folder, "telesplat", {"completion", "bash"});
  const auto offered = [&](const std::string& words, int last) {
    std::ofstream(folder / "drive.sh") << "PATH=" TELESPLAT_BIN ":$PATH\nsource " << folder / "telesplat.bash"
                                       << "\nCOMP_WORDS=(" << words << ")\nCOMP_CWORD=" << last
                                       << "\n_telesplat\necho \"${COMPREPLY[@]}\"\n";
    const std::string command = "bash " + (folder / "drive.sh") + " > " + (folder / "offered") + " 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0);
    return read_text(folder / "offered");
  };
  EXPECT_EQ(offered("telesplat run --splat ''", 3), "square disc ellipse ewa\n");
  EXPECT_EQ(offered("telesplat run --dura", 2), "--duration\n");
  EXPECT_EQ(offered("telesplat cache l", 2), "list limit\n");
  EXPECT_NE(offered("telesplat ctl ''", 2).find("status"), std::string::npos);
}

}  // namespace
}  // namespace telesplat::test
