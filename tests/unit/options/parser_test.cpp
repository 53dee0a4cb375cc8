#include "common/options/parser.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>

namespace telesplat::options {
namespace {

struct Settings {
  std::string scene, master = "here";
  double speed = 2;
  bool cache = true, lit = true;
  std::vector<std::string> words;
};

Table table(Settings& s) {
  return {
      {.flag = "scene", .value = &s.scene, .help = "a file", .required = true},
      {.flag = "--master", .value = &s.master, .help = "address", .environment = "TELESPLAT_PARSER_TEST"},
      {.flag = "--speed,-s", .value = &s.speed, .help = "metres a second", .limits = Range{0, 10}},
      {.flag = "!--no-cache", .value = &s.cache, .help = "keep no store"},
      {.flag = "--lighting", .value = &s.lit, .help = "shade", .on_off = true},
      {.flag = "--word", .value = &s.words, .help = "several"},
      {.flag = "--seldom", .value = &s.speed, .help = "what few need", .seldom = true},
  };
}

Settings parsed(std::vector<std::string> arguments) {
  Settings s;
  Parser parser("about");
  parser.add(table(s));
  parser.parse_or_exit("program", std::move(arguments));
  return s;
}

TEST(Parser, GivesRowsTheirValues) {
  const Settings s = parsed({"a.ply", "--speed", "3.5", "--no-cache", "--lighting=off", "--word", "x", "--word", "y"});
  EXPECT_EQ(s.scene, "a.ply");
  EXPECT_EQ(s.speed, 3.5);
  EXPECT_FALSE(s.cache);
  EXPECT_FALSE(s.lit);
  EXPECT_EQ(s.words, (std::vector<std::string>{"x", "y"}));
}

TEST(Parser, TheLastValueWins) { EXPECT_EQ(parsed({"a", "--speed=1", "-s", "4"}).speed, 4); }

TEST(Parser, AFlagThatIsGivenAgainTakesOneValueEachTime) {
  const Settings s = parsed({"--word", "x", "a.ply", "--word=y"});
  EXPECT_EQ(s.scene, "a.ply");
  EXPECT_EQ(s.words, (std::vector<std::string>{"x", "y"}));
}

TEST(Parser, WordsForLaterAreReadWithoutEnding) {
  const auto wrong = [](std::vector<std::string> words) {
    Settings s;
    Parser parser("about");
    parser.add(table(s));
    const Status read = parser.parse("program run", std::move(words));
    return read ? std::string() : read.error().text;
  };
  EXPECT_EQ(wrong({"a.ply", "--speed", "3"}), "");
  EXPECT_EQ(wrong({"a.ply", "--sped", "3"}), "--sped: no such flag of program run; did you mean --speed?");
  EXPECT_EQ(wrong({"a.ply", "--speed", "30"}), "--speed 30: is not between 0 and 10");
  EXPECT_EQ(wrong({"a.ply", "b.ply"}), "b.ply: program run takes no more arguments");
  EXPECT_EQ(wrong({"a.ply", "--speed"}), "--speed: its value is missing");
  EXPECT_NE(wrong({}).find("program run needs scene"), std::string::npos);
  EXPECT_EQ(wrong({"--help"}), "--help: is of program run alone");
}

TEST(Parser, TellsWhatWasGiven) {
  Settings s;
  Parser parser("about");
  parser.add(table(s));
  parser.parse_or_exit("program", {"a", "-s", "4"});
  EXPECT_EQ(parser.given(), (Given{"scene", "--speed"}));
}

TEST(Parser, LooksIntoTheEnvironment) {
  setenv("TELESPLAT_PARSER_TEST", "there", 1);
  EXPECT_EQ(parsed({"a"}).master, "there");
  EXPECT_EQ(parsed({"a", "--master", "else"}).master, "else");
  unsetenv("TELESPLAT_PARSER_TEST");
}

TEST(ParserDeathTest, BadUsageEndsWithTwoAndSaysWhy) {
  EXPECT_EXIT(parsed({"a", "--speed", "nan"}), testing::ExitedWithCode(2),
              "program: --speed nan: is not between 0 and 10");
  EXPECT_EXIT(parsed({"a", "--speed", "fast"}), testing::ExitedWithCode(2), "--speed fast: is not a number");
  EXPECT_EXIT(parsed({}), testing::ExitedWithCode(2), "^program: program needs scene; program --help tells");
  EXPECT_EXIT(parsed({"a", "b"}), testing::ExitedWithCode(2), "^program: b: program takes no more arguments\n$");
  EXPECT_EXIT(parsed({"a", "--speed"}), testing::ExitedWithCode(2), "^program: --speed: its value is missing\n$");
}

TEST(ParserDeathTest, AWrongFlagIsNamedAloneAndTheNearestOneSuggested) {
  const auto two = testing::ExitedWithCode(2);
  EXPECT_EXIT(parsed({"--sped", "3"}), two, "^program: --sped: no such flag of program; did you mean --speed.\n$");
  EXPECT_EXIT(parsed({"a", "--mastre=tcp://x:1"}), two, "^program: --mastre: no such flag of .*mean --master.\n$");
  EXPECT_EXIT(parsed({"a", "--ligh"}), two, "did you mean --lighting") << "the beginning of a flag";
  EXPECT_EXIT(parsed({"a", "--nothing", "--speed", "3"}), two, "^program: --nothing: no such flag of program\n$");
  EXPECT_EXIT(parsed({"a", "--speed", "--sped", "3"}), two, "--speed --sped: is not a number") << "a value";
  EXPECT_EXIT(parsed({"a", "-x"}), two, "^program: -x: no such flag of program\n$");
}

TEST(ParserDeathTest, AWrongCommandIsNamedAndTheNearestOneSuggested) {
  const auto parse = [](std::vector<std::string> arguments) {
    Settings s;
    Parser parser("about");
    parser.command("run", "runs").add(table(s));
    parser.command("view", "shows").command("all", "of it");
    parser.parse_or_exit("/usr/bin/program", std::move(arguments));
  };
  const auto two = testing::ExitedWithCode(2);
  EXPECT_EXIT(parse({"rnu", "--speed", "3"}), two, "^program: rnu: no such command of program; did you mean run.\n$");
  EXPECT_EXIT(parse({"a.ply"}), two, "^program: a.ply: no such command of program, which has run, view\n$");
  EXPECT_EXIT(parse({}), two, "^program: program needs a command: run, view\n$");
  EXPECT_EXIT(parse({"view"}), two, "^program: program view needs a command: all\n$");
  EXPECT_EXIT(parse({"run", "a", "--sped", "3"}), two, "--sped: no such flag of program run; did you mean --speed");
  EXPECT_EXIT(parse({"--speed", "3", "run"}), two, "--speed: no such flag of program; flags follow the command");
  EXPECT_EXIT(parse({"run", "a", "b"}), two, "^program: b: program run takes no more arguments\n$");
}

TEST(ParserDeathTest, TellsItsVersion) {
  const auto parse = [](std::vector<std::string> arguments) {
    Settings s;
    Parser parser("about");
    parser.add(table(s));
    parser.version("1.2.3");
    parser.parse_or_exit("path/program", std::move(arguments));
  };
  EXPECT_EXIT((dup2(2, 1), parse({"--version"})), testing::ExitedWithCode(0), "^program 1.2.3\n$");
  EXPECT_EXIT(parse({"a", "--versoin"}), testing::ExitedWithCode(2), "did you mean --version");
}

TEST(ParserDeathTest, HelpEndsWithZeroAndShowsSeldomFlagsOnlyIfAllAreAskedFor) {
  const auto zero = testing::ExitedWithCode(0);
  EXPECT_EXIT((dup2(2, 1), parsed({"--help"})), zero, "metres a second.*1 more flags: program --help all");
  EXPECT_EXIT((dup2(2, 1), parsed({"a", "--help", "all"})), zero, "--seldom number");
}

TEST(Parser, CountsMayHaveAnExponent) {
  uint64_t points = 0;
  Parser parser("about");
  parser.add({{.flag = "--points", .value = &points, .help = ""}});
  EXPECT_TRUE(parser.parse("program", {"--points=20e6"}));
  EXPECT_EQ(points, 20'000'000u);
  for (const char* wrong : {"1.5", "1e-1", "-1e3", "1e99", "e3"})
    EXPECT_FALSE(parser.parse("program", {fmt::format("--points={}", wrong)})) << wrong;
}

TEST(Parser, SubCommandsHaveTheirOwnFlags) {
  Settings run, view;
  double depth = 0;
  Parser parser("about");
  Parser& run_command = parser.command("run", "runs");
  run_command.add(table(run));
  Parser& bench = parser.command("bench", "measures");
  Parser& cache = bench.command("cache", "of a cache");
  cache.add({{.flag = "--depth", .value = &depth, .help = "levels"}});
  parser.parse_or_exit("program", {"bench", "cache", "--depth", "4"});
  EXPECT_FALSE(run_command.chosen());
  EXPECT_TRUE(bench.chosen());
  EXPECT_TRUE(cache.chosen());
  EXPECT_EQ(depth, 4);
}

}  // namespace
}  // namespace telesplat::options
