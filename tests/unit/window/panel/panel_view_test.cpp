// The panel drawn without a window: clicks, drags and typing everywhere never give an invalid order.
#include "client/displays/window/panel/gui/panel_view.h"

#include <gtest/gtest.h>
#include <imgui.h>

#include <cmath>
#include <random>
#include <set>

#include "client/displays/window/panel/gui/notes_view.h"
#include "client/displays/window/panel/gui/scene_view.h"
#include "client/displays/window/panel/gui/style.h"
#include "client/displays/window/panel/gui/widgets.h"
#include "client/displays/window/view_settings.h"
#include "common/scene/settings.h"

namespace telesplat::viewer {
namespace {

volume::Session volume_session() {
  volume::Session s;
  s.grid.size = {16, 16, 16};
  s.range = {.lo = -1000, .hi = 3000, .typical_lo = 20, .typical_hi = 800};
  s.steps = 7;
  s.transfer = *volume::transfer_preset("plain", s.range);
  return s;
}

wire::Welcome session_of(scene::Kind kind) {
  wire::Welcome w;
  w.facts["kind"] = std::string(scene::name_of(kind));
  if (kind == scene::Kind::kJulia) w.parameters = julia::to_map(julia::presets()[0].parameters);
  if (kind == scene::Kind::kMesh) {
    const std::vector<scene::ArrayInfo> arrays{{.name = "heat", .spans = {{-3, 5}}},
                                               {.name = "age", .spans = {{0, 1}}}};
    w.facts[scene::kArraysFact] = scene::to_text(arrays);
    w.facts[scene::kColouringFact] =
        scene::to_text(*scene::make_colouring(arrays, {"heat"}, *colour::find_colour_map("viridis")));
  }
  w.facts[scene::kPlacementFact] = scene::to_text(
      scene::placement_of(glm::dmat3(1.0), {{0, 0, 0}, {2, 1, 1}}, {{-1, -0.5f, -0.5f}, {1, 0.5f, 0.5f}}));
  if (kind != scene::Kind::kVolume) return w;
  const auto s = volume_session();
  w.facts.merge(volume::to_facts(s));
  w.facts[volume::kHistogramFact] = "-1000:3000:5,0,100000,700,9,0,3";
  w.parameters = volume::to_parameters(s);
  return w;
}

class PanelView : public testing::TestWithParam<scene::Kind> {
 protected:
  PanelView() : panel_({.viewer = "viewer-1", .shown = true, .opens = true}) {
    context_ = ImGui::CreateContext();
    ImGuiIO& io = ImGui::GetIO();
    io.IniFilename = nullptr;
    io.DisplaySize = {1280, 1400};
    io.DeltaTime = 1 / 60.0f;
    GuiStyle().fit(1, 1);
    unsigned char* pixels = nullptr;
    int width = 0, height = 0;
    io.Fonts->GetTexDataAsAlpha8(&pixels, &width, &height);
    panel_.on_scene(scene::pipeline_of(GetParam()));
    panel_.on_kind(GetParam());
    settings_.sampling = {.adaptive = true};
    welcome_ = session_of(GetParam());
    controls_.on_session(0, welcome_);
  }
  ~PanelView() override { ImGui::DestroyContext(context_); }

