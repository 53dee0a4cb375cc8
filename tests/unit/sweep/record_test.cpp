// A sweep's results: figures, noise, tables.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/support/patience.h"
#include "tools/common/csv_table.h"
#include "tools/telesplat/sweep/sweep.h"
#include "tools/telesplat/sweep/tables.h"

namespace telesplat::launcher {
namespace {

// Two configurations of `delays.size()` runs each, with the first one's inter-frame delays.
SweepRecord record_of(const std::vector<double>& delays) {
  SweepRecord out;
  out.grid.scene = "julia";
  out.grid.axes = {{"samplers", {"1", "2"}}};
  out.grid.repeat = int(delays.size());
  out.configurations = configurations(out.grid);
  for (size_t c = 0; c < 2; ++c)
    for (size_t i = 0; i < delays.size(); ++i) {
      SweptRun run{c, int(i) + 1, run_folder(out.configurations[c], int(i) + 1), RunOutcome{.done = true}, {}};
      run.figures = {{"samplers", double(c + 1)},
                     {"fps", 60},
                     {"inter_frame_delay_ms.median", c == 0 ? delays[i] : 20},
                     {"quality.hole_fraction.mean", 0.0125}};
      out.runs.push_back(run);
    }
  return out;
}

TEST(SweepFigures, AllNumbersOfASummaryHaveNames) {
  const auto summary = nlohmann::ordered_json::parse(
      R"({"schema": 2, "id": "x", "size": [1280, 800], "fps": 59.5, "delay": {"median": 16.7, "deep": {"p95": 18}},
          "quality": null, "flag": true, "machines": [{"host": "a", "cores": 4}]})");
  EXPECT_EQ(flatten(summary), (Figures{{"schema", 2},
                                       {"size.0", 1280},
                                       {"size.1", 800},
                                       {"fps", 59.5},
                                       {"delay.median", 16.7},
                                       {"delay.deep.p95", 18},
                                       {"machines.0.cores", 4}}));
  EXPECT_EQ(find(flatten(summary), "quality"), nullptr);
}

TEST(SweepFigures, SpreadsAreOfTheRunsThatHaveThem) {
  auto record = record_of({10, 30, 14});
  record.runs[1].figures.clear();
  const auto s = record.spread(0, "inter_frame_delay_ms.median");
  ASSERT_TRUE(s);
  EXPECT_EQ(s->runs, 2);
  EXPECT_EQ(s->median, 12);
  EXPECT_EQ(s->least, 10);
  EXPECT_EQ(s->most, 14);
  EXPECT_FALSE(record.spread(0, "view_update_latency_ms.median"));
}

TEST(SweepNoise, IsThreeRunsThatDifferByMoreThanATenth) {
  EXPECT_TRUE(noises(record_of({20, 20, 22})).empty()) << "a tenth is not more";
  EXPECT_TRUE(noises(record_of({20, 40})).empty()) << "two runs tell nothing";
  EXPECT_TRUE(noises(record_of({0, 0, 0})).empty());
  const auto record = record_of({20, 18, 25});
  const auto found = noises(record);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].configuration, 0u);
  EXPECT_STREQ(found[0].figure->name, "inter_frame_delay_ms.median");
  EXPECT_EQ(
      sentence(record, found[0]),
      "samplers=1: 3 runs differ by 35 % in inter-frame delay, median (18.0 to 25.0 ms): the machine was too noisy "
      "to tell smaller differences");
}

TEST(SweepNoise, LatencyCountsAndOtherFiguresDoNot) {
  auto record = record_of({20, 20, 20});
  for (size_t i = 0; i < 3; ++i) {
    record.runs[i].figures.emplace_back("view_update_latency_ms.median", 100.0 + 20 * double(i));
    record.runs[i].figures.emplace_back("data_transfer_rate_mb_s", double(i + 1));
  }
  const auto found = noises(record);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_STREQ(found[0].figure->name, "view_update_latency_ms.median");
}

// The table as other programs read it.
tools::CsvTable read_csv(const SweepRecord& record) {
  const std::string path = (std::filesystem::temp_directory_path() / "telesplat-sweep-test.csv").string();
  std::ofstream(path) << to_csv(record);
  auto table = tools::CsvTable::read(path, {});
  std::filesystem::remove(path);
  EXPECT_TRUE(table) << to_csv(record);
  return std::move(*table);
}

