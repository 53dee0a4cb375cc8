// The panel of `telesplat view`: a real window on a display without a screen, real input, real processes.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include "tests/support/pipeline_run.h"
#include "tests/support/virtual_display.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

// The scale of a display of 96 dots an inch, as an X server without a screen has.
constexpr int kLetter = 15, kPanelWidth = 24 * kLetter;
constexpr uint32_t kCheckMark = 0x56b4e9;

uint32_t at(const image::View& v, int x, int y) { return v.colour[size_t(y * v.width + x)] & 0xffffff; }

bool alike(uint32_t a, uint32_t b) {
  for (const int shift : {0, 8, 16})
    if (std::abs(int(a >> shift & 255) - int(b >> shift & 255)) > 3) return false;
  return true;
}

// True if the panel lies over the left side: its ground is there, and nothing like it at the right.
bool shows_panel(const image::View& v) {
  int ground = 0;
  for (int y = 0; y < v.height; ++y) ground += alike(at(v, 3, y), 0x171819);
  return ground > v.height * 9 / 10;
}

// Where the panel ends: the last column that is its ground for the most part of the lowest rows.
int panel_width(const image::View& v) {
  int width = 0;
  for (int x = 0; x < v.width; ++x) width = alike(at(v, x, v.height - 3), 0x171819) ? x + 1 : width;
  return width;
}

struct Place {
  int x = 0, y = 0;
};

// The middles of check marks and chosen dots: compact blobs of their colour. Curves are thin.
std::vector<Place> marks(const image::View& v) {
  std::vector<Place> out;
  for (int y = 0; y + 8 < v.height; ++y)
    for (int x = 0; x + 8 < std::min(v.width, kPanelWidth); ++x) {
      int count = 0;
      for (int dy = 0; dy < 8; ++dy)
        for (int dx = 0; dx < 8; ++dx) count += alike(at(v, x + dx, y + dy), kCheckMark);
      const bool known = std::any_of(out.begin(), out.end(), [&](const Place& p) {
        return std::abs(p.x - x - 4) < 14 && std::abs(p.y - y - 4) < 14;
      });
      if (count >= 20 && !known) out.push_back({x + 4, y + 4});
    }
  return out;
}

// Returns a process of this program that `parent` started; 0: no such process runs.
pid_t child_of(pid_t parent, const std::string& program) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator("/proc", error)) {
    std::ifstream in(entry.path() / "stat");
    std::string pid, name, state;
    pid_t of = 0;
    if (in >> pid >> name >> state >> of && of == parent && name == "(" + program + ")" && state != "Z")
      return std::atoi(pid.c_str());
  }
  return 0;
}

class PanelTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!VirtualDisplay::installed()) GTEST_SKIP() << "there is no Xvfb here: tools/setup installs it (package xvfb)";
    ::setenv("XDG_CONFIG_HOME", (folder_ / "config").c_str(), 1);
    display_.emplace();
    ASSERT_TRUE(display_->ready()) << "Xvfb did not start";
  }
  void TearDown() override { ::unsetenv("XDG_CONFIG_HOME"); }

  VirtualDisplay::WindowId live_window(const Program& program, const std::string& title = " fps, ") {
    std::optional<VirtualDisplay::WindowId> window;
    EXPECT_TRUE(wait_until([&] { return (window = display_->find(title)).has_value(); }, 60)) << program.err();
    return window.value_or(0);
  }
  // Each at once after the other: what a press is meant for is decided by where the pointer was then.
  void click(VirtualDisplay::WindowId window, const Place& at) {
    // The panel sees the pointer with the next frame.
    display_->move_pointer(window, at.x, at.y);
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    display_->button(1, true);
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    display_->button(1, false);
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
  void drag(VirtualDisplay::WindowId window, const Place& from, const Place& to) {
    display_->move_pointer(window, from.x, from.y);
    display_->button(1, true);
    display_->move_pointer(window, to.x, to.y);
    display_->button(1, false);
  }
  image::View shown(VirtualDisplay::WindowId window) { return display_->content(window).value_or(image::View{}); }
  // The dialog that opens a data set, in the middle of a window of 960 x 720.
  bool shows_dialog(VirtualDisplay::WindowId window) {
    const auto v = display_->content(window);
    return v && alike(at(*v, v->width / 2, v->height - 130), 0x171819);
  }
  bool panel_is(VirtualDisplay::WindowId window, bool wanted) {
    return wait_until([&] {
      const auto v = display_->content(window);
      return v && shows_panel(*v) == wanted;
    });
  }

  TemporaryFolder folder_;
  std::optional<VirtualDisplay> display_;
};

