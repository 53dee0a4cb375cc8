// Shell completion and manual pages, made from the tables of the command line.
#include "common/options/manual.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <set>
#include <sstream>

namespace telesplat::options {
namespace {

namespace fs = std::filesystem;

struct Settings {
  std::string scene, shell, texture, kernel = "disc", out;
  double speed = 2;
  bool cache = true, lit = true;
};

Table run_table(Settings& s) {
  return {{.flag = "scene", .value = &s.scene, .help = "a file or the word 'julia'"},
          {.flag = "--splat", .value = &s.kernel, .help = "kernel: one of", .limits = Names{"square", "disc"}},
          {.flag = "--speed,-s", .value = &s.speed, .help = ".5 is slow\n'quoted'", .limits = Range{0, 10}},
          {.flag = "!--no-cache", .value = &s.cache, .help = "keep no store \\ at all"},
          {.flag = "--lighting", .value = &s.lit, .help = "shade", .group = "Volumes", .on_off = true},
          {.flag = "--texture", .value = &s.texture, .help = "an image; größer", .group = "Volumes", .is_file = true}};
}

Manual manual(Settings& s) {
  Manual shell{"tool ctl shell",
               "which",
               {{.flag = "shell", .value = &s.shell, .help = "it", .limits = Names{"bash", "zsh"}, .required = true}},
               "",
               {}};
  return {"tool",
          "tool: does things.",
          {},
          "",
          {{"tool run", "runs: it", run_table(s), "Keys:\n  .a  b", {}},
           {"tool ctl", "orders", {}, "", {shell, {"tool ctl stop", "ends", {}, "", {}}}}}};
}

std::string output_of(const std::string& command) {
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
  std::string out;
  char part[4096];
  while (const size_t n = fread(part, 1, sizeof part, pipe.get())) out.append(part, n);
  return out;
}

bool is_installed(const std::string& program) {
  return std::system(("command -v " + program + " > /dev/null 2>&1").c_str()) == 0;
}

class Manuals : public testing::Test {
 protected:
  Manuals() {
    folder_ = fs::temp_directory_path() /
              (std::string("telesplat-manual-") + testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~Manuals() override { fs::remove_all(folder_); }
  std::string written(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  Settings settings_;
  fs::path folder_;
};

using Words = std::set<std::string>;

class Completion : public Manuals {
 protected:
  // Returns the candidates for the last of these words.
  Words offered(const std::vector<std::string>& words) {
    std::istringstream lines(candidates(manual(settings_), words));
    Words out;
    for (std::string line; std::getline(lines, line);) out.insert(line.substr(0, line.find('\t')));
    return out;
  }
};

TEST_F(Completion, CommandsAndTheirCommands) {
  EXPECT_EQ(offered({""}), (Words{"run", "ctl"}));
  EXPECT_EQ(offered({"r"}), (Words{"run"}));
  EXPECT_EQ(offered({"ctl", ""}), (Words{"shell", "stop"}));
  EXPECT_EQ(offered({"ctl", "shell", ""}), (Words{"bash", "zsh"}));
}

TEST_F(Completion, FlagsOfTheCommand) {
  EXPECT_EQ(offered({"run", "--s"}), (Words{"--speed", "--splat"}));
  EXPECT_EQ(offered({"run", "a.ply", "--no"}), (Words{"--no-cache"}));
  EXPECT_EQ(offered({"--v"}), (Words{"--version"}));
  EXPECT_EQ(offered({"ctl", "--s"}), Words{});
  EXPECT_EQ(candidates(manual(settings_), {"run", "--no"}), "--no-cache\tkeep no store \\ at all\n");
}

TEST_F(Completion, ValuesOfFlags) {
  EXPECT_EQ(offered({"run", "--splat", ""}), (Words{"square", "disc"}));
  EXPECT_EQ(offered({"run", "--splat", "=", "sq"}), (Words{"square"}));
  EXPECT_EQ(offered({"run", "--splat", "="}), (Words{"square", "disc"}));
  EXPECT_EQ(offered({"run", "--splat=sq"}), (Words{"--splat=square"}));
  EXPECT_EQ(offered({"run", "--lighting", "o"}), (Words{"on", "off"}));
  EXPECT_EQ(offered({"run", "--splat", "disc", "--spl"}), (Words{"--splat"}));
}

TEST_F(Completion, OfFilesIsTheShells) {
  EXPECT_EQ(offered({"run", "--texture", "im"}), Words{});
  EXPECT_EQ(offered({"run", "a"}), Words{});
}

TEST_F(Manuals, ShellsReadTheirScripts) {
  for (const auto& [shell, of] : {std::pair{"bash", Shell::kBash}, {"zsh", Shell::kZsh}, {"fish", Shell::kFish}}) {
    const std::string file = written(shell, completion("tool", of));
    if (is_installed(shell)) EXPECT_EQ(output_of(fmt::format("{} -n {} 2>&1", shell, file)), "") << shell;
  }
}

TEST_F(Manuals, PagesTellEveryFlag) {
  const Manual all = manual(settings_);
  const std::string page = man_page(all.commands[0], "1.2", false);
  for (const char* part :
       {".TH TOOL\\-RUN 1", "tool\\-run \\- runs: it", "\\fB\\-\\-splat\\fR \\fItext\\fR",
        "(square, disc). Default: disc", "\\fB\\-\\-speed\\fR, \\fB\\-s\\fR", "(0 to 10)", "(on or off)", ".SS Volumes",
        "\\&.5 is slow", "\\&'quoted'", "store \\e at all", "gr\\[u00F6]\\[u00DF]er"})
    EXPECT_NE(page.find(part), std::string::npos) << part << "\n" << page;
  EXPECT_EQ(page.find("\\-\\-cache"), std::string::npos);
  EXPECT_NE(man_page(all, "1", true).find("\\fBtool\\-run\\fR(1)"), std::string::npos);
  EXPECT_NE(man_page(all.commands[1], "1", false).find(".SH tool ctl shell"), std::string::npos);
}

TEST_F(Manuals, GroffHasNothingToSayAboutThem) {
  if (!is_installed("groff")) GTEST_SKIP() << "groff is not installed";
  const Manual all = manual(settings_);
  for (const Manual* m : {&all, &all.commands[0], &all.commands[1]})
    for (const bool separate : {false, true}) {
      const std::string page = written("page.1", man_page(*m, "1.2", separate));
      EXPECT_EQ(output_of("groff -man -ww -Tutf8 " + page + " 2>&1 > /dev/null"), "") << m->name;
    }
}

}  // namespace
}  // namespace telesplat::options
