// `telesplat view`: a real window on a display without a screen, real input, real processes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>

#include "common/geometry/trajectory.h"
#include "common/net/control.h"
#include "tests/support/patience.h"
#include "tests/support/pipeline_run.h"
#include "tests/support/virtual_display.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;
constexpr uint32_t kBackground = 0x141820;

// Sets a variable of the environment for its scope; null: removes it.
class Environment {
 public:
  Environment(const char* name, const char* value) : name_(name) {
    if (const char* before = std::getenv(name)) before_ = before;
    value ? setenv(name, value, 1) : unsetenv(name);
  }
  ~Environment() { before_ ? setenv(name_, before_->c_str(), 1) : unsetenv(name_); }

 private:
  const char* name_;
  std::optional<std::string> before_;
};

std::vector<std::string> screenshots(const std::string& folder) {
  std::vector<std::string> out;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (const std::string name = entry.path().filename(); name.starts_with("telesplat-") && name.ends_with(".png"))
      out.push_back(entry.path());
  std::sort(out.begin(), out.end());
  return out;
}

double covered(const image::View& v) {
  const auto shown =
      std::count_if(v.colour.begin(), v.colour.end(), [](uint32_t c) { return (c & 0xffffff) != kBackground; });
  return double(shown) / double(v.colour.size());
}

// Mean difference of two pictures' channels, 0..255; 255 if they differ in size.
double difference(const image::View& a, const image::View& b) {
  if (a.width != b.width || a.height != b.height) return 255;
  double sum = 0;
  for (size_t i = 0; i < a.colour.size(); ++i)
    for (const int shift : {0, 8, 16})
      sum += std::abs(int(a.colour[i] >> shift & 255) - int(b.colour[i] >> shift & 255));
  return sum / (3.0 * double(a.colour.size()));
}

// The process and all it started, directly or not.
std::vector<pid_t> family(pid_t root) {
  std::vector<pid_t> out{root};
  for (size_t i = 0; i < out.size(); ++i) {
    std::error_code error;
    for (const auto& entry : fs::directory_iterator("/proc", error)) {
      const pid_t pid = std::atoi(entry.path().filename().c_str());
      if (pid <= 0) continue;
      const std::string stat = read_text(entry.path() / "stat");
      const size_t name_end = stat.rfind(')');
      if (name_end != std::string::npos && std::atoi(stat.c_str() + std::min(stat.size(), name_end + 4)) == out[i])
        out.push_back(pid);
    }
  }
  return out;
}

bool none_runs(const std::vector<pid_t>& pids) {
  return wait_until([&] { return std::none_of(pids.begin(), pids.end(), is_running); });
}

class WindowTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!VirtualDisplay::installed()) GTEST_SKIP() << "there is no Xvfb here: tools/setup installs it (package xvfb)";
    settings_.emplace("XDG_CONFIG_HOME", (folder_ / "config").c_str());
    display_.emplace();
    ASSERT_TRUE(display_->ready()) << "Xvfb did not start";
  }

  // The window once its title has live figures.
  VirtualDisplay::WindowId live_window(const Program& program) {
    std::optional<VirtualDisplay::WindowId> window;
    EXPECT_TRUE(wait_until([&] { return (window = display_->find(" fps, ")).has_value(); }, 60)) << program.err();
    return window.value_or(0);
  }

  TemporaryFolder folder_;
  std::optional<Environment> settings_;
  std::optional<VirtualDisplay> display_;
};