TEST(SweepCsv, HasARowForEachRunAndAColumnForEachNumber) {
  auto record = record_of({20, 18, 25});
  record.runs[4].outcome = RunOutcome{.attempts = 2, .exit_code = 1, .reason = "exit code 1: a, \"b\"\nc"};
  record.runs[4].figures.clear();
  record.runs[5].outcome.reset();
  record.runs[5].figures.clear();
  record.runs[2].figures.insert(record.runs[2].figures.begin() + 2, {"points_cached", 7});
  const auto table = read_csv(record);
  ASSERT_EQ(table.rows(), 6u);
  const auto text = [&](size_t row, const char* column) {
    const auto at = table.find(column);
    EXPECT_TRUE(at) << column;
    return at ? table.text(row, *at) : std::string();
  };
  EXPECT_EQ(text(0, "configuration"), "samplers-1");
  EXPECT_EQ(text(3, "flag.samplers"), "2");
  EXPECT_EQ(text(3, "samplers"), "2") << "the summary's own figure stands apart from the flag";
  EXPECT_EQ(text(2, "repetition"), "3");
  EXPECT_EQ(text(2, "inter_frame_delay_ms.median"), "25");
  EXPECT_EQ(text(2, "points_cached"), "7");
  EXPECT_EQ(text(0, "points_cached"), "");
  EXPECT_EQ(text(0, "noisy"), "inter_frame_delay_ms.median");
  EXPECT_EQ(text(3, "noisy"), "");
  EXPECT_EQ(text(0, "folder"), "samplers-1/1");
  EXPECT_EQ(text(0, "state"), "done");
  EXPECT_EQ(text(4, "state"), "failed");
  EXPECT_EQ(text(4, "reason"), "exit code 1: a, \"b\" c");
  EXPECT_EQ(text(4, "fps"), "");
  EXPECT_EQ(text(5, "state"), "open");
  EXPECT_EQ(text(5, "wall_s"), "");
}

TEST(SweepTable, TellsMedianRangeAndNoise) {
  const std::string text = to_text(record_of({20, 18, 25}));
  EXPECT_NE(text.find("20.0 (18.0..25.0) !"), std::string::npos) << text;
  EXPECT_NE(text.find("3/3"), std::string::npos) << text;
  EXPECT_NE(text.find("1.250"), std::string::npos) << "holes in percent: " << text;
  EXPECT_EQ(text.find("PSNR"), std::string::npos) << "what nobody measured has no column: " << text;
}

TEST(SweepFailures, NameRunAndReason) {
  auto record = record_of({20, 20});
  record.runs[1].outcome = RunOutcome{.attempts = 2, .exit_code = 1, .reason = "exit code 1: no disk"};
  EXPECT_EQ(failures(record), std::vector<std::string>{"samplers=1, run 2: exit code 1: no disk"});
}

TEST(SweepRun, SaysWhyItFailed) {
  EXPECT_EQ(complaint_in("session at tcp://x\ntelesplat: out of disk\nmore\n"), "out of disk");
  EXPECT_EQ(complaint_in("something\n\x1b[Klast words\n\n"), "[Klast words");
  EXPECT_EQ(complaint_in(""), "");
  EXPECT_EQ(complaint_in("telesplat: " + std::string(1000, 'x')).size(), 300u);
}

TEST(SweepRun, ReadsNoMoreThanTheEndOfALog) {
  const std::string log = (std::filesystem::temp_directory_path() / "telesplat-sweep-long.log").string();
  std::ofstream(log) << "before" << std::string(3 * kMostLastWords, 'x') << "\ntelesplat: out of disk\n";
  EXPECT_EQ(last_words(log, 6).size(), kMostLastWords);
  EXPECT_EQ(complaint_in(last_words(log, 6)), "out of disk");
  std::ofstream(log) << "before behind";
  EXPECT_EQ(last_words(log, 7), "behind");
  EXPECT_EQ(last_words(log, 13), "");
  EXPECT_EQ(last_words(log, 1000), "") << "somebody has cut the file";
  std::filesystem::remove(log);
  EXPECT_EQ(last_words(log, 0), "");
}

TEST(SweepRun, EndsWithCodeReasonAndTime) {
  const std::string log = (std::filesystem::temp_directory_path() / "telesplat-sweep-test.log").string();
  std::ofstream(log) << "telesplat: of the time before\n";
  int looks = 0;
  const auto count = [&](double) { ++looks; };
  const RunEnd failed = carry_out({"/bin/sh", {"-c", "echo 'telesplat: no luck' >&2; exit 3"}, log, 0}, count);
  EXPECT_EQ(failed.exit_code, 3);
  EXPECT_EQ(failed.reason, "exit code 3: no luck");
  EXPECT_FALSE(failed.interrupted);
  const RunEnd quiet = carry_out({"/bin/sh", {"-c", "exit 4"}, log, 0}, count);
  EXPECT_EQ(quiet.reason, "exit code 4") << "what was said before is not of this run";
  const RunEnd killed = carry_out({"/bin/sh", {"-c", "kill -9 $$"}, log, 0}, count);
  EXPECT_EQ(killed.reason, "ended by signal 9");
  const RunEnd late = carry_out({"/bin/sh", {"-c", "exec sleep 60"}, log, 0.2}, count);
  EXPECT_EQ(late.reason, "took longer than 0 s");
  EXPECT_LT(late.wall_s, test::patient(20));
  EXPECT_GT(looks, 0);
  EXPECT_EQ(carry_out({"/bin/sh", {"-c", "exit 0"}, log, 0}, count).reason, "");
  std::filesystem::remove(log);
}

}  // namespace
}  // namespace telesplat::launcher
