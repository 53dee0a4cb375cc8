// The panel and the dialog with unusual input: windows of a pixel, invalid names, texts that look like formats. Dear
// ImGui ends the program at input that it does not expect.
#include <gtest/gtest.h>
#include <imgui.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <thread>

#include "client/displays/window/panel/gui/open_view.h"
#include "client/displays/window/panel/gui/panel_view.h"
#include "client/displays/window/panel/gui/scene_view.h"
#include "client/displays/window/panel/gui/style.h"
#include "common/core/clock.h"

namespace telesplat::viewer {
namespace {

namespace fs = std::filesystem;

const char* const kWords[] = {"",       "##",   "###", "a##b",        "%s%n%d%", "\xff\xfe\x80",
                              "\n\r\t", "a\nb", " ",   "\xe2\x88\x9e"};

class Edges : public testing::TestWithParam<std::pair<float, float>> {
 protected:
  Edges() {
    context_ = ImGui::CreateContext();
    ImGuiIO& io = ImGui::GetIO();
    io.IniFilename = nullptr;
    io.DisplaySize = {GetParam().first, GetParam().second};
    io.DeltaTime = 1 / 60.0f;
    GuiStyle().fit(1, 1);
    unsigned char* pixels = nullptr;
    int width = 0, height = 0;
    io.Fonts->GetTexDataAsAlpha8(&pixels, &width, &height);
  }
  ~Edges() override { ImGui::DestroyContext(context_); }

  template <class F>
  void frames(int count, F build) {
    ImGuiIO& io = ImGui::GetIO();
    for (int i = 0; i < count; ++i) {
      io.MousePos = {io.DisplaySize.x * float(i % 7) / 7, io.DisplaySize.y * float(i % 11) / 11};
      io.MouseDown[0] = i % 2;
      ImGui::NewFrame();
      build(1 + i / 60.0);
      ImGui::Render();
      ++drawn_;
    }
  }
  ImGuiContext* context_ = nullptr;
  int drawn_ = 0;
};

TEST_P(Edges, ThePanelIsBuiltWhateverTheWindowAndTheWords) {
  for (const scene::Pipeline pipeline : {scene::Pipeline::kPoints, scene::Pipeline::kSlices}) {
    Panel panel({.viewer = "viewer-1", .shown = true, .opens = true});
    panel.on_scene(pipeline);
    PanelViewState view;
    SessionStatus status;
    for (const char* word : kWords) {
      panel.tell(1, word, true);
      panel.on_progress(word);
      status.processes.push_back({.role = word, .name = word, .alive = true});
    }
    panel.on_status(1, status, "");
    frames(150, [&](double now_s) {
      panel.on_figures({.now_s = now_s,
                        .frame = {.previous_s = 1, .end_s = now_s > 2 ? NAN : 1e297},
                        .session = {.scene = kWords[int(now_s * 60) % 10]}});
      show_panel(panel, view, now_s, {});
      show_keys(key_help());
    });
  }
  EXPECT_EQ(drawn_, 300);
}

TEST_P(Edges, TheDialogListsWhateverTheFilesAreCalled) {
  const fs::path folder = fs::temp_directory_path() / ("telesplat-edges-" + std::to_string(getpid()));
  fs::create_directory(folder);
  int made = 0;
  for (const char* word : kWords)
    if (*word) made += bool(std::ofstream(folder / word) << "x");
  fs::create_directory(folder / "###%s");
  EXPECT_EQ(made, 9);
  OpenViewState state{.shown = true, .begun = true};
  state.files.go(folder.string());
  for (const double until = monotonic_s() + 30; state.files.busy() && monotonic_s() < until;) std::this_thread::yield();
  ASSERT_TRUE(state.files.listing());
  EXPECT_EQ(state.files.listing()->entries.size(), 10u);
  std::string opened;
  frames(150, [&](double) {
    show_open(state, true, [&](const std::string& path) { opened = path; });
    state.shown = true;
  });
  EXPECT_EQ(drawn_, 150);
  fs::remove_all(folder);
}

INSTANTIATE_TEST_SUITE_P(Sizes, Edges,
                         testing::Values(std::pair{1.0f, 1.0f}, std::pair{1.0f, 900.0f}, std::pair{1200.0f, 1.0f},
                                         std::pair{200.0f, 120.0f}, std::pair{1280.0f, 800.0f},
                                         std::pair{16384.0f, 16384.0f}));

// The field has the focus when the dialog opens, and again after a click elsewhere in it: letters are never lost.
TEST(OpenDialog, LettersGoToThePathAsSoonAsItIsOpen) {
  ImGuiContext* const context = ImGui::CreateContext();
  ImGuiIO& io = ImGui::GetIO();
  io.IniFilename = nullptr;
  io.DisplaySize = {1280, 800};
  io.DeltaTime = 1 / 60.0f;
  GuiStyle().fit(1, 1);
  unsigned char* pixels = nullptr;
  int width = 0, height = 0;
  io.Fonts->GetTexDataAsAlpha8(&pixels, &width, &height);
  OpenViewState state{.shown = true};
  const auto frame = [&] {
    ImGui::NewFrame();
    show_open(state, true, [](const std::string&) {});
    ImGui::Render();
  };
  for (int i = 0; i < 3; ++i) frame();
  EXPECT_TRUE(io.WantTextInput);
  io.AddInputCharactersUTF8("/data/a");
  for (int i = 0; i < 2; ++i) frame();
  EXPECT_EQ(state.path, "/data/a");
  for (const auto& [x, y] : {std::pair{640.0f, 780.0f}, {335.0f, 200.0f}}) {  // outside, and beside its widgets
    io.MousePos = {x, y};
    for (const bool down : {true, false, false, false, false}) {
      io.MouseDown[0] = down;
      frame();
    }
    EXPECT_TRUE(io.WantTextInput);
  }
  ImGui::DestroyContext(context);
}

}  // namespace
}  // namespace telesplat::viewer