TEST_F(WindowTest, ShowsTheObjectObeysTheHandAndEndsWhenClosed) {
  PipelineRun run({"--trajectory", "still"}, "", "view");
  const auto window = live_window(run.program());
  ASSERT_NE(window, 0u);
  const std::string title = display_->title(window);
  EXPECT_TRUE(title.starts_with("terrain.ply - ")) << title;
  for (const char* figure : {"updates/s", "ms latency", "M points drawn", "M cached", "MB/s"})
    EXPECT_NE(title.find(figure), std::string::npos) << title;
  EXPECT_TRUE(wait_until([&] { return display_->title(window) != title; })) << "the figures stand still: " << title;
  run.master();
  const auto pids = family(run.program().pid());
  EXPECT_GE(pids.size(), 6u);  // launcher, master, data, packer, sampler, viewer

  // A drag to the right takes the camera around the object, at the same distance.
  display_->move_pointer(window, 240, 150);
  display_->button(1, true);
  display_->move_pointer(window, 240 + 60, 150);
  display_->button(1, false);
  std::vector<double> x, y, z;
  const auto poses = [&] {
    z = run.column("frames.csv", "pz"), y = run.column("frames.csv", "py"), x = run.column("frames.csv", "px");
    return std::min({x.size(), y.size(), z.size()});
  };
  const double turn = 60.0 / 300 * 3.14159265358979;
  EXPECT_TRUE(wait_until([&] {
    const size_t rows = poses();
    return rows > 0 && std::abs(std::atan2(x[rows - 1], z[rows - 1]) + turn) < 0.01;
  })) << (x.empty() ? 0 : x.back());
  ASSERT_FALSE(x.empty());
  EXPECT_NEAR(x[0], 0, 1e-6);
  EXPECT_NEAR(std::hypot(x.back(), y.back(), z.back()), std::hypot(x[0], y[0], z[0]), 1e-3);
  EXPECT_NEAR(y.back(), y[0], 1e-3);

  // The screenshot is what the window shows.
  display_->tap("p");
  ASSERT_TRUE(wait_until([&] { return screenshots(run.out() + "/images").size() == 1; })) << run.program().err();
  const auto picture = image::read_view(screenshots(run.out() + "/images")[0]);
  ASSERT_TRUE(picture) << picture.error().text;
  EXPECT_EQ(picture->width, 480);
  EXPECT_EQ(picture->height, 300);
  EXPECT_GT(covered(*picture), 0.1);
  EXPECT_LT(covered(*picture), 0.95);
  double apart = 255;
  EXPECT_TRUE(wait_until([&] {
    const auto shown = display_->content(window);
    return shown && (apart = difference(*picture, *shown)) < (kSlow ? 5 : 2);  // slow programs still refine it
  })) << "screenshot and window differ by "
      << apart;
  EXPECT_TRUE(wait_until([&] { return run.program().err().find("screenshot: ") != std::string::npos; }))
      << run.program().err();

  // Splats change, and the picture's size follows the window's.
  display_->tap("1");
  EXPECT_TRUE(wait_until([&] { return run.program().err().find("splats: square") != std::string::npos; }))
      << run.program().err();
  display_->resize(window, 200, 320);
  EXPECT_TRUE(wait_until([&] {
    const auto shown = display_->content(window);
    return shown && shown->width == 200 && shown->height == 320 && covered(*shown) > 0.05 && covered(*shown) < 0.95;
  }));
  display_->tap("F12");
  ASSERT_TRUE(wait_until([&] { return screenshots(run.out() + "/images").size() == 2; })) << run.program().err();
  const auto tall = image::read_view(screenshots(run.out() + "/images")[1]);
  ASSERT_TRUE(tall) << tall.error().text;
  EXPECT_EQ(tall->width, 200);
  EXPECT_EQ(tall->height, 320);

  display_->close(window);
  EXPECT_EQ(run.program().wait(60), 0) << run.program().err();
  EXPECT_TRUE(none_runs(pids));
  EXPECT_TRUE(run.all_gone());
  EXPECT_EQ(run.summary()["errors"]["messages_rejected"], 0);
  EXPECT_GT(run.summary()["frames"], 0);
}

TEST_F(WindowTest, TellsItsKeysOnTheTerminalAndInTheWindow) {
  PipelineRun run({}, "", "view");
  const auto window = live_window(run.program());
  ASSERT_NE(window, 0u);
  EXPECT_NE(run.program().err().find("F1 shows all keys: Tab shows the panel, left drag orbits"), std::string::npos)
      << run.program().err();
  // The keys lie in the upper left corner, where nothing else was; they are in no screenshot.
  const auto ink = [](const image::View& v) {
    int out = 0;
    for (int y = 0; y < v.height / 3; ++y)
      for (int x = 0; x < v.width / 3; ++x) out += (v.colour[size_t(y * v.width + x)] & 0xff) > 0xb0;
    return out;
  };
  const auto shows = [&](bool wanted) {
    return wait_until([&] {
      const auto shown = display_->content(window);
      return shown && (ink(*shown) > 200) == wanted;
    });
  };
  EXPECT_TRUE(shows(false));
  display_->tap("h");
  EXPECT_TRUE(shows(true));
  EXPECT_TRUE(wait_until([&] { return run.program().err().find("left drag   ") != std::string::npos; }));
  display_->tap("p");
  ASSERT_TRUE(wait_until([&] { return screenshots(run.out() + "/images").size() == 1; })) << run.program().err();
  const auto picture = image::read_view(screenshots(run.out() + "/images")[0]);
  ASSERT_TRUE(picture);
  EXPECT_LE(ink(*picture), 200);
  display_->tap("h");
  EXPECT_TRUE(shows(false));
  display_->tap("q", "Control_L");
  EXPECT_EQ(run.program().wait(60), 0) << run.program().err();
}