TEST_F(PanelTest, LiesOverTheFrameKeepsThePointerAndGoesWithTab) {
  PipelineRun run({"--panel", "on", "--size", "960x720", "--trajectory", "still"}, "", "view");
  const auto window = live_window(run.program());
  ASSERT_NE(window, 0u);
  ASSERT_TRUE(panel_is(window, true));
  // The first view leaves free what the panel covers, and follows it until a person moves the camera.
  // The columns right of the panel that show something else than the background.
  const auto shows = [&](int from) {
    const auto v = shown(window);
    Place out{1 << 20, -1};
    for (int y = 0; y < v.height; ++y)
      for (int x = from; x < v.width; ++x)
        if (at(v, x, y) != 0x141820) out = {std::min(out.x, x), std::max(out.y, x)};
    return out;
  };
  const auto beside_panel = [&] {
    const Place p = shows(kPanelWidth + 2);
    return p.x > kPanelWidth + 5 && p.y < 955 && p.y - p.x > 300;
  };
  EXPECT_TRUE(wait_until(beside_panel)) << shows(kPanelWidth).x << " " << shows(kPanelWidth).y;
  display_->tap("Tab");
  EXPECT_TRUE(panel_is(window, false));
  EXPECT_TRUE(wait_until([&] {
    const Place p = shows(0);
    return p.x > 5 && p.x < kPanelWidth && std::abs(p.x + p.y - 960) < 60;
  })) << shows(0).x;
  display_->tap("Tab");
  EXPECT_TRUE(wait_until(beside_panel));

  const auto pose = [&] {
    const auto x = run.column("frames.csv", "px"), z = run.column("frames.csv", "pz");
    const size_t rows = std::min(x.size(), z.size());
    return rows > 0 ? std::pair(x[rows - 1], z[rows - 1]) : std::pair(0.0, 0.0);
  };
  // Rows come about once a second: the second ones from now on are of frames after the panel came back.
  for (int n = 0; n < 2; ++n) {
    const size_t before = run.column("frames.csv", "px").size();
    ASSERT_TRUE(wait_until([&] { return run.column("frames.csv", "px").size() > before; }));
  }
  const auto home = pose();
  // There and back beside the panel; a press over it is the panel's, however quickly the pointer leaves it.
  drag(window, {40, 8}, {600, 300});
  drag(window, {600, 300}, {700, 300});
  EXPECT_TRUE(wait_until([&] { return std::abs(pose().first - home.first) > 0.01; }));
  drag(window, {700, 300}, {600, 300});
  EXPECT_TRUE(wait_until([&] { return std::hypot(pose().first - home.first, pose().second - home.second) < 1e-3; }));

  display_->tap("p");
  const auto picture = [&] {
    for (const auto& entry : fs::directory_iterator(run.out() + "/images"))
      if (const auto& path = entry.path();
          path.filename().string().starts_with("telesplat-") && path.extension() == ".png")  // else it is being written
        return path.string();
    return std::string();
  };
  ASSERT_TRUE(wait_until([&] { return fs::exists(run.out() + "/images") && !picture().empty(); }));
  const auto read = image::read_view(picture());
  ASSERT_TRUE(read) << read.error().text;
  EXPECT_FALSE(shows_panel(*read)) << "pictures show what is drawn";
  display_->close(window);
  EXPECT_EQ(run.program().wait(60), 0) << run.program().err();
}

TEST_F(PanelTest, OnADenseScreenLettersHaveMorePixels) {
  display_->set_density(192);
  PipelineRun run({"--panel", "on", "--size", "1000x700", "--trajectory", "still"}, "", "view");
  const auto window = live_window(run.program());
  ASSERT_NE(window, 0u);
  EXPECT_TRUE(panel_is(window, true));
  EXPECT_TRUE(wait_until([&] { return std::abs(panel_width(shown(window)) - 2 * kPanelWidth) < 40; }))
      << panel_width(shown(window));
  display_->tap("q", "Control_L");
  EXPECT_EQ(run.program().wait(60), 0) << run.program().err();
}

