#include "client/displays/window/panel/gui/panel_gui.h"

#include <algorithm>
#include <utility>

#include "common/core/within.h"

namespace telesplat::viewer {
namespace {

// Returns the largest scale at which the keys fit into the window.
int help_scale(const std::vector<std::string>& lines, int width, int height) {
  const image::View smallest = text_panel(lines, 1);
  return within(std::min(width / (smallest.width + 12), height / (2 * smallest.height)), 1, 4);
}

}  // namespace

double PanelGui::build(double now_s, const std::function<void()>& save, const std::function<void()>& more) {
  if (!panel_.shown()) return 0;
  return show_panel(panel_, view_, now_s, {[&](Panel&) {
                      show_scene(scene_, scene_view_, now_s, save);
                      more();
                    }});
}

void PanelGui::show_news(double now_s, int scale) {
  auto news = panel_.shown() ? std::vector<std::string>() : panel_.news(now_s);
  if (news == news_) return;
  news_ = std::move(news);
  if (news_.empty()) return overlays_.hide("news");
  overlays_.show("news", {text_panel(news_, scale), Overlay::Corner::kUpperRight});
}

void PanelGui::show_help(const std::vector<std::string>& keys, int width, int height) {
  const int scale = keys.empty() ? 0 : help_scale(keys, width, height);
  if (scale == help_scale_) return;
  help_scale_ = scale;
  overlays_.show("help", {scale > 0 ? text_panel(keys, scale) : image::View(), Overlay::Corner::kUpperLeft});
}

}  // namespace telesplat::viewer
