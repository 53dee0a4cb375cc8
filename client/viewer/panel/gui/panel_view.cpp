#include "client/viewer/panel/gui/panel_view.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "client/viewer/panel/gui/widgets.h"
#include "common/splat/kernel_traits.h"
#include "common/wire/limits.h"

namespace telesplat::viewer {
namespace {

constexpr float kWidth = 24, kPlotHeight = 2.4f;              // in letters' heights
constexpr size_t kColumns = 160;                              // of a plot
constexpr ImU32 kProblem = IM_COL32(0xd5, 0x5e, 0x00, 0xff);  // Okabe and Ito's vermilion
constexpr std::array<std::pair<int, int>, 6> kSizes{
    {{640, 400}, {960, 600}, {1280, 800}, {1600, 1000}, {1920, 1200}, {2560, 1600}}};
constexpr std::array<std::pair<int, int>, 4> kPictures{{{1920, 1080}, {2560, 1600}, {3840, 2160}, {7680, 4320}}};
// Backgrounds that data of any colour stands out from.
constexpr std::array<std::pair<const char*, uint32_t>, 4> kBackgrounds{
    {{"night", 0x141820}, {"black", 0x000000}, {"grey", 0x777777}, {"white", 0xffffff}}};

std::string picture_size(const PictureWish& wish) { return fmt::format("{} x {}", wish.width, wish.height); }

// From 0 to a round number above all values.
double round_top(double most) {
  const double step = std::pow(10, std::floor(std::log10(most)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (most <= factor * step) return factor * step;
  return 10 * step;
}

// Name and newest value above, one curve below, so that nobody has to tell curves apart by their colours.
void show_plot(const Panel::Plot& plot, double now_s) {
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
    const double share = std::clamp(double(columns[i]) / top, 0.0, 1.0);
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
    text(
        fmt::format("{:.1f} frames a second, {:.2f} M cached", panel.frames_a_second(), double(f.points_cached) / 1e6));
  for (const auto& plot : panel.plots()) {
    if (panel.means_something(plot)) show_plot(plot, now_s);
  }
}

void show_coupling(Panel& panel) {
  CouplingState state = panel.coupling();
  row("coupling");
  if (begin_list("coupling", coupling_name(state.mode))) {
    for (const auto mode : {CouplingMode::kAsync, CouplingMode::kSync, CouplingMode::kLoose})
      if (choice("coupling", coupling_name(mode), mode == state.mode))
        panel.choose_coupling(coupling_state(mode, std::max(3, state.buffers)));
    ImGui::EndCombo();
  }
  hint(
      "async: the display never waits; sync: each frame waits for its own view update; loose: for the next of several");
  if (state.mode == CouplingMode::kLoose) {
    row("buffers");
    if (seen("slider", "buffers",
             ImGui::SliderInt("##buffers", &state.buffers, 1, int(wire::kMaxBuffers), "%d",
                              ImGuiSliderFlags_AlwaysClamp)))
      panel.choose_coupling(state);
  }
  if (panel.coupling_pending()) ImGui::TextDisabled("  not in force yet");
}

void show_background(Panel& panel, Look& look, bool& changed) {
  if (panel.setup().transparent) return;
  const uint32_t now = look.background;
  float colour[3] = {float(now >> 16 & 255) / 255, float(now >> 8 & 255) / 255, float(now & 255) / 255};
  row("background");
  if (seen("colour", "background", ImGui::ColorEdit3("##background", colour, ImGuiColorEditFlags_NoInputs))) {
    const auto byte = [](float v) { return uint32_t(std::clamp(v, 0.0f, 1.0f) * 255 + 0.5f); };
    look.background = byte(colour[0]) << 16 | byte(colour[1]) << 8 | byte(colour[2]);
    changed = true;
  }
  for (const auto& [name, value] : kBackgrounds) {
    ImGui::SameLine();
    if (!small_button(name)) continue;
    look.background = value;
    changed = true;
  }
}

void show_points_look(Look& look, double detail, bool& changed) {
  row("splats");
  if (begin_list("splats", splat::kernel_name(look.render.kernel).data())) {
    for (const auto kernel : splat::kKernels)
      if (choice("splats", splat::kernel_name(kernel).data(), kernel == look.render.kernel))
        look.render.kernel = kernel, changed = true;
    ImGui::EndCombo();
  }
  row("finish");
  changed |= checkbox("fill", &look.render.finish.fill);
  hint("pixels inside a surface that show nothing, or something farther, are filled");
  ImGui::SameLine();
  changed |= checkbox("smooth", &look.render.finish.smooth);
  hint("interpolates between magnified splats of one surface");
  ImGui::SameLine();
  changed |= checkbox("antialias", &look.render.finish.antialias);
  hint("silhouettes; and still pictures become finer only with it");
  row("detail");
  float most = float(look.most_detail);
  const std::string shown = fmt::format("at most %.2f, now {:.2f}", detail);
  if (seen("slider", "detail",
           ImGui::SliderFloat("##detail", &most, float(Look::kLeastDetail), 1, shown.c_str(),
                              ImGuiSliderFlags_AlwaysClamp)))
    look.most_detail = double(most), changed = true;
  hint("points drawn on each axis for a sample or a display pixel; less is coarser and faster");
  row("light");
  const int light = !look.lit ? 2 : look.head_light ? 1 : 0;
  for (const auto& [index, name] : {std::pair{0, "lit"}, {1, "head"}, {2, "unlit"}}) {
    if (index > 0) ImGui::SameLine();
    if (!radio_button(name, light == index)) continue;
    look.lit = index != 2;
    if (look.lit) look.head_light = index == 1;
    changed = true;
  }
  hint("lit: a light from the upper left and the head's; head: the head's alone; unlit: colours as they are");
}

void show_display(Panel& panel) {
  show_coupling(panel);
  Look look = panel.look();
  bool changed = false;
  if (panel.pipeline() == scene::Pipeline::kPoints) show_points_look(look, panel.figures().detail, changed);
  show_background(panel, look, changed);
  if (changed) panel.choose_look(look);
}

void show_sampling(Panel& panel) {
  const auto& f = panel.figures();
  SamplingWish wish = panel.sampling();
  const auto name = [](int width, int height) { return fmt::format("{} x {}", width, height); };
  row("size");
  if (begin_list("size", wish.adaptive ? "auto" : name(wish.width, wish.height).c_str())) {
    if (choice("size", "auto", wish.adaptive)) wish.adaptive = true;
    for (const auto& [width, height] : kSizes)
      if (choice("size", name(width, height), !wish.adaptive && wish.width == width && wish.height == height))
        wish.adaptive = false, wish.width = width, wish.height = height;
    ImGui::EndCombo();
  }
  hint("auto: as fine as view updates in time allow; else so many pixels, in the window's shape");
  if (wish.adaptive) {
    row("at least");
    float least = float(wish.least_sampling);
    if (seen("slider", "at least",
             ImGui::SliderFloat("##least", &least, 0.1f, 1, "%.2f of a pixel", ImGuiSliderFlags_AlwaysClamp)))
      wish.least_sampling = double(least);
    hint("sampled pixels a displayed pixel, on each axis");
  }
  row("now");
  text(f.sampled_width > 0 ? name(f.sampled_width, f.sampled_height) : "-");
  panel.choose_sampling(wish);
}

// Buttons are keys: both do the same.
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
    state.picture.width = std::clamp(size[0], 0, geometry::kMaxImageSide);
    state.picture.height = std::clamp(size[1], 0, geometry::kMaxImageSide);
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
    text(panel.figures().scene.empty() ? "Telesplat" : panel.figures().scene);
    ImGui::TextDisabled("Tab hides this, F1 lists keys");
    for (const auto& line : panel.news(now_s)) ImGui::TextWrapped("%s", line.c_str());
    if (panel.setup().opens && button("open ...")) panel.press(Key::kO);
    if (section("Figures", true)) show_figures(panel, now_s);
    if (section("Display", true)) show_display(panel);
    if (section("Sampling", true)) show_sampling(panel);
    for (const auto& show : more) show(panel);
    if (section("Pictures and paths", false)) show_pictures(panel, state);
    if (section("Session", false)) show_session(panel);
    if (section("Messages", true)) show_messages(panel);
  }
  ImGui::End();
  return double(width);
}

// What stands in the first column ends where two blanks are.
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