TEST_F(PanelTest, ACheckMarkChangesHowFramesAreDrawn) {
  PipelineRun run({"--panel", "on", "--size", "960x760", "--trajectory", "still"}, "", "view");
  const auto window = live_window(run.program());
  ASSERT_NE(window, 0u);
  ASSERT_TRUE(panel_is(window, true));
  // fill, smooth, antialias in one row.
  std::vector<Place> found;
  ASSERT_TRUE(wait_until([&] { return (found = marks(shown(window))).size() >= 3; })) << found.size();
  const auto three = std::find_if(found.begin(), found.end(), [&](const Place& p) {
    return std::count_if(found.begin(), found.end(), [&](const Place& q) { return std::abs(p.y - q.y) < 4; }) == 3;
  });
  ASSERT_NE(three, found.end());
  Place fill = *three;
  for (const Place& p : found)
    if (std::abs(p.y - fill.y) < 4 && p.x < fill.x) fill = p;
  click(window, fill);
  const auto finish = [&] {
    const auto v = run.column("frames.csv", "finish");
    return v.empty() ? -1.0 : v.back();
  };
  EXPECT_TRUE(wait_until([&] { return finish() == 6; })) << finish() << ": 1 fill, 2 smooth, 4 antialias";
  click(window, fill);
  EXPECT_TRUE(wait_until([&] { return finish() == 7; })) << finish();
  display_->tap("q", "Control_L");
  EXPECT_EQ(run.program().wait(60), 0) << run.program().err();
}

TEST_F(PanelTest, AWindowWithoutADataSetOpensOneByAWordOfTheDialog) {
  Program view("telesplat", {"view", "--size", "960x720", "--sampler-threads", "1", "--panel", "off"},
               folder_ / "view");
  const auto window = live_window(view, "waiting for the data set");
  ASSERT_NE(window, 0u);
  // The dialog lies in the middle.
  const auto has_dialog = [&] { return shows_dialog(window); };
  EXPECT_TRUE(wait_until(has_dialog));
  // "julia" is the button at the right of the path's row.
  const Place julia{480 + 22 * kLetter - 73, 360 - 17 * kLetter + 59};
  click(window, julia);
  const auto live = live_window(view);
  EXPECT_EQ(live, window) << "it is the same window";
  EXPECT_TRUE(display_->title(window).starts_with("julia")) << display_->title(window);
  EXPECT_TRUE(wait_until([&] { return !has_dialog(); }));
  EXPECT_EQ(read_text(folder_ / "config/telesplat/recent"), "julia\n");

  // Letters that are typed are no keys of the window; what is not there is said, and the picture stays.
  // However fast they come: before the dialog is there, and Return right behind them.
  for (const char* key : {"o", "slash", "q", "x", "BackSpace", "period", "p", "l", "y", "Return"}) display_->tap(key);
  EXPECT_TRUE(wait_until([&] { return view.err().find("telesplat: /q.ply") != std::string::npos; })) << view.err();
  EXPECT_TRUE(wait_until([&] { return display_->title(window).find(" fps, ") != std::string::npos; }));
  EXPECT_EQ(read_text(folder_ / "config/telesplat/recent"), "julia\n");

  // A data set that kills its server again and again is given up, and the window stays.
  const auto given_up = [&] { return view.err().find("data ended with code 137") != std::string::npos; };
  for (pid_t before = 0, now = 0; !given_up(); before = now) {
    ASSERT_TRUE(wait_until([&] {
      now = child_of(view.pid(), "telesplat-data");
      return given_up() || (now != 0 && now != before);
    })) << view.err();
    if (now != 0 && now != before) ::kill(now, SIGKILL);
  }
  // Another one is opened in the same window.
  display_->tap("o");
  ASSERT_TRUE(wait_until([&] { return shows_dialog(window); })) << view.err();
  click(window, julia);
  EXPECT_TRUE(wait_until([&] { return child_of(view.pid(), "telesplat-data") != 0; })) << view.err();
  display_->tap("o");
  display_->tap("q", "Control_L");
  EXPECT_EQ(view.wait(60), 0) << view.err();
}