  void frame() {
    now_s_ += 1 / 60.0;
    panel_.on_figures({.now_s = now_s_,
                       .frames = uint64_t(now_s_ * 60),
                       .frame = {.previous_s = 1,
                                 .end_s = 1.016 + 1e-3 * std::sin(now_s_),
                                 .drawn = {.drawn = 100'000},
                                 .coupling = coupling_},
                       .session = {.scene = "a scene", .updates = uint64_t(now_s_ * 5), .latency_ms = 90}});
    ImGui::NewFrame();
    show_panel(panel_, view_, now_s_, {[&](Panel&) {
                 show_scene(controls_, scene_view_, now_s_, [this] { ++saved_; });
                 notes_ = show_notes(&book_, notes_view_, true, now_s_);
               }});
    ImGui::Render();
    for (auto& order : panel_.take_orders()) check(order);
    for (const auto& [name, value] : panel_.take_chosen()) {
      ++chosen_;
      if (overlays_.contains(name)) {
        EXPECT_TRUE(value == "on" || value == "off") << name << " " << value;
        overlays_[name] = value;
      } else if (const Status s = change(settings_, name, value); !s) {
        // These two values need devices that the window was started with.
        EXPECT_TRUE(name == "stereo" && (value == "autostereo" || value == "quad-buffer")) << s.error().text;
      }
    }
    auto values = values_of(settings_);
    values.insert(overlays_.begin(), overlays_.end());
    panel_.on_values(std::move(values));
    if (const auto wish = panel_.take_picture()) {
      EXPECT_TRUE(wish->width >= 0 && wish->width <= geometry::kMaxImageSide);
      EXPECT_TRUE(wish->height >= 0 && wish->height <= geometry::kMaxImageSide);
    }
    panel_.take_pressed();
  }

  // Checks an order as the master reads it, except for slices that miss the set, which the master refuses.
  void check(const Order& order) {
    orders_.insert(order.command);
    if (order.command == "tf") {
      const std::string& text = order.arguments.at("transfer");
      const auto range = volume_session().range;
      EXPECT_TRUE(volume::transfer_preset(text, range) || volume::parse_transfer(text, range)) << text;
      EXPECT_LE(text.size(), volume::kMaxTransferText);
    } else if (order.command == "set") {
      for (const auto& [name, value] : order.arguments) {
        julia::Parameters p = julia::presets()[0].parameters;
        if (name.starts_with("volume."))
          EXPECT_EQ(GetParam(), scene::Kind::kVolume);
        else
          EXPECT_TRUE(julia::set(p, name, std::stod(value))) << name << " " << value;
      }
    } else if (order.command == "animate") {
      const std::string& text = order.arguments.at("timeline");
      EXPECT_TRUE(text == "on" || text == "off" || julia::parse_timeline(text)) << text;
    } else if (order.command == "colour") {
      if (order.arguments.contains("array")) EXPECT_TRUE(scene::parse_colour_by(order.arguments.at("array")));
      if (order.arguments.contains("map")) EXPECT_TRUE(colour::from_text(order.arguments.at("map")));
    } else if (order.command == "clip") {
      EXPECT_TRUE(scene::parse_clip(order.arguments.at("clip"))) << order.arguments.at("clip");
    } else if (const auto* setting = scene::setting_of_order(order.command);
               setting && setting->keeper == scene::Keeper::kLauncher) {
      EXPECT_FALSE(order.arguments.at("value").empty());
    } else {
      EXPECT_EQ(order.command, "coupling");
      EXPECT_EQ(order.arguments.at("viewer"), "viewer-1");
    }
  }

  ImGuiContext* context_ = nullptr;
  Panel panel_;
  PanelViewState view_;
  SceneControls controls_{[this](Order o) { panel_.order(std::move(o)); }};
  SceneViewState scene_view_;
  wire::Welcome welcome_;
  double now_s_ = 1;
  CouplingState coupling_;
  ViewSettings settings_;
  std::map<std::string, std::string> overlays_{{"axes", "off"}, {"scale", "off"}, {"cursor", "off"}, {"fps", "off"}};
  notes::Book book_{{{"a view", {}, ""}}, {{1, "a note", glm::dvec3(1, 2, 3), "", ""}}};
  NotesViewState notes_view_;
  NotesWish notes_;
  int saved_ = 0, chosen_ = 0;
  std::set<std::string> orders_;
};

TEST_P(PanelView, AHandThatClicksEverywhereOrdersNothingWrong) {
  std::mt19937 random(7);
  const auto number = [&](int below) { return int(random() % unsigned(below)); };
  ImGuiIO& io = ImGui::GetIO();
  frame();
  for (int i = 0; i < 2500; ++i) {
    // A list that a click opened lies below the pointer.
    if (number(2) == 0)
      io.MousePos = {float(number(380)), float(number(1400))};
    else
      io.MousePos = {io.MousePos.x, io.MousePos.y + float(10 + number(60))};
    frame();
    const int button = number(8) == 0 ? 1 : 0;
    for (int press = 0; press < 1 + number(2); ++press) {
      io.MouseDown[button] = true;
      frame();
      if (number(3) == 0) io.MousePos = {float(number(400)), io.MousePos.y + float(number(40) - 20)};
      frame();
      io.MouseDown[button] = false;
      frame();
    }
    if (number(10) == 0) io.MouseWheel = float(number(9) - 4);
    if (number(10) == 0) io.AddInputCharactersUTF8("9e9");
    if (number(40) == 0) controls_.on_session(now_s_, welcome_);
  }
  EXPECT_GT(chosen_, 0);
  EXPECT_FALSE(orders_.empty());
  if (GetParam() == scene::Kind::kVolume) EXPECT_TRUE(orders_.contains("tf"));
  if (GetParam() == scene::Kind::kJulia) EXPECT_TRUE(orders_.contains("set"));
}

// All sections are opened; settings for isosurfaces and for loose coupling get these.
TEST_P(PanelView, HasEverySettingOfItsKind) {
  WidgetLog log("widgets-of-no-folder/list");
  ImGuiIO& io = ImGui::GetIO();
  io.DisplaySize = {1280, 6000};
  const auto logged_frame = [&] {
    const LoggedBuild logged(log);
    frame();
  };
  const auto look_at_all = [&] {
    for (const char* section : {"Light", "Over the picture", "Sampling", "Samplers", "Stereo", "Data", "Cut",
                                "Bookmarks and notes", "Pictures and paths", "Colours", "Isosurface"}) {
      logged_frame();
      const auto found = log.widgets().find("panel/" + std::string(section));
      if (found == log.widgets().end() || !found->second.here) continue;
      const auto rect = found->second.rect;
      io.MousePos = {(rect.left + rect.right) / 2, (rect.top + rect.bottom) / 2};
      const float before = ImGui::GetIO().DisplaySize.y;
      for (const bool down : {false, true, false, false}) {
        io.MouseDown[0] = down;
        logged_frame();
      }
      EXPECT_EQ(before, ImGui::GetIO().DisplaySize.y);
    }
  };
  panel_.on_figures({.now_s = now_s_, .frame = {.coupling = coupling_state(CouplingMode::kLoose, 3)}});
  coupling_ = coupling_state(CouplingMode::kLoose, 3);
  look_at_all();
  if (GetParam() == scene::Kind::kMesh) {
    welcome_.facts[scene::kIsoFact] = "3 0 10";
    controls_.on_session(now_s_, welcome_);
    logged_frame();
    logged_frame();
  }
  for (const auto& setting : scene::settings()) {
    if (!setting.kinds.has(GetParam())) continue;
    const bool elsewhere = setting.widget.find('/') != setting.widget.npos;
    const std::string widget(setting.widget.empty() ? setting.name : setting.widget);
    const std::string whole = elsewhere ? widget : std::string(setting.section) + "/" + widget;
    EXPECT_TRUE(log.widgets().contains(whole)) << "the panel has no " << whole;
  }
  if (GetParam() == scene::Kind::kJulia)
    for (const auto& info : julia::parameter_infos())
      if (info.animates) EXPECT_TRUE(log.widgets().contains("Parameters/" + std::string(info.name))) << info.name;
}

TEST_P(PanelView, TheLogHasItsWidgetsWhereTheyAreAndCountsTheirUse) {
  WidgetLog log("widgets-of-no-folder/list");
  ImGuiIO& io = ImGui::GetIO();
  const auto logged_frame = [&] {
    const LoggedBuild logged(log);
    frame();
  };
  for (int i = 0; i < 3; ++i) logged_frame();
  ASSERT_TRUE(log.widgets().contains("Display/coupling"));
  EXPECT_TRUE(log.widgets().find("panel/Display")->second.reachable);
  const auto rect = log.widgets().find("Display/coupling")->second.rect;
  io.MousePos = {(rect.left + rect.right) / 2, (rect.top + rect.bottom) / 2};
  for (const bool down : {false, true, false, false}) {
    io.MouseDown[0] = down;
    logged_frame();
  }
  EXPECT_EQ(log.widgets().find("Display/coupling")->second.uses, 1u);
  EXPECT_TRUE(log.widgets().find("Display/coupling=sync")->second.reachable);
  EXPECT_EQ(log.widgets().contains("Transfer function/curve"), GetParam() == scene::Kind::kVolume);
  frame();
  EXPECT_EQ(LoggedBuild::log(), nullptr);
}

// A function may end within the data's range or lie beside it; bars of the histogram then lie beside the plot.
TEST_P(PanelView, DrawsAnyTransferFunctionOverAnyHistogram) {
  if (GetParam() != scene::Kind::kVolume) GTEST_SKIP() << "other data have no transfer function";
  std::vector<std::string> functions;
  for (const auto& preset : volume::transfer_presets()) functions.emplace_back(preset.name);
  for (const char* points :
       {"-1000:#000000:0, 2999:#ffffff:0.5", "-1000:#000000:0, 3000:#ffffff:0.5", "0:#000000:0, 1:#ffffff:0.5",
        "5:#000000:0, 5:#ffffff:0.5", "-9000:#000000:0, -8000:#ffffff:1", "9e3:#000000:0, 1e30:#ffffff:1",
        "-1e30:#000000:0, 1e30:#ffffff:1", "700:#ffffff:0.5", "20%:#603010:0, 45%:#a07040:0.05, 70%:#40a040:0.4"})
    functions.emplace_back(points);
  const volume::ValueRange ranges[] = {volume_session().range,
                                       {.lo = 7, .hi = 7, .typical_lo = 7, .typical_hi = 7},
                                       {.lo = -9.2e18, .hi = 9.2e18, .typical_lo = 0, .typical_hi = 1}};
  for (const char* histogram : {"-1000:3000:5,0,100000,700,9,0,3", "-1e30:1e30:1,2,3", "0:1e-30:7,9",
                                "400:400.001:1,1,1,1", "-1000:3000:0,0", "2900:9000:4,5,6"}) {
    welcome_.facts[volume::kHistogramFact] = histogram;
    for (size_t i = 0; i < functions.size() * std::size(ranges); ++i) {
      const std::string& text = functions[i / std::size(ranges)];
      auto s = volume_session();
      s.range = ranges[i % std::size(ranges)];
      auto transfer = volume::resolve_transfer(text, s.range);
      ASSERT_TRUE(transfer) << text << ": " << transfer.error().text;
      s.transfer = *transfer;
      welcome_.parameters = volume::to_parameters(s);
      for (const auto& [name, fact] : volume::to_facts(s)) welcome_.facts[name] = fact;
      controls_.on_session(now_s_ += 10, welcome_);
      ASSERT_EQ(controls_.transfer().transfer(), *transfer) << text;
      ImGui::GetIO().MousePos = {200, 700};
      frame();
    }
  }
  EXPECT_TRUE(orders_.empty());
}

TEST_P(PanelView, DrawsAnyIsosurface) {
  if (GetParam() != scene::Kind::kMesh) GTEST_SKIP() << "other data have no isosurface";
  ImGui::GetIO().DisplaySize = {1280, 6000};
  for (const char* iso :
       {"3 0 10", "3 -1.7e308 1.7e308", "1.7e308 0 1", "nan 0 1", "5 5 5", "3 10 0", "3 nan inf", "3"})
    for (const char* histogram : {"0:10:4,0,9", "-1e30:1e30:1,2,3", "0:10:0,0", "none"}) {
      welcome_.facts[scene::kIsoFact] = iso;
      welcome_.facts[volume::kHistogramFact] = histogram;
      controls_.on_session(now_s_ += 10, welcome_);
      frame();
    }
  EXPECT_TRUE(orders_.empty());
}

INSTANTIATE_TEST_SUITE_P(Kinds, PanelView, testing::ValuesIn(scene::kKinds),
                         [](const auto& info) { return std::string(scene::name_of(info.param)); });

}  // namespace
}  // namespace telesplat::viewer
