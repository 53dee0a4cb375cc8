// Settings that change while a session runs, at a real window and by `telesplat ctl`: the session has them.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <optional>
#include <sstream>

#include "tests/support/pipeline_run.h"
#include "tests/support/virtual_display.h"

namespace telesplat::test {
namespace {

using Json = nlohmann::json;

// A plate of 8 x 8 squares with heat (active) and age of its points.
void write_plate(const std::string& path) {
  constexpr int kSide = 9;
  std::ofstream out(path);
  out << "# vtk DataFile Version 3.0\nplate\nASCII\nDATASET POLYDATA\nPOINTS " << kSide * kSide << " float\n";
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) out << x << " " << y << " " << (x + y) % 2 * 0.2 << "\n";
  out << "POLYGONS " << 2 * 64 << " " << 8 * 64 << "\n";
  for (int y = 0; y + 1 < kSide; ++y)
    for (int x = 0; x + 1 < kSide; ++x) {
      const int a = y * kSide + x;
      out << "3 " << a << " " << a + 1 << " " << a + kSide + 1 << "\n3 " << a << " " << a + kSide + 1 << " "
          << a + kSide << "\n";
    }
  out << "POINT_DATA " << kSide * kSide << "\n";
  for (const auto& [name, scale] : {std::pair{"heat", 10}, {"age", 1}}) {
    out << "SCALARS " << name << " float 1\nLOOKUP_TABLE default\n";
    for (int i = 0; i < kSide * kSide; ++i) out << i % kSide * scale << "\n";
  }
}

class SettingsTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!VirtualDisplay::installed()) GTEST_SKIP() << "there is no Xvfb here: tools/setup installs it (package xvfb)";
    ::setenv("XDG_CONFIG_HOME", (folder_ / "config").c_str(), 1);
    ::setenv("TELESPLAT_WIDGET_LOG", log_.c_str(), 1);
    ::setenv("TELESPLAT_RUNTIME", (folder_ / "runtime").c_str(), 1);
    display_.emplace();
    ASSERT_TRUE(display_->ready()) << "Xvfb did not start";
    write_plate(plate_);
    // High enough for all of the panel.
    program_.emplace("telesplat",
                     std::vector<std::string>{"view", plate_, "--size", "500x1900", "--sampling-size", "320x200",
                                              "--trajectory", "still", "--samplers", "1", "--sampler-threads", "1",
                                              "--cache", folder_ / "cache", "--up", "z"},
                     folder_ / "view");
    ASSERT_TRUE(wait_until([&] { return (window_ = display_->find(" fps, ").value_or(0)) != 0; }, 60))
        << program_->err();
  }
  void TearDown() override {
    ::unsetenv("XDG_CONFIG_HOME");
    ::unsetenv("TELESPLAT_WIDGET_LOG");
    ::unsetenv("TELESPLAT_RUNTIME");
    if (!program_) return;
    if (window_) display_->close(window_);
    EXPECT_EQ(program_->wait(60), 0) << program_->err();
  }

  struct Widget {
    int x = 0, y = 0, left = 0, right = 0, uses = 0;
  };
  // Returns a widget that can be reached; nothing: no widget can.
  std::optional<Widget> widget(const std::string& name) const {
    std::istringstream in(read_text(log_));
    for (std::string line; std::getline(in, line);) {
      if (!line.starts_with(name + "\t")) continue;
      std::istringstream fields(line.substr(name.size() + 1));
      std::string kind;
      Widget w;
      int top = 0, bottom = 0, here = 0, reachable = 0;
      fields >> kind >> w.left >> top >> w.right >> bottom >> here >> reachable >> w.uses;
      w.x = (w.left + w.right) / 2, w.y = (top + bottom) / 2;
      if (here && reachable) return w;
    }
    return std::nullopt;
  }
  Widget find(const std::string& name) {
    std::optional<Widget> out;
    EXPECT_TRUE(wait_until([&] { return (out = widget(name)).has_value(); })) << "the panel has no " << name << ":\n"
                                                                              << read_text(log_);
    return out.value_or(Widget{});
  }
  // Until the panel says that it was used; one that is gone then, as a list's entry, was. News at the panel's top come
  // and go, and with them all below moves.
  void click(const std::string& name) {
    Widget at = find(name);
    const auto press = [&] {
      display_->move_pointer(window_, at.x, at.y);
      display_->button(1, true);
      display_->button(1, false);
    };
    press();
    EXPECT_TRUE(wait_until([&] {
      const auto now = widget(name);
      if (!now || now->uses > at.uses) return true;
      if (now->y != at.y) at = *now, press();
      return false;
    })) << name
        << ":\n"
        << read_text(log_);
  }
  // From a slider's beginning to three quarters of it, where its grab must be before the button is let go.
  void drag(const std::string& name) {
    const Widget slider = find(name);
    const int to = (slider.left + 3 * slider.right) / 4;
    display_->move_pointer(window_, slider.left + 4, slider.y);
    display_->button(1, true);
    display_->move_pointer(window_, to, slider.y);
    EXPECT_TRUE(wait_until([&] {
      const auto shown = display_->content(window_);
      return shown && (shown->colour[size_t(slider.y * shown->width + to)] & 0xff) > 0xe8;  // white
    })) << "the grab does not follow";
    display_->button(1, false);
  }
  int ctl(std::vector<std::string> arguments, std::string* said = nullptr) {
    arguments.insert(arguments.begin(), "ctl");
    Program program("telesplat", arguments, folder_ / ("ctl-" + std::to_string(++asked_)));
    const int code = program.wait(30);
    if (said) *said = program.out() + program.err();
    return code;
  }
  bool wait_status(const std::function<bool(const Json&)>& condition) {
    return wait_until(
        [&] {
          std::string said;
          if (ctl({"status", "--json"}, &said) != 0) return false;
          const Json status = Json::parse(said, nullptr, false);
          return status.is_object() && condition(status);
        },
        40);
  }
  bool coloured_by(const std::string& array) {
    return wait_status([&](const Json& s) { return s.contains("colouring") && s["colouring"]["array"] == array; });
  }
  bool has_samplers(size_t count) {
    return wait_status([&](const Json& s) {
      size_t here = 0;
      for (const auto& p : s["processes"]) here += p["role"] == "sampler" && p["alive"] == true;
      return here == count;
    });
  }

  TemporaryFolder folder_;
  std::string log_ = folder_ / "widgets", plate_ = folder_ / "plate.vtk";
  std::optional<VirtualDisplay> display_;
  std::optional<Program> program_;
  VirtualDisplay::WindowId window_ = 0;
  int asked_ = 0;
};

