#include "client/displays/window/title_line.h"

#include <fmt/format.h>

namespace telesplat::viewer {
namespace {

constexpr double kPeriod_s = 0.5;

}  // namespace

std::optional<std::string> TitleLine::update(const FrameFigures& f) {
  const std::string name = f.session.scene.empty() ? "Telesplat" : f.session.scene;
  const bool news = !last_ || last_->session.scene != f.session.scene || (last_->frames == 0 && f.frames > 0);
  const double dt_s = news ? 0 : f.now_s - last_->now_s;
  if (!news && dt_s < kPeriod_s) return std::nullopt;
  std::string text;
  if (f.waits_s > 0)
    text = fmt::format("{} - waiting for a view update, {:.0f} s", name, f.waits_s);
  else if (f.frames == 0)
    text = fmt::format("{} - {}", name,
                       f.session.scene.empty() ? "waiting for the data set" : "waiting for the first view");
  else if (news)
    text = name;
  else
    text = fmt::format(
        "{} - {:.1f} fps, {:.1f} updates/s, {:.0f} ms latency, {:.2f} M {} drawn, {:.2f} M{} cached, {:.2f} MB/s", name,
        double(f.frames - last_->frames) / dt_s, double(f.session.updates - last_->session.updates) / dt_s,
        f.session.latency_ms, double(f.frame.drawn.drawn) / 1e6, f.units.drawn, double(f.frame.drawn.cached) / 1e6,
        f.units.cached, double(f.session.bytes_received - last_->session.bytes_received) / 1e6 / dt_s);
  if (f.frames > 0 && !news && f.waits_s == 0 && f.session.epochs_shown > last_->session.epochs_shown)
    text += fmt::format(", {:.1f} epochs/s", double(f.session.epochs_shown - last_->session.epochs_shown) / dt_s);
  last_ = f;
  return text;
}

std::optional<std::string> TitleLine::update(const FrameFigures& figures, const PathRecorder& path) {
  if (const auto text = update(figures)) text_ = *text;
  const std::string title =
      path.records() ? fmt::format("{} - recording the camera's path, {:.0f} s", text_, path.length_s()) : text_;
  if (title == shown_) return std::nullopt;
  return shown_ = title;
}

}  // namespace telesplat::viewer
