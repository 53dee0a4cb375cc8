#include "client/displays/window/title_line.h"

#include <fmt/format.h>

namespace telesplat::viewer {
namespace {

constexpr double kPeriod_s = 0.5;

}  // namespace

std::optional<std::string> TitleLine::update(const FrameFigures& f) {
  const std::string name = f.scene.empty() ? "Telesplat" : f.scene;
  const bool news = !last_ || last_->scene != f.scene || (last_->frames == 0 && f.frames > 0);
  const double dt_s = news ? 0 : f.now_s - last_->now_s;
  if (!news && dt_s < kPeriod_s) return std::nullopt;
  std::string text;
  if (f.waits_s > 0)
    text = fmt::format("{} - waiting for a view update, {:.0f} s", name, f.waits_s);
  else if (f.frames == 0)
    text = fmt::format("{} - {}", name, f.scene.empty() ? "waiting for the data set" : "waiting for the first view");
  else if (news)
    text = name;
  else
    text = fmt::format(
        "{} - {:.1f} fps, {:.1f} updates/s, {:.0f} ms latency, {:.2f} M {} drawn, {:.2f} M{} cached, {:.2f} MB/s", name,
        double(f.frames - last_->frames) / dt_s, double(f.updates - last_->updates) / dt_s, f.latency_ms,
        double(f.points_drawn) / 1e6, f.drawn_name, double(f.points_cached) / 1e6, f.cached_name,
        double(f.bytes_received - last_->bytes_received) / 1e6 / dt_s);
  if (f.frames > 0 && !news && f.waits_s == 0 && f.epochs_shown > last_->epochs_shown)
    text += fmt::format(", {:.1f} epochs/s", double(f.epochs_shown - last_->epochs_shown) / dt_s);
  last_ = f;
  return text;
}

}  // namespace telesplat::viewer
