// Commands refuse bad usage before they start another program: exit code 2, a line that names it, nothing left behind.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "client/viewer/record/record_file.h"
#include "common/net/service_main.h"
#include "services/data/data_service.h"
#include "services/master/master_service.h"
#include "services/packer/packer_service.h"
#include "services/sampler/sampler_service.h"
#include "tests/integration/commands/here.h"
#include "tools/telesplat/movie/movie_target.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

void expect_one_line(const Said& said, const std::string& named) {
  EXPECT_EQ(said.code, 2) << named;
  EXPECT_EQ(std::count(said.err.begin(), said.err.end(), '\n'), 1) << said.err;
  EXPECT_NE(said.err.find(named), std::string::npos) << named << ": " << said.err;
}

struct Refusal {
  std::vector<std::string> arguments;
  std::string named;
};

TEST(Refused, BeforeARunBegins) {
  const TemporaryFolder folder;
  write_terrain(folder / "terrain.ply", 4);
  std::ofstream(folder / "wall.toml") << "[head]\nposition = [0, 0, 1]\n[[planar]]\nsize = [0.4, 0.3]\n";
  std::ofstream(folder / "lab.toml") << "[head]\nposition = [0, 0, 1]\n[[planar]]\nsize = [0.4, 0.3]\n"
                                        "resolution = [160, 100]\n";
  const std::string mesh = folder / "terrain.ply", pipe = folder / "pipe.toml", zeros = folder / "zeros.toml",
                    large = folder / "large.toml";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  fs::create_symlink("/dev/zero", zeros);
  std::ofstream(large) << '\n';
  fs::resize_file(large, (1 << 20) + 1);
  const Refusal cases[] = {
      {{folder / "missing.ply"}, "missing.ply: "},
      {{mesh, "--durationn", "3"}, "--durationn: no such flag of telesplat run; did you mean --duration?"},
      {{pipe}, pipe + ": is not a regular file"},
      {{zeros}, zeros + ": is not a regular file"},
      {{large}, large + ": has 1048577 bytes, limit 1048576"},
      {{mesh, "--palette", "ice"}, "terrain.ply"},
      {{mesh, "--poses", "nowhere"}, "--poses"},
      {{mesh, "--poses", "tcp://127.0.0.1:1", "--trajectory", "orbit"}, "--poses"},
      {{mesh, "--prediction", "gaze"}, "--prediction"},
      {{"julia", "--stereo", "quad-buffer"}, "--stereo quad-buffer: needs a window"},
      {{mesh, "--wall", folder / "wall.toml"}, "wall.toml:3: [[planar]] 1 resolution: is missing"},
      {{mesh, "--wall", folder / "lab.toml", "--size", "100x100"}, "--size: the screens of"},
      // Without ffmpeg pictures go into the folder a-frames.
      {{mesh, "--movie", "/proc/nowhere/a.mp4"},
       !launcher::find_program("ffmpeg").empty() ? "/proc/nowhere/a.mp4: cannot be written"
                                                 : "/proc/nowhere/a-frames/: cannot be written"},
      {{mesh, "--movie", "a.xyz"}, "a.xyz: ends in none of"},
      {{mesh, "--movie", "a.mp4", "--movie-size", "13x13"}, "--movie-size 13x13"},
      {{mesh, "--movie", "a.mp4", "--movie-fps", "nan"}, "--movie-fps"},
      {{mesh, "--movie", "a.mp4", "--movie-fps", "0"}, "--movie-fps"},
      {{mesh, "--movie", "a.mp4", "--record-points", "0"}, "--record-points 0"},
      {{mesh, "--movie-fps", "10"}, "no --movie"},
  };
  for (const auto& [arguments, named] : cases) {
    std::vector<std::string> words{"run", "--out", folder / "out", "--no-cache", "--duration", "1"};
    words.insert(words.begin() + 1, arguments.begin(), arguments.end());
    if (arguments[0] == "julia" || arguments[0].ends_with(".toml")) std::erase(words, "--no-cache");
    expect_one_line(telesplat(words), named);
    EXPECT_FALSE(fs::exists(folder / "out")) << named;
  }
}

// main() of a service with these arguments.
template <class Options, class Table>
Said service(const std::string& name, Options options, Table table, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), name);
  std::vector<char*> argv;
  for (auto& a : arguments) argv.push_back(a.data());
  return said_by([&] {
    return net::service_main(int(argv.size()), argv.data(), "about", options, table,
                             [](const Options&) -> Result<int> { return 0; });
  });
}