TEST_F(WindowTest, OfAVolumeHasItsLegendInScreenshotsTooAndNoKeysOfPoints) {
  TemporaryFolder folder;
  write_volume(folder / "balls.mha");
  PipelineRun run({"--tf", "grey"}, folder / "balls.mha", "view");
  const auto window = live_window(run.program());
  ASSERT_NE(window, 0u);
  // The bar's rim and the letters, in the lower right quarter.
  const auto ink = [](const image::View& v) {
    int out = 0;
    for (int y = v.height / 2; y < v.height; ++y)
      for (int x = v.width / 2; x < v.width; ++x) out += (v.colour[size_t(y * v.width + x)] & 0xffffff) == 0xf4f4f4;
    return out;
  };
  EXPECT_TRUE(wait_until([&] {
    const auto shown = display_->content(window);
    return shown && ink(*shown) > 200;
  }));
  display_->tap("p");
  ASSERT_TRUE(wait_until([&] { return screenshots(run.out() + "/images").size() == 1; })) << run.program().err();
  const auto picture = image::read_view(screenshots(run.out() + "/images")[0]);
  ASSERT_TRUE(picture);
  EXPECT_GT(ink(*picture), 200);
  for (const char* key : {"1", "5", "8"}) {
    display_->tap(key);
    const std::string line = "key " + std::string(key) + " has no meaning for volumes";
    EXPECT_TRUE(wait_until([&] { return run.program().err().find(line) != std::string::npos; })) << run.program().err();
  }
  EXPECT_EQ(run.program().err().find("splats:"), std::string::npos);
  display_->tap("q", "Control_L");
  EXPECT_EQ(run.program().wait(60), 0) << run.program().err();
}

TEST_F(WindowTest, APathIsRecordedPlayedAgainAndATrajectory) {
  PipelineRun run({}, "", "view");
  const auto window = live_window(run.program());
  ASSERT_NE(window, 0u);
  display_->tap("c");
  EXPECT_TRUE(wait_until([&] {
    return display_->title(window).find("recording the camera's path") != std::string::npos;
  })) << display_->title(window);
  display_->move_pointer(window, 200, 150);
  display_->button(1, true);
  display_->move_pointer(window, 290, 150);
  display_->button(1, false);
  // Half a second longer than the head needs to move.
  EXPECT_TRUE(wait_until([&] {
    const auto x = run.column("frames.csv", "px"), t = run.column("frames.csv", "t_s");
    const size_t rows = std::min(x.size(), t.size());
    size_t moved = 0;
    while (moved < rows && std::abs(x[moved] - x[0]) < 0.1) ++moved;
    return moved < rows && t[rows - 1] > t[moved] + 0.5;
  }));
  display_->tap("c");
  std::string path;
  EXPECT_TRUE(wait_until([&] {
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(run.out(), error))
      if (entry.path().filename().string().starts_with("path-")) path = entry.path();
    return !path.empty() && run.program().err().find(path) != std::string::npos;
  })) << run.program().err();
  const auto recorded = geometry::Trajectory::read_csv(path);
  ASSERT_TRUE(recorded) << recorded.error().text;
  EXPECT_GT(recorded->duration_s(), 0.5);
  const auto from = recorded->at(0).position_room, to = recorded->at(1e9).position_room;
  EXPECT_GT(glm::distance(from, to), 0.2);

  // Back home, then once more along the path: the head ends where it ended.
  display_->tap("r");
  std::vector<double> x, z;
  const auto stands_at = [&](const glm::dvec3& p) {
    z = run.column("frames.csv", "pz"), x = run.column("frames.csv", "px");
    const size_t rows = std::min(x.size(), z.size());
    return rows > 0 && std::hypot(x[rows - 1] - p.x, z[rows - 1] - p.z) < 1e-3;
  };
  EXPECT_TRUE(wait_until([&] { return stands_at(from); }));
  display_->tap("t");
  EXPECT_TRUE(wait_until([&] { return stands_at(to); }));
  display_->close(window);
  EXPECT_EQ(run.program().wait(60), 0) << run.program().err();

  // The path that the window wrote and the one that the run recorded move a head without a window while they last.
  for (const std::string& file : {path, run.out() + "/frames.csv"}) {
    const auto trajectory = geometry::Trajectory::read_csv(file);
    ASSERT_TRUE(trajectory) << trajectory.error().text;
    std::vector<std::string> arguments{"--trajectory", file};
    if (file != path) arguments.insert(arguments.end(), {"--duration", "0.5"});
    PipelineRun again(arguments);
    EXPECT_EQ(again.program().wait(60), 0) << again.program().err();
    const double lasted_s = again.column("frames.csv", "t_s").back();
    EXPECT_NEAR(lasted_s, file == path ? trajectory->duration_s() : 0.5, 0.2);
  }
}

