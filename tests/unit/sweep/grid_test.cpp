// The grid of a sweep: the meaning of --vary, the cells, their names and the order in which they run.
#include <gtest/gtest.h>

#include <set>

#include "tools/telesplat/run/run_options.h"
#include "tools/telesplat/sweep/manifest.h"
#include "tools/telesplat/sweep/sweep.h"

namespace telesplat::launcher {
namespace {

class SweepGrid : public ::testing::Test {
 protected:
  // Adds the axes of these --vary. Returns the first error, or "".
  std::string vary(const std::vector<std::string>& texts) {
    for (const auto& text : texts)
      if (const Status s = add_axis(text, flags, grid.axes); !s) return s.error().text;
    return {};
  }
  std::vector<std::string> all_names() const {
    std::vector<std::string> out;
    for (const auto& c : configurations(grid)) out.push_back(c.name);
    return out;
  }

  RunOptions options;
  options::Table flags = table(options);
  Grid grid;
};

TEST_F(SweepGrid, EveryCombinationIsACellTheLastFlagFastest) {
  ASSERT_EQ(vary({"coupling=sync,loose", "--samplers=1,2,4"}), "");
  EXPECT_EQ(grid.axes, (std::vector<Axis>{{"coupling", {"sync", "loose"}}, {"samplers", {"1", "2", "4"}}}));
  EXPECT_EQ(all_names(), (std::vector<std::string>{"coupling-sync_samplers-1", "coupling-sync_samplers-2",
                                                   "coupling-sync_samplers-4", "coupling-loose_samplers-1",
                                                   "coupling-loose_samplers-2", "coupling-loose_samplers-4"}));
  EXPECT_EQ(words(grid, configurations(grid)[4]), "coupling=loose samplers=2");
}

TEST_F(SweepGrid, NothingVariesInOneCell) {
  EXPECT_EQ(all_names(), std::vector<std::string>{"run"});
  EXPECT_EQ(words(grid, configurations(grid)[0]), "all runs");
}

TEST_F(SweepGrid, SemicolonsLeaveCommasToTheValues) {
  ASSERT_EQ(vary({"eye=0,0,1;0,1,1", "eye=1,1,1;"}), "");
  EXPECT_EQ(grid.axes, (std::vector<Axis>{{"eye", {"0,0,1", "0,1,1", "1,1,1"}}}));
  EXPECT_EQ(all_names(), (std::vector<std::string>{"eye-0-0-1", "eye-0-1-1", "eye-1-1-1"}));
}

TEST_F(SweepGrid, AgainTheSameFlagAddsValues) {
  ASSERT_EQ(vary({"samplers=1", "coupling=sync", "samplers=2,3"}), "");
  EXPECT_EQ(grid.axes, (std::vector<Axis>{{"samplers", {"1", "2", "3"}}, {"coupling", {"sync"}}}));
}

TEST_F(SweepGrid, WhatRunWouldRefuseIsNamed) {
  EXPECT_EQ(vary({"samplrs=1"}), "--vary samplrs: no such flag of telesplat run; did you mean samplers?");
  EXPECT_EQ(vary({"samplers=1,two"}), "--samplers two: is not a whole number");
  EXPECT_EQ(vary({"samplers=99"}), "--samplers 99: is not between 1 and 64");
  EXPECT_EQ(vary({"coupling"}), "--vary coupling: is not FLAG=VALUE,VALUE,...");
  EXPECT_EQ(vary({"coupling="}), "--vary coupling=: is not FLAG=VALUE,VALUE,...");
  EXPECT_EQ(vary({"coupling=sync,,loose"}), "--vary coupling=sync,,loose: has an empty value");
  grid.axes.clear();
  EXPECT_EQ(vary({"coupling=sync,loose", "coupling=sync"}), "--vary coupling: sync stands there twice");
}

TEST_F(SweepGrid, AFlagWithoutValueIsOnOrOff) {
  ASSERT_EQ(vary({"exr=on,off"}), "");
  grid.scene = "a.ply";
  const auto cells = configurations(grid);
  EXPECT_EQ(arguments(grid, cells[0], flags), (std::vector<std::string>{"a.ply", "--exr"}));
  EXPECT_EQ(arguments(grid, cells[1], flags), (std::vector<std::string>{"a.ply"}));
  EXPECT_EQ(vary({"exr=yes"}), "--exr yes: is neither on nor off");
}

TEST_F(SweepGrid, ScenesMayVaryAndAreNamedByTheirFiles) {
  ASSERT_EQ(vary({"scene=/data/a b.ply,julia,other/a b.ply"}), "");
  grid.flags = {"--duration", "2"};
  EXPECT_EQ(all_names(), (std::vector<std::string>{"scene-a-b", "scene-julia", "scene-a-b-2"}))
      << "no two have one folder";
  EXPECT_EQ(arguments(grid, configurations(grid)[0], flags),
            (std::vector<std::string>{"/data/a b.ply", "--duration", "2"}));
}

TEST_F(SweepGrid, ValuesCannotLeaveTheFolder) {
  ASSERT_EQ(vary({"trajectory=../..,a/b,<b>&\""}), "");
  for (const std::string& name : all_names()) {
    EXPECT_EQ(name.find_first_of("/<>&\" "), std::string::npos) << name;
    EXPECT_TRUE(name.starts_with("trajectory-")) << name;
  }
}

TEST_F(SweepGrid, LongNamesAreCutAndStayApart) {
  const std::string many(300, 'x');
  ASSERT_EQ(vary({"trajectory=" + many + "1," + many + "2"}), "");
  const auto names = all_names();
  EXPECT_LT(names[0].size(), 130u);
  EXPECT_NE(names[0], names[1]);
}

TEST_F(SweepGrid, ARepetitionIsOverBeforeTheNextBegins) {
  grid.repeat = 3;
  const auto runs = run_order(grid, 4);
  ASSERT_EQ(runs.size(), 12u);
  for (size_t i = 0; i < runs.size(); ++i) {
    EXPECT_EQ(runs[i].repetition, int(i / 4) + 1);
    EXPECT_EQ(runs[i].configuration, i % 4);
  }
}

TEST_F(SweepGrid, ASeedShufflesWithinRepetitionsAndAlwaysTheSame) {
  grid.repeat = 2;
  grid.shuffle = 7;
  const auto runs = run_order(grid, 20), again = run_order(grid, 20);
  bool moved = false;
  for (int repetition = 0; repetition < 2; ++repetition) {
    std::set<size_t> seen;
    for (size_t i = 0; i < 20; ++i) {
      const auto& run = runs[size_t(repetition) * 20 + i];
      EXPECT_EQ(run.repetition, repetition + 1);
      EXPECT_EQ(run.configuration, again[size_t(repetition) * 20 + i].configuration);
      moved |= run.configuration != i;
      seen.insert(run.configuration);
    }
    EXPECT_EQ(seen.size(), 20u);
  }
  EXPECT_TRUE(moved);
}

TEST(SweepCheck, IsWhatRunItselfSays) {
  const auto wrong = [](const std::vector<std::string>& words) {
    const auto checked = check_run(words);
    return checked ? std::string() : checked.error().text;
  };
  EXPECT_EQ(wrong({"julia", "--duration", "3"}), "");
  EXPECT_EQ(*check_run({"julia", "--duration", "3"}), 3);
  EXPECT_EQ(wrong({"julia", "--durration", "3"}),
            "--durration: no such flag of telesplat run; did you mean --duration?");
  EXPECT_EQ(wrong({"julia", "--samplers=x"}), "--samplers x: is not a whole number");
  EXPECT_EQ(wrong({"julia", "x"}), "x: telesplat run takes no more arguments");
  EXPECT_EQ(wrong({"julia", "--duration"}), "--duration: its value is missing");
  EXPECT_NE(wrong({"/no/such.ply"}).find("/no/such.ply"), std::string::npos);
  EXPECT_NE(wrong({"julia", "--up", "z"}), "") << "a flag that the scene does not have";
  EXPECT_EQ(wrong({"julia", "--help"}), "--help: is of telesplat run alone");
  EXPECT_NE(wrong({"julia", "--duration", "0"}).find("does not end by itself"), std::string::npos);
  EXPECT_EQ(wrong({"julia", "--duration", "0", "--frames", "5"}), "");
  for (const char* flag : {"--out=x", "--overwrite", "--master=tcp://127.0.0.1:1", "--movie=a.mp4"})
    EXPECT_NE(wrong({"julia", flag}).find("is not for sweeps"), std::string::npos) << flag;
  EXPECT_NE(wrong({}), "");
}

}  // namespace
}  // namespace telesplat::launcher