// Each letter of the path is also a command, and Escape is the key that closes dialogs everywhere.
TEST_F(PanelTest, TheDialogTakesTheLettersAndEscapeClosesIt) {
  PipelineRun run({"--trajectory", "still"}, "", "view");
  const auto window = live_window(run.program());
  ASSERT_NE(window, 0u);
  const auto has_dialog = [&] {
    const auto v = display_->content(window);
    return v && alike(at(*v, v->width / 2, v->height - 30), 0x171819);
  };
  display_->tap("o");
  for (const char* key : {"n", "o", "f", "i", "p", "q", "q"}) display_->tap(key);
  EXPECT_TRUE(wait_until(has_dialog));
  display_->tap("Escape");
  EXPECT_TRUE(wait_until([&] { return !has_dialog(); }));
  // Again and again, with nothing open.
  for (int i = 0; i < 3; ++i) display_->tap("Escape");
  EXPECT_TRUE(wait_until([&] { return run.program().err().find("Ctrl+Q quits\n") != std::string::npos; }))
      << run.program().err();
  display_->tap("3");
  EXPECT_TRUE(wait_until([&] { return run.program().err().find("splats: ellipse") != std::string::npos; }))
      << run.program().err();
  for (const char* done : {"bookmark", "screenshot: ", "once more"})
    EXPECT_EQ(run.program().err().find(done), std::string::npos) << run.program().err();
  display_->tap("q");
  EXPECT_TRUE(wait_until([&] { return run.program().err().find("once more") != std::string::npos; }));
  display_->tap("q");  // at once it would be the key that is held and repeats
  EXPECT_EQ(run.program().wait(60), 0) << run.program().err();
}

// Window managers need not keep to the least size that a window asks for.
TEST_F(PanelTest, AWindowOfOnePixelGoesOn) {
  for (const char* stereo : {"off", "side-by-side"}) {
    PipelineRun run({"--panel", "on", "--stereo", stereo, "--trajectory", "still"}, "", "view");
    const auto window = live_window(run.program());
    ASSERT_NE(window, 0u);
    display_->tap("h");
    for (const auto& [width, height] : {std::pair{1, 1}, {1, 500}, {700, 1}, {30, 30}, {360, 200}, {900, 600}}) {
      display_->resize(window, width, height);
      const auto frames = run.column("frames.csv", "frame").size();
      EXPECT_TRUE(wait_until([&] { return run.column("frames.csv", "frame").size() > frames + 3; }))
          << width << " x " << height << ": " << run.program().err();
    }
    EXPECT_TRUE(panel_is(window, true));
    display_->tap("q", "Control_L");
    EXPECT_EQ(run.program().wait(60), 0) << run.program().err();
  }
}

TEST_F(PanelTest, AFileThatIsDroppedIsOpenedInTheSameWindow) {
  write_terrain(folder_ / "first.ply");
  write_volume(folder_ / "second.mha");
  Program view(
      "telesplat",
      {"view", folder_ / "first.ply", "--cache", folder_ / "cache", "--size", "960x720", "--sampler-threads", "1"},
      folder_ / "view");
  const auto window = live_window(view, "first.ply - ");
  ASSERT_NE(window, 0u);
  EXPECT_EQ(live_window(view), window);
  ASSERT_TRUE(display_->drop_file(window, folder_ / "second.mha"));
  EXPECT_EQ(live_window(view, "second.mha - "), window) << view.err();
  EXPECT_TRUE(wait_until([&] { return display_->title(window).find("samples drawn") != std::string::npos; }, 60))
      << display_->title(window);
  EXPECT_EQ(read_text(folder_ / "config/telesplat/recent"),
            folder_ / "second.mha" + "\n" + (folder_ / "first.ply") + "\n");

  // The window names a file that cannot be read, and opens the next one all the same.
  std::ofstream(folder_ / "broken.ply") << "ply\nformat ascii 1.0\nelement vertex 3\nend_header\n1 2";
  ASSERT_TRUE(display_->drop_file(window, folder_ / "broken.ply"));
  EXPECT_TRUE(wait_until([&] { return view.err().find("broken.ply: ") != std::string::npos; }, 30)) << view.err();
  ASSERT_TRUE(display_->drop_file(window, folder_ / "first.ply"));
  EXPECT_EQ(live_window(view, "first.ply - "), window) << view.err();
  EXPECT_TRUE(wait_until([&] { return display_->title(window).find("points drawn") != std::string::npos; }, 60))
      << display_->title(window) << "\n"
      << view.err();

  // A path plays at once.
  std::ofstream(folder_ / "path.csv") << "t_s,px,py,pz,qw,qx,qy,qz\n0,0,0.3,1,1,0,0,0\n60,0.2,0.3,1,1,0,0,0\n";
  ASSERT_TRUE(display_->drop_file(window, folder_ / "path.csv"));
  EXPECT_TRUE(wait_until([&] { return view.err().find("playing " + (folder_ / "path.csv")) != std::string::npos; }))
      << view.err();
  display_->tap("q", "Control_L");
  EXPECT_EQ(view.wait(60), 0) << view.err();
}

}  // namespace
}  // namespace telesplat::test