TEST_F(WindowTest, AMovieShowsWhatKeysHadChanged) {
  PipelineRun run({"--trajectory", "orbit", "--record-every", "1", "--size", "200x150"}, "", "view");
  const auto window = live_window(run.program());
  ASSERT_NE(window, 0u);
  for (const auto& [key, column] : {std::pair{"3", "splat"}, {"5", "finish"}, {"8", "lit"}}) {
    display_->tap(key);  // ellipse, fill off, unlit
    EXPECT_TRUE(wait_until([&, column = column] {
      const auto values = run.column("frames.csv", column);
      return !values.empty() && values.front() != values.back();
    })) << column;
  }
  display_->tap("q", "Control_L");
  ASSERT_EQ(run.program().wait(), 0) << run.program().err();
  EXPECT_GT(expect_as_displayed(run, 15), 10u);
}

TEST_F(WindowTest, EndsInOrderWhenTheDisplayGoesAway) {
  PipelineRun run({}, "", "view");
  ASSERT_NE(live_window(run.program()), 0u);
  run.master();
  const auto pids = family(run.program().pid());
  display_->go_away();
  EXPECT_EQ(run.program().wait(60), 1);
  const std::string err = run.program().err();
  EXPECT_NE(err.find("the display went away"), std::string::npos) << err;
  EXPECT_EQ(err.find("serial number"), std::string::npos) << err;
  EXPECT_TRUE(none_runs(pids));
  EXPECT_TRUE(run.all_gone());
  EXPECT_GT(run.summary()["frames"], 0) << "the record is complete";
}

TEST_F(WindowTest, LeavesNothingBehindUnlessTold) {
  TemporaryFolder folder;
  write_terrain(folder / "terrain.ply");
  fs::create_directory(folder / "tmp");
  const Environment temporary("TMPDIR", (folder / "tmp").c_str());
  for (const bool interrupt : {false, true}) {
    Program program("telesplat",
                    {"view", folder / "terrain.ply", "--cache", folder / "cache", "--size", "320x200",
                     "--sampling-size", "320x200", "--sampler-threads", "1", "--trajectory", "orbit"},
                    folder / "telesplat");
    ASSERT_NE(live_window(program), 0u);
    const auto pids = family(program.pid());
    EXPECT_FALSE(fs::is_empty(folder / "tmp"));  // the logs, while it runs
    if (interrupt)
      program.signal(SIGINT);
    else
      display_->tap("q", "Control_L");
    EXPECT_EQ(program.wait(60), 0) << program.err();
    EXPECT_TRUE(none_runs(pids));
    EXPECT_TRUE(fs::is_empty(folder / "tmp"));
    EXPECT_FALSE(display_->find("terrain.ply"));
  }
}

