#include "client/displays/window/panel/scene/colour_controls.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "common/scene/session.h"

namespace telesplat::viewer {
namespace {

std::vector<std::string> names_of(const std::vector<scene::ArrayInfo>& infos) {
  std::vector<std::string> out;
  for (const auto& info : infos) {
    out.push_back(info.name);
    for (int c = 0; info.components > 1 && c < std::min(info.components, scene::kMaxComponents); ++c)
      out.push_back(info.components <= 3 ? fmt::format("{}.{}", info.name, "xyz"[c])
                                         : fmt::format("{}[{}]", info.name, c));
  }
  return out;
}

}  // namespace

void ColourControls::on_session(double now_s, const wire::Welcome& session) {
  const scene::SessionView view(session);
  if (const std::string text = view.fact(scene::kArraysFact); text != infos_text_) {
    infos_text_ = text;
    auto read = scene::arrays_from_text(text);
    infos_ = read ? *std::move(read) : std::vector<scene::ArrayInfo>();
    arrays_ = names_of(infos_);
  }
  const auto before = std::exchange(colouring_, std::nullopt);
  if (const std::string text = view.fact(scene::kColouringFact); !text.empty())
    if (auto read = scene::colouring_from_text(text)) colouring_ = *std::move(read);
  if (wished_ &&
      (now_s - wished_->since_s > kPatience_s || !colouring_ || !before || before->array != colouring_->array ||
       (colouring_->lo == wished_->lo && colouring_->hi == wished_->hi)))
    wished_.reset();
  iso_.reset();
  iso_range_ = {};
  double value = 0;
  if (std::sscanf(view.fact(scene::kIsoFact).c_str(), "%lf %lf %lf", &value, &iso_range_.lo, &iso_range_.hi) >= 1 &&
      std::abs(value) <= scene::kMaxScalar)
    iso_ = value;
  if (!(iso_range_.lo >= -scene::kMaxScalar && iso_range_.hi <= scene::kMaxScalar)) iso_range_ = {};
  histogram_.reset();
  if (const std::string text = iso_ ? view.fact(volume::kHistogramFact) : ""; !text.empty())
    if (auto read = volume::histogram_from_text(text)) histogram_ = *std::move(read);
}

std::pair<double, double> ColourControls::range() const {
  if (wished_) return {wished_->lo, wished_->hi};
  return colouring_ ? std::pair(colouring_->lo, colouring_->hi) : std::pair(0.0, 1.0);
}

scene::ValueSpan ColourControls::whole_range() const {
  if (!colouring_) return {};
  const auto choice = scene::choose_array(infos_, colouring_->array);
  return choice ? scene::span_of(infos_, *choice) : scene::ValueSpan{};
}

void ColourControls::choose_array(const std::string& name) {
  wished_.reset();
  give_({"colour", {{"array", name}}, "array"});
}

void ColourControls::choose_range(double now_s, double lo, double hi) {
  if (!colouring_ || !(lo < hi && lo >= -scene::kMaxScalar && hi <= scene::kMaxScalar)) return;
  if (std::pair(lo, hi) == range()) return;
  wished_ = {lo, hi, now_s};
  give_({"colour", {{"array", fmt::format("{}:{}:{}", colouring_->array, lo, hi)}}, "array"});
}

void ColourControls::reset_range() {
  if (colouring_) choose_array(colouring_->array);
}

void ColourControls::choose_map(const colour::ColourMap& map) {
  give_({"colour", {{"map", colour::to_text(map)}}, "map"});
}

std::vector<HistogramBar> ColourControls::iso_bars() const {
  if (!histogram_ || !(iso_range_.lo < iso_range_.hi)) return {};
  return bars_of(*histogram_, iso_range_.lo, iso_range_.hi, true);
}

void ColourControls::choose_iso(double value) {
  if (iso_ && std::isfinite(value) && value != *iso_) give_({"iso", {{"value", fmt::format("{}", value)}}, "iso"});
}

}  // namespace telesplat::viewer
