#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "common/julia/flags.h"
#include "common/options/parser.h"
#include "tools/telesplat/run/run_options.h"
#include "tools/telesplat/scene/scene_file.h"

namespace telesplat::launcher {
namespace {

// Reads them like `telesplat run`.
Result<std::vector<std::string>> read_scene_file(const std::string& path) {
  RunOptions options;
  return launcher::read_scene_file(path, table(options));
}
Result<std::vector<std::string>> expand(const std::vector<std::string>& arguments) {
  RunOptions options;
  return expand_scene_file(arguments, table(options));
}

class SceneFile : public testing::Test {
 protected:
  std::string write(const std::string& text) {
    path_ =
        (std::filesystem::temp_directory_path() /
         (std::string("telesplat-scene-") + testing::UnitTest::GetInstance()->current_test_info()->name() + ".toml"))
            .string();
    std::ofstream(path_) << text;
    return path_;
  }
  ~SceneFile() override { std::filesystem::remove(path_); }
  std::string path_;
};

TEST_F(SceneFile, AFlagsValueIsNone) {
  const std::vector<std::string> arguments{"julia", "--wall", write("[head]\nposition = [0, 0, 1]\n")};
  const auto same = expand(arguments);
  ASSERT_TRUE(same.ok()) << same.error().text;
  EXPECT_EQ(*same, arguments);
}

TEST_F(SceneFile, KeysBecomeFlagsAndTheFileIsRelativeToTheScene) {
  const auto flags = read_scene_file(write(
      "[scene]\nfile = \"a.ply\"\nroom_size = 1.5\n[view]\nexr = true\nframes = 7\n[packing]\nmax_points = 5e6\n"));
  ASSERT_TRUE(flags.ok()) << flags.error().text;
  EXPECT_EQ(flags->back(), (std::filesystem::path(path_).parent_path() / "a.ply").string());
  for (const char* flag : {"--room-size=1.5", "--exr", "--frames=7", "--packing.max_points=5000000"})
    EXPECT_NE(std::find(flags->begin(), flags->end(), flag), flags->end()) << flag;
}

TEST_F(SceneFile, SwitchesCanBeTurnedOff) {
  const auto flags = read_scene_file(
      write("file = \"a.ply\"\n[view]\ndetail_budget = false\nspeed_detail = true\nfinish = false\nexr = false\n"));
  ASSERT_TRUE(flags.ok()) << flags.error().text;
  for (const char* flag : {"--detail-budget=off", "--speed-detail=on", "--finish=off"})
    EXPECT_NE(std::find(flags->begin(), flags->end(), flag), flags->end()) << flag;
  EXPECT_EQ(flags->size(), 4u);  // and the file; exr = false is no flag
}

TEST_F(SceneFile, TheCommandLineComesAfterTheFile) {
  const std::string scene = write("file = \"a.ply\"\n[view]\nframes = 7\n");
  const auto arguments = expand({scene, "--frames=9"});
  ASSERT_TRUE(arguments.ok());
  const auto first = std::find(arguments->begin(), arguments->end(), "--frames=7"),
             second = std::find(arguments->begin(), arguments->end(), "--frames=9");
  EXPECT_LT(first, second);
  EXPECT_NE(second, arguments->end());
}

// A scene file may be a stranger's.
TEST_F(SceneFile, KeysThatWouldWriteElsewhereOrLetOthersInAreRefused) {
  for (const char* key : {"out = \"/tmp/elsewhere\"", "overwrite = true", "master = \"tcp://elsewhere:7700\"",
                          "movie = \"a.mp4\"", "keys = \"auto\"", "cache = \"/tmp/elsewhere\"", "report = true",
                          "record_every = 1", "record_points = 9", "record_depth = true", "log_level = \"trace\"",
                          "link = \"10mbit\"", "metrics_port = 9000", "max_connections = 4096", "table_limit_mb = 0",
                          "trace_limit_mb = 0", "poses = \"tcp://elsewhere:7800\"", "overwrite = false"}) {
    const std::string name = std::string(key).substr(0, std::string(key).find(' '));
    for (const char* table : {"", "[view]\n"}) {
      const auto flags = read_scene_file(write(std::string("file = \"a.ply\"\n") + table + key + "\n"));
      ASSERT_FALSE(flags.ok()) << key;
      for (const std::string& said : {path_, "key " + name + ": ", std::string(" on the command line")})
        EXPECT_NE(flags.error().text.find(said), std::string::npos) << flags.error().text;
    }
  }
  for (const char* none : {"bind = \"tcp://*:7700\"", "insecure = true", "companions = \"anywhere\""})
    EXPECT_FALSE(read_scene_file(write(std::string("file = \"a.ply\"\n") + none + "\n")).ok()) << none;
}

TEST_F(SceneFile, AFileIsNoFlag) {
  const std::string scene = write("file = \"--out=elsewhere\"\ntexture = \"-t.png\"\n");
  const auto before = std::filesystem::current_path();
  std::filesystem::current_path(std::filesystem::path(scene).parent_path());
  const auto flags = read_scene_file(std::filesystem::path(scene).filename().string());
  std::filesystem::current_path(before);
  ASSERT_TRUE(flags.ok()) << flags.error().text;
  EXPECT_EQ(flags->back(), "./--out=elsewhere");
  EXPECT_EQ(flags->front(), "--texture=./-t.png");
}

TEST_F(SceneFile, ErrorsNameFileAndPlace) {
  for (const char* text : {"file = ", "up = \"z\"", "[scene]\nfile = \"a.ply\"\n[scene.deeper]\nx = 1\n",
                           "file = \"a.ply\"\nsize = [1, 2]\n"}) {
    const auto flags = read_scene_file(write(text));
    ASSERT_FALSE(flags.ok()) << text;
    EXPECT_NE(flags.error().text.find(path_), std::string::npos) << flags.error().text;
  }
  EXPECT_FALSE(read_scene_file("/nonexistent.toml").ok());
}

// The launcher's scene for a file's flags.
Result<julia::Scene> scene_of(const std::vector<std::string>& flags) {
  RunOptions run;
  options::Parser parser("run");
  parser.add(table(run));
  parser.parse_or_exit("run", flags);
  return julia::read_scene(run.data.julia);
}

TEST_F(SceneFile, AKeyThatIsNoFlagIsNamedWithItsLine) {
  const std::vector<std::pair<std::string, const char*>> cases{
      {"file = \"a.ply\"\n[view]\nduratoin = 3\n",
       ":3: key duratoin is none: there is no flag --duratoin; did you mean duration?"},
      {"file = \"a.ply\"\nsise = \"100x100\"\n", ":2: key sise is none: there is no flag --sise; did you mean size?"},
      {"flie = \"a.ply\"\n", ":1: key flie is none: there is no flag --flie; did you mean file?"},
      {"file = \"a.ply\"\n[packing]\nmax_pionts = 3\n",
       ":3: key max_pionts is none: there is no flag --packing.max_pionts; did you mean max_points?"},
      {"file = \"a.ply\"\nseed = 3\n", ":2: key seed"},
  };
  for (const auto& [text, part] : cases) {
    const auto flags = read_scene_file(write(text));
    ASSERT_FALSE(flags.ok()) << text;
    EXPECT_TRUE(flags.error().text.starts_with(path_)) << flags.error().text;
    EXPECT_NE(flags.error().text.find(part), std::string::npos) << flags.error().text;
  }
}

TEST_F(SceneFile, AValueOutsideItsLimitsIsNamedWithItsLine) {
  const std::vector<std::pair<std::string, const char*>> cases{
      {"file = \"a.ply\"\n[view]\nduration = nan\n", ":3: --duration nan: is not between 0 and 1000000"},
      {"file = \"a.ply\"\n[view]\nhold = inf\n", ":3: --hold inf: is not between 0 and 1000000"},
      {"file = \"a.ply\"\n[view]\nfov = nan\n", ":3: --fov nan: is not between 1 and 170"},
      {"file = \"a.ply\"\n[view]\nnear = -nan\n", ":3: --near"},
      {"file = \"a.ply\"\n[view]\ntarget_fps = nan\n", ":3: --target-fps nan"},
      {"file = \"a.ply\"\n[view]\nframes = -1\n", ":3: --frames -1: is not a whole number of 0 or more"},
      {"file = \"a.ply\"\nsamplers = \"two\"\n", ":2: --samplers two: is not a whole number"},
      {"file = \"a.ply\"\n[view]\nsplat = \"dsc\"\n", ":3: --splat dsc: is not one of"},
      {"file = \"a.ply\"\n[packing]\nmax_points = nan\n", ":3: --packing.max_points nan"},
  };
  for (const auto& [text, part] : cases) {
    const auto flags = read_scene_file(write(text));
    ASSERT_FALSE(flags.ok()) << text;
    EXPECT_TRUE(flags.error().text.starts_with(path_)) << flags.error().text;
    EXPECT_NE(flags.error().text.find(part), std::string::npos) << flags.error().text;
  }
}

TEST_F(SceneFile, FilesThatItNamesLieBesideIt) {
  const auto flags = read_scene_file(write("file = \"a.ply\"\ntexture = \"t.png\"\n[view]\ntrajectory = \"orbit\"\n"));
  ASSERT_TRUE(flags.ok()) << flags.error().text;
  const auto folder = std::filesystem::path(path_).parent_path();
  for (const std::string& flag : {"--texture=" + (folder / "t.png").string(), std::string("--trajectory=orbit")})
    EXPECT_NE(std::find(flags->begin(), flags->end(), flag), flags->end()) << flag;
  const char* points = "0:#603010:0,60%:#ffe0b0:0.6";
  const auto tf = read_scene_file(write(std::string("file = \"a.nrrd\"\ntf = \"") + points + "\"\n"));
  ASSERT_TRUE(tf.ok()) << tf.error().text;
  EXPECT_EQ(tf->front(), std::string("--tf=") + points);
}

TEST_F(SceneFile, AJuliaSetHasParametersAndKeyFrames) {
  const auto flags = read_scene_file(write(
      "[scene]\nkind = \"julia\"\npreset = \"wings\"\nc = [0.1, 0.2, 0, -0.5]\nanimate = [\"ambient=0:1:3s\"]\n"
      "[julia]\niterations = 99\nslice.turn-x = 30\ncolour.by = \"trap\"\n\"colour.scale\" = 2.5\npalette = \"ice\"\n"
      "[view]\nframes = 7\n"
      "[[keyframe]]\nt = 0\nc.y = 0.2\nlod = 0.5\n[[keyframe]]\nt = 1.5\nc.y = 0.3\n"
      "[[keyframe]]\nt = 3\nc.y = 0.2\nlod = 1\n"));
  ASSERT_TRUE(flags.ok()) << flags.error().text;
  EXPECT_EQ(flags->back(), "julia");
  EXPECT_NE(std::find(flags->begin(), flags->end(), "--frames=7"), flags->end());
  const auto scene = scene_of(*flags);
  ASSERT_TRUE(scene.ok()) << scene.error().text;
  julia::Parameters wanted = *julia::preset_named("wings");
  wanted.c = {0.1, 0.2, 0, -0.5};
  wanted.iterations = 99;
  wanted.slice_turn_deg.x = 30;
  wanted.colour = julia::Colour::kTrap;
  wanted.colour_scale = 2.5;
  wanted.palette = 7;
  wanted.ambient = 0;  // the animation's value at 0 s
  wanted.lod = 0.5;
  EXPECT_EQ(scene->parameters, wanted);
  EXPECT_EQ(scene->timeline.tracks.size(), 3u);
  EXPECT_NEAR(scene->timeline.values(1.5).at("c.y"), 0.3, 1e-12);
  EXPECT_NEAR(scene->timeline.values(1.5).at("lod"), 0.75, 1e-12);
}

TEST_F(SceneFile, TheCommandLineWinsOverAJuliaSetsFile) {
  const std::string scene =
      write("[scene]\nkind = \"julia\"\nc = [0.1, 0.2, 0, -0.5]\n[julia]\nc.x = 0.4\niterations = 99\n");
  const auto with = [&](const std::string& flag) { return scene_of(*expand({scene, flag}))->parameters; };
  EXPECT_EQ(with("--iterations=12").iterations, 12);
  EXPECT_EQ(with("--iterations=12").c, glm::dvec4(0.4, 0.2, 0, -0.5));
  EXPECT_EQ(with("--c=0,0,0,-1").c, glm::dvec4(0, 0, 0, -1));
  EXPECT_EQ(with("--c=0,0,0,-1").iterations, 99);
  EXPECT_EQ(with("--preset=wings"), *julia::preset_named("wings"));
}

TEST_F(SceneFile, ErrorsOfJuliaSetsNameTheLine) {
  const std::vector<std::pair<std::string, const char*>> cases{
      {"[scene]\nkind = \"cloud\"\n", "kind is \"cloud\""},
      {"[scene]\nkind = \"julia\"\nfile = \"a.ply\"\n", "no data file"},
      {"[scene]\nfile = \"a.ply\"\n[julia]\nlod = 1\n", "[julia] needs kind"},
      {"[scene]\nfile = \"a.ply\"\npreset = \"wings\"\n", "preset needs kind"},
      {"[scene]\nkind = \"julia\"\nc = [1, 2, 3]\n", ":3: c is not"},
      {"[scene]\nkind = \"julia\"\n[julia]\nc.q = 1\n", ":4: c.q: no parameter"},
      {"[scene]\nkind = \"julia\"\n[julia]\nc.x = nan\n", ":4: c.x is nan"},
      {"[scene]\nkind = \"julia\"\n[julia]\niterations = 0\n", ":4: iterations is 0, limits"},
      {"[scene]\nkind = \"julia\"\n[julia]\npalette = \"mud\"\n", ":4: palette is \"mud\""},
      {"[scene]\nkind = \"julia\"\n[julia]\nlod = [1]\n", ":4: lod is neither"},
      {"[scene]\nkind = \"julia\"\nanimate = 3\n", ":3: animate is neither"},
      {"[scene]\nkind = \"julia\"\nanimate = \"c.y\"\n", ":3: animation \"c.y\""},
      {"kind = \"julia\"\n[[keyframe]]\nt = 0\nc.y = 7\n", ":4: c.y is 7"},
      {"kind = \"julia\"\n[[keyframe]]\nc.y = 1\n", ":2: a key frame's t"},
      {"kind = \"julia\"\n[[keyframe]]\nt = 0\n", "without parameters"},
      {"kind = \"julia\"\n[julia]\nt = 1\n", ":3: t belongs"},
      {"kind = \"julia\"\nkeyframe = 3\n", ":2: keyframe is not"},
      {"kind = \"julia\"\n[[keyframe]]\nt = 0\nc.y = 1\n", "one key frame"},
      {"kind = \"julia\"\n[[keyframe]]\nt = 2\nc.y = 1\n[[keyframe]]\nt = 1\nc.y = 1\n", "must be at 0 s"},
  };
  for (const auto& [text, part] : cases) {
    const auto flags = read_scene_file(write(text));
    ASSERT_FALSE(flags.ok()) << text;
    EXPECT_TRUE(flags.error().text.starts_with(path_)) << flags.error().text;
    EXPECT_NE(flags.error().text.find(part), std::string::npos) << flags.error().text;
  }
}

TEST_F(SceneFile, TheScenesThatComeWithTelesplatCanBeRead) {
  int read = 0;
  for (const auto& entry : std::filesystem::directory_iterator("examples/scenes")) {
    if (entry.path().extension() != ".toml") continue;
    const auto flags = read_scene_file(entry.path().string());
    ASSERT_TRUE(flags.ok()) << flags.error().text;
    if (flags->back() != "julia") continue;
    ++read;
    const auto scene = scene_of(*flags);
    ASSERT_TRUE(scene.ok()) << scene.error().text;
    EXPECT_TRUE(julia::place(*scene, 0.8).ok()) << entry.path();
  }
  EXPECT_GT(read, 0);
}

}  // namespace
}  // namespace telesplat::launcher
