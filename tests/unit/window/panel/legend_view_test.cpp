// The legend over a window, drawn without a window: its place, moving it, changing its range.
#include "client/displays/window/panel/gui/legend_view.h"

#include <gtest/gtest.h>
#include <imgui.h>

#include <optional>
#include <utility>

#include "client/displays/window/panel/gui/style.h"
#include "client/displays/window/panel/gui/widgets.h"

namespace telesplat::viewer {
namespace {

class LegendView : public testing::Test {
 protected:
  LegendView() {
    context_ = ImGui::CreateContext();
    ImGuiIO& io = ImGui::GetIO();
    io.IniFilename = nullptr;
    io.DisplaySize = {1280, 800};
    io.DeltaTime = 1 / 60.0f;
    GuiStyle().fit(1, 1);
    unsigned char* pixels = nullptr;
    int width = 0, height = 0;
    io.Fonts->GetTexDataAsAlpha8(&pixels, &width, &height);
    legend_ = {.title = "temperature (K)", .lo = 280, .hi = 320, .map = *colour::find_colour_map("viridis")};
    for (int i = 0; i < 3; ++i) frame();
  }
  ~LegendView() override { ImGui::DestroyContext(context_); }

  void frame() {
    const LoggedBuild logged(log_);
    ImGui::NewFrame();
    const auto change = [this](double lo, double hi) { range_ = {lo, hi}; };
    part_ = show_legend(legend_, state_, 0, editable_ ? change : std::function<void(double, double)>());
    ImGui::Render();
  }
  void drag(const ImVec2& from, const ImVec2& by) {
    ImGuiIO& io = ImGui::GetIO();
    io.MousePos = from;
    frame();
    io.MouseDown[0] = true;
    frame();
    for (int i = 1; i <= 4; ++i) {
      io.MousePos = {from.x + by.x * float(i) / 4, from.y + by.y * float(i) / 4};
      frame();
    }
    io.MouseDown[0] = false;
    frame();
    frame();
  }
  ImVec2 middle_of(const std::string& widget) const {
    const auto& r = log_.widgets().find(widget)->second.rect;
    return {(r.left + r.right) / 2, (r.top + r.bottom) / 2};
  }
  double left() const { return part_.left * 1280; }
  double right() const { return part_.right * 1280; }

  ImGuiContext* context_ = nullptr;
  WidgetLog log_{"widgets-of-no-folder/list"};
  image::Legend legend_;
  LegendViewState state_;
  bool editable_ = true;
  WindowPart part_;
  std::optional<std::pair<double, double>> range_;
};

TEST_F(LegendView, LiesInTheLowerRightCornerOfAnyWindow) {
  for (const auto& [width, height] : {std::pair{1280.0f, 800.0f}, {300.0f, 200.0f}, {700.0f, 900.0f}}) {
    ImGui::GetIO().DisplaySize = {width, height};
    for (int i = 0; i < 3; ++i) frame();
    EXPECT_NEAR(part_.right * width, width - 0.7 * ImGui::GetFontSize(), 2) << width;
    EXPECT_NEAR(part_.bottom * height, height - 0.7 * ImGui::GetFontSize(), 2) << width;
    EXPECT_GT(part_.left, 0.5) << "less than half of a window";
  }
}

TEST_F(LegendView, IsDraggedElsewhereAndKeepsItsDistanceFromTheCorner) {
  const double before = left();
  // Drags it by its title.
  drag({float(left() + 20), float(part_.top * 800 + 12)}, {-900, -300});
  EXPECT_NEAR(left(), before - 900, 2);
  const double at = left();
  ImGui::GetIO().DisplaySize = {1600, 800};
  frame();
  frame();
  EXPECT_NEAR(part_.left * 1600, at, 2) << "it is nearer to the left side";
  EXPECT_FALSE(range_);
}

TEST_F(LegendView, ADragOnTheBarMovesTheEndThatIsNearer) {
  const ImVec2 middle = middle_of("legend/range");
  drag({middle.x, middle.y - 80}, {0, -32});
  ASSERT_TRUE(range_);
  EXPECT_EQ(range_->first, 280);
  EXPECT_LT(range_->second, 320) << "the colours follow the pointer: what was below the end moves up to it";
  range_.reset();
  drag({middle.x, middle.y + 80}, {0, 32});
  ASSERT_TRUE(range_);
  EXPECT_GT(range_->first, 280);
  EXPECT_EQ(range_->second, 320);
}

TEST_F(LegendView, ADoubleClickOpensFieldsForTheRange) {
  ImGuiIO& io = ImGui::GetIO();
  io.MousePos = middle_of("legend/range");
  frame();
  for (const bool down : {true, false, true, false}) {
    io.MouseDown[0] = down;
    frame();
  }
  frame();
  ASSERT_TRUE(log_.widgets().contains("legend/to"));
  range_.reset();
  io.MousePos = middle_of("legend/set");
  for (const bool down : {false, true, false, false}) {
    io.MouseDown[0] = down;
    frame();
  }
  EXPECT_EQ(range_, (std::pair{280.0, 320.0}));
  EXPECT_FALSE(log_.widgets().find("legend/set")->second.here) << "they are closed";
}

TEST_F(LegendView, OfATransferFunctionHasNoRangeToChange) {
  editable_ = false;
  legend_.opacity = {0, 0.5f, 1};
  for (int i = 0; i < 3; ++i) frame();
  EXPECT_FALSE(log_.widgets().find("legend/range")->second.here);
  EXPECT_FALSE(part_.empty());
  legend_.lo = legend_.hi = 5;
  frame();
  legend_.lo = -1e308, legend_.hi = 1e308;
  frame();
}

}  // namespace
}  // namespace telesplat::viewer
