#include "common/options/parser.h"

#include <gtest/gtest.h>

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
      {.flag = "--list", .value = Action{[] { std::puts("one two"); }}, .help = "tell and end"},
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
  EXPECT_EXIT(parsed({"a", "--speed", "nan"}), testing::ExitedWithCode(2), "--speed nan: is not in 0..10");
  EXPECT_EXIT(parsed({"a", "--speed", "fast"}), testing::ExitedWithCode(2), "--speed fast: is not a number");
  EXPECT_EXIT(parsed({"a", "--nothing"}), testing::ExitedWithCode(2), "--nothing");
  EXPECT_EXIT(parsed({}), testing::ExitedWithCode(2), "scene");
}

TEST(ParserDeathTest, ListsAndHelpEndWithZero) {
  EXPECT_EXIT(parsed({"--list"}), testing::ExitedWithCode(0), "");
  EXPECT_EXIT(parsed({"--help"}), testing::ExitedWithCode(0), "");
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
