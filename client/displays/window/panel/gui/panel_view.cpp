#include "client/displays/window/panel/gui/panel_view.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "client/displays/window/panel/gui/widgets.h"
#include "common/core/within.h"
#include "common/geometry/camera.h"
#include "common/image/shading.h"

namespace telesplat::viewer {
namespace {

constexpr float kWidth = 24, kPlotHeight = 2.4f;              // in letters' heights
constexpr size_t kColumns = 160;                              // columns of a plot
constexpr ImU32 kProblem = IM_COL32(0xd5, 0x5e, 0x00, 0xff);  // Okabe and Ito's vermilion
constexpr std::array<std::pair<int, int>, 4> kPictures{{{1920, 1080}, {2560, 1600}, {3840, 2160}, {7680, 4320}}};
std::string picture_size(const PictureWish& wish) { return fmt::format("{} x {}", wish.width, wish.height); }

// Returns a round number above all values.
double round_top(double most) {
  const double step = std::pow(10, std::floor(std::log10(most)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (most <= factor * step) return factor * step;
  return 10 * step;
}

// Draws name and newest value above one curve, so that no person must tell curves apart by their colours.
void show_plot(const FigurePlots::Plot& plot, double now_s) {
  const auto columns = plot.history.columns(now_s, kColumns);
  double most = plot.floor;
  for (const float v : columns)
    if (!std::isnan(v)) most = std::max(most, double(v));
  const double top = round_top(most);
  text(plot.name);
  const std::string value =
      plot.history.empty() ? "-" : fmt::format("{:.{}f} {}", plot.history.newest(), plot.digits, plot.unit);
  ImGui::SameLine(ImGui::GetContentRegionMax().x - ImGui::CalcTextSize(value.c_str()).x);
  text(value);
  const ImVec2 from = ImGui::GetCursorScreenPos();
  const ImVec2 size(ImGui::GetContentRegionAvail().x, ImGui::GetFontSize() * kPlotHeight);
  auto& list = *ImGui::GetWindowDrawList();
  const ImVec2 to(from.x + size.x, from.y + size.y);
  list.AddRectFilled(from, to, ImGui::GetColorU32(ImGuiCol_FrameBg));
  const std::string limit = fmt::format("{:g}", top);
  list.AddText(ImVec2(from.x + 3, from.y), ImGui::GetColorU32(ImGuiCol_TextDisabled), limit.c_str());
  std::array<ImVec2, kColumns> line;
  int count = 0;
  for (size_t i = 0; i < kColumns; ++i) {
    if (std::isnan(columns[i])) continue;
    const double share = within(double(columns[i]) / top, 0.0, 1.0);
    line[size_t(count++)] = {from.x + size.x * float(i) / float(kColumns - 1), to.y - 1 - float(share) * (size.y - 2)};
  }
  if (count > 1) list.AddPolyline(line.data(), count, ink(plot.colour), ImDrawFlags_None, ImGui::GetFontSize() / 9);
  ImGui::Dummy(size);
}

void show_figures(const Panel& panel, double now_s) {
  const auto& f = panel.figures();
  if (f.waits_s > 0)
    text(fmt::format("waiting for a view update, {:.0f} s", f.waits_s));
  else
    text(fmt::format("{:.1f} frames a second, {:.2f} M cached", panel.plots().frames_a_second(),
                     double(f.frame.drawn.cached) / 1e6));
  if (const auto& r = f.session.renderer; r.gl_ms > 0)
    text(fmt::format("{} draws: a frame took {:.1f} ms on the processor, {:.1f} ms by OpenGL", r.kept, r.cpu_ms,
                     r.gl_ms));
  for (const auto& plot : panel.plots().plots()) show_plot(plot, now_s);
}

// Buttons act as their keys do.
void show_pictures(Panel& panel, PanelViewState& state) {
  row("picture");
  if (begin_list("picture", state.picture.own_size() ? picture_size(state.picture).c_str() : "as the window")) {
    if (choice("picture", "as the window", !state.picture.own_size())) state.picture.width = state.picture.height = 0;
    for (const auto& [width, height] : kPictures) {
      const PictureWish wish{width, height, state.picture.exr};
      if (choice("picture", picture_size(wish), state.picture == wish)) state.picture = wish;
    }
    ImGui::EndCombo();
  }
  row("pixels");
  int size[2] = {state.picture.width, state.picture.height};
  if (seen("number", "pixels", ImGui::InputInt2("##pixels", size))) {
    state.picture.width = within(size[0], 0, geometry::kMaxImageSide);
    state.picture.height = within(size[1], 0, geometry::kMaxImageSide);
  }
  hint("any size; 0: as the window");
  if (button("take")) panel.choose_picture(state.picture);
  ImGui::SameLine();
  checkbox("EXR with depth", &state.picture.exr);
  const auto& path = panel.path();
  row("path");
  if (button(path.records ? "end" : "record")) panel.press(Key::kC);
  hint("of the camera, as a CSV file that --trajectory takes");
  if (path.can_play) {
    ImGui::SameLine();
    if (button(path.plays ? "take the camera" : "play")) panel.press(Key::kT);
  }
  if (path.records) {
    ImGui::SameLine();
    text(fmt::format("{:.0f} s", path.recorded_s));
  }
  row("window");
  if (button("full screen")) panel.press(Key::kF11);
  ImGui::SameLine();
  if (button("first view")) panel.press(Key::kR);
  row("view from");
  for (int i = 0; i < 6; ++i) {
    const Side side{i / 2, i % 2 == 1};
    if (i > 0) ImGui::SameLine();
    if (small_button(side_name(side).c_str())) panel.choose_side(side);
  }
  hint("an axis of the data: +X is where x grows");
}

void show_session(const Panel& panel) {
  if (!panel.status()) return ImGui::TextDisabled("the master has not answered yet");
  for (const auto& p : panel.status()->processes) {
    text(p.name);
    ImGui::SameLine(ImGui::GetFontSize() * 9);
    if (!p.alive)
      ImGui::TextDisabled("has left");
    else if (p.silent_s >= 3)
      text(fmt::format("silent for {:.0f} s", p.silent_s));
    else
      text("here");
  }
}

void show_messages(const Panel& panel) {
  if (panel.messages().empty()) return ImGui::TextDisabled("none");
  const auto& all = panel.messages();
  for (size_t i = all.size(), shown = 0; i-- > 0 && shown < 12; ++shown) {
    ImGui::PushTextWrapPos(0);
    if (all[i].problem) ImGui::PushStyleColor(ImGuiCol_Text, kProblem);
    text(fmt::format("{}{}", all[i].problem ? "! " : "", all[i].text));
    if (all[i].problem) ImGui::PopStyleColor();
    ImGui::PopTextWrapPos();
  }
}

}  // namespace

double show_panel(Panel& panel, PanelViewState& state, double now_s, const std::vector<PanelSection>& more) {
  const ImVec2 window = ImGui::GetIO().DisplaySize;
  const float width = std::min(ImGui::GetFontSize() * kWidth, window.x);
  ImGui::SetNextWindowPos({0, 0});
  ImGui::SetNextWindowSize({width, window.y});
  constexpr ImGuiWindowFlags kFixed = ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize |
                                      ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoSavedSettings;
  if (ImGui::Begin("panel", nullptr, kFixed)) {
    dialog("panel", nullptr);
    text(panel.figures().session.scene.empty() ? "Telesplat" : panel.figures().session.scene);
    if (small_button("hide")) panel.press(Key::kTab);
    ImGui::SameLine();
    ImGui::TextDisabled("as Tab does; F1 lists keys");
    for (const auto& line : panel.news(now_s)) ImGui::TextWrapped("%s", line.c_str());
    if (panel.setup().opens && button("open ...")) panel.press(Key::kO);
    if (section("Figures", true)) show_figures(panel, now_s);
    if (section("Display", true)) show_display(panel);
    if (panel.pipeline() == scene::Pipeline::kPoints && section("Light", false))
      setting_list(panel, "shading",
                   std::vector<std::string>(image::kShadingNames.begin(), image::kShadingNames.end()));
    for (const auto& show : more) show(panel);
    if (section("Over the picture", false)) show_over_the_picture(panel);
    if (section("Sampling", false)) show_sampling(panel);
    if (section("Samplers", false)) show_samplers(panel, state.settings);
    if (section("Stereo", false)) show_stereo(panel);
    if (section("Data", false)) show_data(panel, state.settings, panel.kind());
    if (section("Pictures and paths", false)) show_pictures(panel, state);
    if (section("Session", false)) show_session(panel);
    if (section("Messages", true)) show_messages(panel);
  }
  ImGui::End();
  return double(width);
}

// The first column ends at two blanks.
void show_keys(const std::vector<std::string>& lines) {
  const float letter = ImGui::GetFontSize(), left = letter * (kWidth + 1);
  ImGui::SetNextWindowPos({left, letter});
  ImGui::SetNextWindowBgAlpha(0.92f);
  constexpr ImGuiWindowFlags kFixed = ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize |
                                      ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoSavedSettings |
                                      ImGuiWindowFlags_AlwaysAutoResize;
  if (ImGui::Begin("Keys and mouse", nullptr, kFixed)) {
    ImGui::PushTextWrapPos(std::max(letter * 12, ImGui::GetIO().DisplaySize.x - left - letter * 2));
    for (const auto& line : lines) {
      const size_t end = line.find("  "), begin = end == line.npos ? line.find(' ') : line.find_first_not_of(' ', end);
      text(line.substr(0, end == line.npos ? begin : end));
      ImGui::SameLine(letter * 9);
      text(begin == line.npos ? "" : line.substr(begin));
    }
    ImGui::PopTextWrapPos();
  }
  ImGui::End();
}

}  // namespace telesplat::viewer
