// Facts of data servers and viewers in session.toml.
#include "services/master/master_record.h"

#include <gtest/gtest.h>
#include <toml++/toml.h>

#include "services/master/record/run_record.h"

namespace telesplat::master {
namespace {

std::string session_of(const std::vector<metrics::Process>& processes) {
  const auto record = std::move(metrics::RunRecord::open("")).value();
  MasterServiceOptions options;
  const MasterCore core(options.master, {42}, *record);
  return session_text(options, core, {}, processes);
}

metrics::Process teller(const std::string& role, const std::string& said) {
  return {role, role, 1, {{metrics::kRecordFact, said}}, {}};
}

TEST(ToldTables, AreWrittenAsTheyWereUnderstood) {
  const std::string scene =
      "\n[scene]\nkind = \"mesh\"\nfile = \"/a \\\"b\\\".ply\"\nroom_size = 0.8\nz_scale = -2\nno_cache = true\n";
  const auto told = checked("data", scene);
  ASSERT_TRUE(told.ok()) << told.error().text;
  EXPECT_EQ(told->left_out, 0u);
  const toml::table before = toml::parse(scene), after = toml::parse(told->text);
  EXPECT_EQ(before, after) << told->text;
  const auto julia = checked("data", "[julia]\n\"c.x\" = 0.5\niterations = 64\n[placement]\nlo = [-1, 0.5, 2]\n");
  ASSERT_TRUE(julia.ok()) << julia.error().text;
  EXPECT_EQ(julia->left_out, 0u);
  EXPECT_EQ(toml::parse(julia->text)["julia"]["c.x"].value<double>(), 0.5);
  EXPECT_EQ(toml::parse(julia->text)["placement"]["lo"].as_array()->size(), 3u);
}

TEST(ToldTables, NobodyTellsWhatIsNotTheirs) {
  const auto out = [](const std::string& role, const std::string& said) {
    const auto told = checked(role, said);
    return told ? std::pair(told->text, told->left_out) : std::pair("refused: " + told.error().text, size_t{0});
  };
  using Pair = std::pair<std::string, size_t>;
  EXPECT_EQ(out("viewer", "[scene]\nfile = \"/etc/passwd\"\n"), Pair("", 1));
  EXPECT_EQ(out("sampler", "[scene]\nfile = \"/etc/passwd\"\n"), Pair("", 1));
  EXPECT_EQ(out("data", "[[process]]\nrole = \"viewer\"\n[session]\ntile_size = 1\n"), Pair("", 2));
  EXPECT_EQ(out("data", "[scene]\nkind = \"mesh\"\nout = \"/elsewhere\"\nfile = [\"a\"]\nup = {a = 1}\n"),
            Pair("\n[scene]\nkind = \"mesh\"\n", 3));
  EXPECT_EQ(out("data", "[scene]\ntitle = \"\\u001b[2J\\nroot\"\n"), Pair("\n[scene]\ntitle = \" [2J root\"\n", 0));
  EXPECT_TRUE(out("data", "no table").first.starts_with("refused: line 1: "));
  EXPECT_TRUE(out("data", "[scene]\nfile = \"a\"\nfile = \"b\"\n").first.starts_with("refused: line 3: "));
}

// Other programs read the file: it stays readable, and has each process' own facts.
TEST(SessionText, StaysReadableWhateverPeersTell) {
  metrics::Process data =
      teller("data", "[scene]\nfile = \"a.ply\"\n[[process]]\nrole = \"viewer\"\nname = \"false\"\n");
  data.facts.insert({{"role", "master"}, {"name", "b"}, {"a\x01", "1"}, {"a\x02", "2"}, {"k\"ey]", "v\\"}});
  const auto viewer = teller("viewer", "[display]\nfov = 90\n[session]\ntile_size = 1\n");
  const std::string text = session_of({data, viewer});
  toml::table session;
  ASSERT_NO_THROW(session = toml::parse(text)) << text;
  ASSERT_EQ(session["process"].as_array()->size(), 2u) << text;
  EXPECT_EQ(session["process"][0]["role"].value<std::string>(), "data");
  EXPECT_EQ(session["scene"]["file"].value<std::string>(), "a.ply");
  EXPECT_EQ(session["display"]["fov"].value<double>(), 90);
  EXPECT_NE(session["session"]["tile_size"].value<int>(), 1);
}

}  // namespace
}  // namespace telesplat::master