TEST(Refused, NumbersOfServicesBeyondTheirLimits) {
  const auto master = [](std::vector<std::string> words) {
    return service("telesplat-master", master::MasterServiceOptions{}, master::table, std::move(words));
  };
  const auto sampler = [](std::vector<std::string> words) {
    return service("telesplat-sampler", sampler::SamplerOptions{}, sampler::table, std::move(words));
  };
  const auto data = [](std::vector<std::string> words) {
    return service("telesplat-data", data::DataServiceOptions{}, data::table, std::move(words));
  };
  const auto packer = [](std::vector<std::string> words) {
    return service("telesplat-packer", packer::PackerOptions{}, packer::table, std::move(words));
  };
  expect_one_line(master({"--tile-size", "7"}), "telesplat-master: --tile-size 7: is not between 16 and 2048\n");
  expect_one_line(master({"--metrics-port", "65536"}), "--metrics-port 65536: is not between 0 and 65535\n");
  expect_one_line(sampler({"--threads", "1025"}), "telesplat-sampler: --threads 1025: is not between 0 and 1024\n");
  expect_one_line(sampler({"--give-up-after", "-1"}), "--give-up-after -1: is not between 0 and 1000000000\n");
  expect_one_line(data({"julia", "--room-size", "0"}),
                  "telesplat-data: --room-size 0: is not between 0.001 and 1000\n");
  expect_one_line(data({"julia", "--room-size", "wide"}), "telesplat-data: --room-size wide: is not a number\n");
  expect_one_line(packer({"--max-connections", "0"}), "--max-connections 0: is not between 1 and 1048576\n");
}

TEST(Refused, OfSweepsBeforeOneOfTheirRunsBegins) {
  const TemporaryFolder folder;
  write_terrain(folder / "terrain.ply", 20);
  const auto sweep = [&](std::vector<std::string> own) {
    own.insert(own.begin(), {"sweep", "--out", folder / "sweep", folder / "terrain.ply"});
    own.insert(own.end(), {"--", "--size", "160x100", "--frames", "8"});
    return telesplat(own);
  };
  for (const auto& [own, named] :
       {Refusal{{"--vary", "samplers=1,two"}, "--samplers two: is not a whole number"},
        {{"--vary", "smplers=1"}, "--vary smplers: no such flag of telesplat run; did you mean samplers?"},
        {{"--vary", "coupling=sync,lose"}, "--coupling lose: "},
        {{"--vary", "iso=3"}, "iso=3: --iso"},
        {{"--repeat", "0"}, "--repeat 0: is not between 1 and 1000"}}) {
    expect_one_line(sweep(own), named);
    EXPECT_FALSE(fs::exists(folder / "sweep")) << named;
  }
  const Said listed = sweep({"--vary", "samplers=1,2", "--dry-run"});
  EXPECT_EQ(listed.code, 0) << listed.err;
  EXPECT_NE(listed.out.find("6 runs (2 configurations, 3 times each), 6 to do"), std::string::npos) << listed.out;
  EXPECT_FALSE(fs::exists(folder / "sweep"));
  fs::create_directories(folder / "sweep");
  std::ofstream(folder / "sweep/mine") << "mine";
  expect_one_line(sweep({"--vary", "samplers=1,2"}), "is not empty, and holds no sweep");
}

TEST(Refused, OfComparisonsWhatIsNoRunEndsTooEarlyOrIsDamaged) {
  const TemporaryFolder folder;
  const std::string run = folder / "run";
  fs::create_directory(run);
  write_terrain(folder / "terrain.ply", 4);
  std::ofstream(run + "/session.toml") << "[[process]]\nrole = \"viewer\"\nname = \"viewer-1\"\nwidth = \"160\"\n"
                                       << "height = \"100\"\n[scene]\nfile = \"" << (folder / "terrain.ply")
                                       << "\"\ncache = \"" << (folder / "cache") << "\"\n";
  std::ofstream(run + "/frames.csv") << "viewer,frame,t_s,points_drawn,sequence,px,py,pz,qw,qx,qy,qz\n"
                                        "viewer-1,0,0.5,5000,3,0,0,1,1,0,0,0\n";
  viewer::RecordWriter::open(folder / "damaged", "TSEVENT4", 1000, "events")->write("replica", "short");
  const std::string damaged = read_text(folder / "damaged");
  for (const auto& [path, events, named] : {std::tuple{folder / "MISSING", std::string(), "MISSING: no such file"},
                                            {run, "TSEVENT2", "displayed event 3"},
                                            {run, "TSEVENTX", "is not a record of point-model events"},
                                            {run, damaged, "5 bytes instead of 32"}}) {
    std::ofstream(run + "/points.events") << events;
    const Said said = telesplat({"compare", path, "--renderers", "cpu", "--out", folder / "out"});
    EXPECT_EQ(said.code, 2) << named;
    EXPECT_NE(said.err.find(named), std::string::npos) << said.err;
    EXPECT_EQ(said.err.rfind("telesplat: "), said.err.rfind('\n', said.err.size() - 2) + 1) << said.err;
    EXPECT_FALSE(fs::exists(folder / "out")) << "a folder was left";
  }
}

