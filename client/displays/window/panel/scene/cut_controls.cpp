#include "client/displays/window/panel/scene/cut_controls.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/core/within.h"
#include "common/scene/session.h"

namespace telesplat::viewer {
namespace {

constexpr double kLeastKept = 1;  // per cent

}  // namespace

void CutControls::on_session(double now_s, const wire::Welcome& session) {
  const scene::SessionView view(session);
  placement_ = {};
  if (const std::string text = view.fact(scene::kPlacementFact); !text.empty())
    if (auto read = scene::placement_from_text(text)) placement_ = *std::move(read);
  order_ = view.fact(scene::kClipOrderFact);
  if (wished_ && (now_s - wished_->since_s > kPatience_s || wished_->order == order_)) wished_.reset();
}

std::array<CutControls::Kept, 3> CutControls::kept() const {
  std::array<Kept, 3> out;
  const auto parsed = scene::parse_clip(order());
  if (!parsed || !knows_box()) return out;
  for (const auto& plane : parsed->planes)
    for (int axis = 0; axis < 3; ++axis) {
      glm::dvec3 across(0.0);
      across[axis] = plane.normal[axis];
      if (across != plane.normal || plane.normal[axis] == 0) continue;
      const double lo = placement_.box_data.lo[axis], extent = placement_.box_data.hi[axis] - lo;
      const double at = plane.value / plane.normal[axis];
      const double share = plane.percent || !(extent > 0) ? at : (at - lo) / extent * 100;
      auto& end = plane.normal[axis] > 0 ? out[size_t(axis)].from : out[size_t(axis)].to;
      end = within(share, 0.0, 100.0);
    }
  return out;
}

double CutControls::value(int axis, double percent) const {
  const auto& box = placement_.box_data;
  return box.empty() ? percent : box.lo[axis] + (box.hi[axis] - box.lo[axis]) * percent / 100;
}

void CutControls::keep(double now_s, int axis, Kept wanted) {
  if (!std::isfinite(wanted.from) || !std::isfinite(wanted.to)) return;
  auto all = kept();
  wanted.from = within(wanted.from, 0.0, 100 - kLeastKept);
  wanted.to = within(wanted.to, wanted.from + kLeastKept, 100.0);
  all[size_t(axis)] = wanted;
  std::string text;
  for (int a = 0; a < 3; ++a) {
    const Kept& k = all[size_t(a)];
    if (k.from > 0) text += fmt::format("{}plane {}>={:.5g}%", text.empty() ? "" : "; ", "xyz"[a], k.from);
    if (k.to < 100) text += fmt::format("{}plane {}<={:.5g}%", text.empty() ? "" : "; ", "xyz"[a], k.to);
  }
  if (text == order()) return;
  if (const Status s = give(now_s, text.empty() ? "off" : text); !s) return;
}

Status CutControls::give(double now_s, const std::string& order) {
  if (const auto parsed = scene::parse_clip(order); !parsed) return parsed.error();
  wished_ = {order == "off" ? "" : order, now_s};
  give_({"clip", {{"clip", order}}, "clip"});
  return ok_status();
}

}  // namespace telesplat::viewer