// A virtual display has no buffers for two eyes.
TEST_F(WindowTest, QuadBuffersAreRefusedWhereThereAreNone) {
  Program program("telesplat", {"view", "julia", "--stereo", "quad-buffer", "--size", "320x200"},
                  folder_ / "telesplat");
  EXPECT_EQ(program.wait(60), 2);
  EXPECT_NE(program.err().find("quad-buffered OpenGL"), std::string::npos) << program.err();
}

TEST_F(WindowTest, JoinsARunningSessionLeavesItAndIsToldWhoEndedIt) {
  PipelineRun run({"--duration", "0", "--trajectory", "still"});
  ASSERT_TRUE(run.wait_showing()) << run.program().err();
  const std::vector<std::string> join{"view",    "--master",        run.master(), "--size",
                                      "320x200", "--sampling-size", "320x200"};
  Program leaves("telesplat", join, run.folder() / "leaves");
  ASSERT_NE(live_window(leaves), 0u);
  display_->tap("q", "Control_L");
  EXPECT_EQ(leaves.wait(60), 0) << leaves.err();
  EXPECT_TRUE(is_running(run.program().pid())) << "a guest ended the session";
  Program stays("telesplat", join, run.folder() / "stays");
  ASSERT_NE(live_window(stays), 0u);
  EXPECT_EQ(run.stop(), 0) << run.program().err();
  EXPECT_TRUE(run.all_gone());
  EXPECT_EQ(stays.wait(60), 0) << stays.err();
  EXPECT_NE(stays.err().find("the session was ended by " + net::this_person() + " (key operator)\n"), std::string::npos)
      << stays.err();
}

// It leaves nothing on disk that would tell its address, but says it, and telesplat ctl finds it.
TEST_F(WindowTest, AViewThatRecordsNothingIsFound) {
  TemporaryFolder folder;
  const Environment runtime("TELESPLAT_RUNTIME", (folder / "runtime").c_str());
  Program view("telesplat", {"view", "julia", "--size", "200x150", "--sampler-threads", "1"}, folder / "view");
  const auto window = live_window(view);
  ASSERT_NE(window, 0u);
  const std::string words = "session at tcp://127.0.0.1:", said = view.err();
  EXPECT_NE(said.find(words), std::string::npos) << said;
  Program list("telesplat", {"ctl", "list"}, folder / "list");
  EXPECT_EQ(list.wait(), 0);
  for (const char* told : {"tcp://127.0.0.1:", "julia (coral)", "view"})
    EXPECT_NE(list.out().find(told), std::string::npos) << told << " in\n" << list.out();
  Program set("telesplat", {"ctl", "set", "c.y=-0.3"}, folder / "set");
  EXPECT_EQ(set.wait(), 0) << set.err();
  EXPECT_EQ(set.out(), "epoch 2\n");
  Program stop("telesplat", {"ctl", "stop"}, folder / "stop");
  EXPECT_EQ(stop.wait(), 0) << stop.err();
  EXPECT_EQ(view.wait(), 0) << view.err();
}

TEST(NoDisplay, IsOneLineAndExitCodeTwo) {
  TemporaryFolder folder;
  write_terrain(folder / "terrain.ply", 4);
  const Environment wayland("WAYLAND_DISPLAY", nullptr);
  for (const char* display : {static_cast<const char*>(nullptr), "no-such-host-at-all:0"}) {
    const Environment x11("DISPLAY", display);
    Program program("telesplat", {"view", folder / "terrain.ply", "--out", folder / "out", "--cache", folder / "cache"},
                    folder / "telesplat");
    EXPECT_EQ(program.wait(60), 2);
    const std::string err = program.err();
    EXPECT_EQ(std::count(err.begin(), err.end(), '\n'), 1) << err;
    EXPECT_TRUE(err.starts_with("telesplat: ")) << err;
    for (const char* name : {"DISPLAY", "WAYLAND_DISPLAY", display ? display : "neither"})
      EXPECT_NE(err.find(name), std::string::npos) << err;
    EXPECT_FALSE(fs::exists(folder / "out")) << "something was started";
  }
  // A missing scene is told first, as by run.
  Program program("telesplat", {"view", folder / "missing.ply"}, folder / "telesplat");
  EXPECT_EQ(program.wait(60), 2);
  EXPECT_NE(program.err().find("missing.ply"), std::string::npos) << program.err();
}

}  // namespace
}  // namespace telesplat::test