TEST(Keys, AreMadeListedHandedOutAndRevoked) {
  const TemporaryFolder folder;
  const std::string keys = folder / "keys";
  const auto run = [&](std::vector<std::string> arguments, int code) {
    arguments.insert(arguments.begin(), "keys");
    const Said said = telesplat(arguments);
    EXPECT_EQ(said.code, code) << said.out << said.err;
    if (code != 0) {
      EXPECT_EQ(std::count(said.err.begin(), said.err.end(), '\n'), 1) << said.err;
    }
    return said.out + said.err;
  };
  EXPECT_NE(run({keys, "--list"}, 2).find("holds no keys"), std::string::npos);
  const std::string made = run({keys}, 0);
  EXPECT_NE(made.find("made keys of server, data, packer, sampler, viewer, operator"), std::string::npos) << made;
  EXPECT_NE(made.find("server.pub sampler.key"), std::string::npos) << made;
  EXPECT_EQ(run({keys}, 0).find("made keys"), std::string::npos) << "a second time nothing is made";
  run({keys, "--person", "anna"}, 0);
  run({keys, "--person", "anna", "--role", "operator"}, 2);
  run({keys, "--person", "ben", "--role", "king"}, 2);
  EXPECT_NE(run({keys, "--list"}, 0).find("anna"), std::string::npos);
  run({keys, "--bundle", "anna", folder / "laptop"}, 0);
  EXPECT_TRUE(fs::exists(folder / "laptop/anna.key"));
  EXPECT_TRUE(fs::exists(folder / "laptop/server.pub"));
  EXPECT_FALSE(fs::exists(folder / "laptop/server.key"));
  run({keys, "--bundle", "anna", folder / "laptop"}, 2);
  run({keys, "--bundle", "nobody", folder / "other"}, 2);
  run({keys, "--bundle", "anna"}, 2);
  run({keys, "--revoke", "anna"}, 0);
  EXPECT_EQ(run({keys, "--list"}, 0).find("anna"), std::string::npos);
  run({keys, "--revoke", "anna"}, 2);
  run({keys, "--revoke", "server"}, 2);
  run({keys, "--person", "ben", "--revoke", "sampler"}, 2);
}

TEST(Help, NamesACommandOrOneOfItsOwn) {
  const auto said = [](const std::vector<std::string>& arguments) {
    const Said told = telesplat(arguments);
    EXPECT_EQ(told.code, 0) << told.err;
    return told.out;
  };
  EXPECT_EQ(said({"help"}), said({"--help"}));
  EXPECT_EQ(said({"help", "run"}), said({"run", "--help"}));
  EXPECT_EQ(said({"help", "run", "all"}), said({"run", "--help", "all"}));
  EXPECT_EQ(said({"help", "ctl", "clip"}), said({"ctl", "clip", "--help"}));
  EXPECT_NE(said({"--help"}).find("telesplat help COMMAND"), std::string::npos) << "it is told";
  const std::string all = said({"run", "julia", "--help", "all"});
  for (const char* part : {"--c.w", "--slice.turn-y", "1..4096", "trap-plane", "spectrum", "--animate"})
    EXPECT_NE(all.find(part), std::string::npos) << part;
  EXPECT_NE(said({"presets"}).find("lantern"), std::string::npos);
  EXPECT_EQ(telesplat({"help", "rnu"}).err, "telesplat: rnu: no such command of telesplat; did you mean run?\n");
  expect_one_line(telesplat({"ctl", "status", "--master", "foo"}),
                  "telesplat: --master foo: is no address such as tcp://127.0.0.1:7700");
}

}  // namespace
}  // namespace telesplat::test