TEST_F(SettingsTest, ColoursAndCutsAreChosenInTheWindow) {
  EXPECT_TRUE(coloured_by("heat")) << "the file's active scalars";
  find("Colours/array");  // the panel knows the session
  click("panel/Cut");
  const int second_row = find("panel/hide").y + 30;
  EXPECT_TRUE(wait_until([&] { return find("panel/open ...").y < second_row; })) << "the news stay";
  drag("Cut/x from");
  EXPECT_TRUE(wait_status(
      [](const Json& s) { return s.contains("clip") && s["clip"].get<std::string>().starts_with("plane x>="); }));
  click("Cut/off");
  EXPECT_TRUE(wait_status([](const Json& s) { return !s.contains("clip"); }));
  click("Colours/array");
  click("Colours/array=age");
  EXPECT_TRUE(coloured_by("age"));
}

TEST_F(SettingsTest, CtlChangesTheWindowAndTheSamplersOrSaysWhyNot) {
  std::string said;
  EXPECT_EQ(ctl({"splat", "square"}, &said), 0) << said;
  EXPECT_EQ(said, "splat square\n");
  EXPECT_EQ(ctl({"splat", "round"}, &said), 2);
  EXPECT_NE(said.find("square, disc, ellipse"), std::string::npos) << said;
  EXPECT_EQ(ctl({"stereo", "autostereo"}, &said), 2);
  EXPECT_NE(said.find("--barrier"), std::string::npos) << said;
  EXPECT_EQ(ctl({"stereo", "anaglyph-dubois"}, &said), 0) << said;
  EXPECT_EQ(ctl({"stereo", "off"}, &said), 0) << said;
  EXPECT_EQ(ctl({"samplers", "3"}, &said), 0) << said;
  EXPECT_EQ(said, "3 samplers\n");
  EXPECT_TRUE(has_samplers(3));
  EXPECT_EQ(ctl({"samplers", "1"}, &said), 0) << said;
  EXPECT_TRUE(has_samplers(1));
  EXPECT_EQ(ctl({"samplers", "0"}, &said), 2);
  EXPECT_EQ(ctl({"lighting", "off"}, &said), 2) << "of a volume";
  // Opened anew, turned; then with a value that cannot be, after which it is there as before.
  EXPECT_EQ(ctl({"up", "y"}, &said), 0) << said;
  EXPECT_TRUE(wait_status([](const Json& s) {
    for (const auto& p : s["processes"])
      if (p["role"] == "data" && p["alive"] == true && p["facts"]["up"] == "y") return true;
    return false;
  }));
}

}  // namespace
}  // namespace telesplat::test
