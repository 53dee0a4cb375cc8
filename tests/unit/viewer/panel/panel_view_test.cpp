// The panel as it is drawn, without a window: a hand that clicks, drags and types everywhere orders nothing wrong.
#include "client/viewer/panel/gui/panel_view.h"

#include <gtest/gtest.h>
#include <imgui.h>

#include <cmath>
#include <random>
#include <set>

#include "client/viewer/panel/gui/scene_view.h"
#include "client/viewer/panel/gui/style.h"
#include "client/viewer/panel/gui/widgets.h"

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
  if (kind != scene::Kind::kVolume) return w;
  const auto s = volume_session();
  w.facts.merge(volume::to_facts(s));
  w.facts[volume::kHistogramFact] = "-1000:3000:5,0,100000,700,9,0,3";
  w.parameters = volume::to_parameters(s);
  return w;
}

class PanelView : public testing::TestWithParam<scene::Kind> {
 protected:
  PanelView() : panel_({.look = {}, .sampling = {}, .viewer = "viewer-1", .shown = true, .opens = true}) {
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
    welcome_ = session_of(GetParam());
    controls_.on_session(0, welcome_);
  }
  ~PanelView() override { ImGui::DestroyContext(context_); }

  void frame() {
    now_s_ += 1 / 60.0;
    panel_.on_figures({.now_s = now_s_,
                       .frames = uint64_t(now_s_ * 60),
                       .updates = uint64_t(now_s_ * 5),
                       .inter_frame_ms = 16 + std::sin(now_s_),
                       .latency_ms = 90,
                       .points_drawn = 100'000,
                       .hole_share = 0.01,
                       .scene = "a scene"});
    ImGui::NewFrame();
    show_panel(panel_, view_, now_s_,
               {[&](Panel&) { show_scene(controls_, scene_view_, now_s_, [this] { ++saved_; }); }});
    ImGui::Render();
    for (auto& order : panel_.take_orders()) check(order);
    if (const auto look = panel_.take_look()) {
      EXPECT_GE(look->most_detail, Look::kLeastDetail);
      EXPECT_LE(look->background, 0xffffffu);
      ++looks_;
    }
    if (const auto wish = panel_.take_sampling()) {
      EXPECT_TRUE(wish->adaptive || (wish->width >= 16 && wish->height >= 16));
      EXPECT_TRUE(wish->least_sampling >= 0.1 && wish->least_sampling <= 1) << wish->least_sampling;
      ++samplings_;
    }
    if (const auto wish = panel_.take_picture()) {
      EXPECT_TRUE(wish->width >= 0 && wish->width <= geometry::kMaxImageSide);
      EXPECT_TRUE(wish->height >= 0 && wish->height <= geometry::kMaxImageSide);
    }
    panel_.take_pressed();
  }

  // As the master would read it. A slice that misses the set is its to refuse.
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
  int saved_ = 0, looks_ = 0, samplings_ = 0;
  std::set<std::string> orders_;
};

TEST_P(PanelView, AHandThatClicksEverywhereOrdersNothingWrong) {
  std::mt19937 random(7);
  const auto number = [&](int below) { return int(random() % unsigned(below)); };
  ImGuiIO& io = ImGui::GetIO();
  frame();
  for (int i = 0; i < 2500; ++i) {
    // A list that a click opened lies below it.
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
  EXPECT_GT(looks_, 0);
  EXPECT_TRUE(orders_.contains("coupling"));
  if (GetParam() == scene::Kind::kVolume) EXPECT_TRUE(orders_.contains("tf"));
  if (GetParam() == scene::Kind::kJulia) EXPECT_TRUE(orders_.contains("set"));
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

// A function may end within the data, or lie beside them; bars of the histogram then lie beside the plot.
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

INSTANTIATE_TEST_SUITE_P(Kinds, PanelView, testing::ValuesIn(scene::kKinds),
                         [](const auto& info) { return std::string(scene::name_of(info.param)); });

}  // namespace
}  // namespace telesplat::viewer
