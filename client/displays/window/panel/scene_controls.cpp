#include "client/displays/window/panel/scene_controls.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "common/core/within.h"
#include "common/scene/session.h"

namespace telesplat::viewer {
namespace {

constexpr double kLeastKept = 1;  // per cent

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

constexpr double kSameTime_s = 0.05;

// Length of a new track whose key frame is at 0 s. Others end at twice their key frame's time. All end with their first
// value, so that a repeat does not jump.
constexpr double kFirstLength_s = 10;

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

void SceneControls::on_session(double now_s, const wire::Welcome& session) {
  kind_ = scene::SessionView(session).kind();
  told_ = session.parameters;
  colours_.on_session(now_s, session);
  cut_.on_session(now_s, session);
  std::erase_if(wishes_, [&](const auto& w) {
    const auto told = told_.find(w.first);
    return now_s - w.second.since_s > kPatience_s || (told != told_.end() && told->second == w.second.value);
  });
  volume_.reset();
  if (kind_ != scene::Kind::kVolume) return;
  auto read = volume::read_session(session.parameters, session.facts);
  if (!read) return;
  std::optional<volume::Histogram> histogram;
  if (const auto fact = session.facts.find(volume::kHistogramFact); fact != session.facts.end())
    if (auto parsed = volume::histogram_from_text(fact->second)) histogram = *std::move(parsed);
  transfer_.on_session(now_s, *read, histogram);
  volume_ = *std::move(read);
}

void SceneControls::on_answer(const OrderAnswer& answer) {
  if (answer.obeyed) return;
  if (answer.order.command == "tf") transfer_.on_refusal();
  if (answer.order.command == "colour") colours_.on_refusal();
  if (answer.order.command == "clip") cut_.on_refusal();
  if (answer.order.command == "set")
    for (const auto& [name, value] : answer.order.arguments) wishes_.erase(name);
}

void SceneControls::edit(const std::function<bool(TransferEditor&)>& change) {
  if (change(transfer_)) give_({"tf", {{"transfer", transfer_.text()}}, "transfer"});
}

void SceneControls::choose_preset(std::string_view name) {
  transfer_.on_refusal();  // the session's next function is the preset
  give_({"tf", {{"transfer", std::string(name)}}, "transfer"});
}

void SceneControls::wish(double now_s, const std::string& name, double value) {
  wishes_[name] = {value, now_s};
  give_({"set", {{name, fmt::format("{}", value)}}, name});
}

void SceneControls::choose_step(double now_s, int step) {
  if (!volume_) return;
  wish(now_s, "volume.step", within(step, 0, volume_->steps - 1));
}

void SceneControls::choose_speed(double now_s, double steps_a_second) {
  if (!volume_) return;
  wish(now_s, "volume.steps-per-s", within(steps_a_second, 0.0, 1000.0));
}

void SceneControls::play_series(bool plays) { give_({"animate", {{"timeline", plays ? "on" : "off"}}, "animate"}); }

double SceneControls::value(std::string_view name) const {
  const std::string key(name);
  if (const auto wished = wishes_.find(key); wished != wishes_.end()) return wished->second.value;
  return scene::value_or(told_, key, 0.0);
}

void SceneControls::set(double now_s, const julia::ParameterInfo& info, double value) {
  if (!info.animates || !std::isfinite(value)) return;
  value = within(info.whole ? std::round(value) : value, info.least, info.most);
  if (value != this->value(info.name)) wish(now_s, std::string(info.name), value);
}

double SceneControls::timeline_s() const {
  double out = 0;
  for (const auto& track : timeline_.tracks) out = std::max(out, track.keys.back().t_s);
  return out;
}

void SceneControls::add_key(const julia::ParameterInfo& info, double t_s, double value) {
  if (!info.animates || info.whole || !std::isfinite(t_s) || !std::isfinite(value)) return;
  t_s = within(t_s, 0.0, kLongest_s);
  value = within(value, info.least, info.most);
  auto& tracks = timeline_.tracks;
  auto track = std::find_if(tracks.begin(), tracks.end(), [&](const auto& t) { return t.name == info.name; });
  if (track == tracks.end()) {
    const bool first = t_s < kSameTime_s;
    const double ends = first ? value : this->value(info.name);
    tracks.push_back({std::string(info.name), {{0, ends}, {first ? kFirstLength_s : 2 * t_s, ends}}});
    track = std::prev(tracks.end());
  }
  auto& keys = track->keys;
  const auto same =
      std::find_if(keys.begin(), keys.end(), [&](const auto& k) { return std::abs(k.t_s - t_s) < kSameTime_s; });
  if (same != keys.end()) {
    same->value = value;
    return;
  }
  keys.insert(std::upper_bound(keys.begin(), keys.end(), t_s, [](double t, const auto& k) { return t < k.t_s; }),
              {t_s, value});
}

// Removes a key frame; a track with fewer than two goes, too.
void SceneControls::remove_key(size_t track, size_t key) {
  if (track >= timeline_.tracks.size() || key >= timeline_.tracks[track].keys.size()) return;
  auto& keys = timeline_.tracks[track].keys;
  keys.erase(keys.begin() + std::ptrdiff_t(key));
  if (keys.size() < 2) {
    timeline_.tracks.erase(timeline_.tracks.begin() + std::ptrdiff_t(track));
    return;
  }
  const double first_s = keys.front().t_s;
  for (auto& k : keys) k.t_s -= first_s;
}

void SceneControls::play() {
  if (!timeline_.empty()) give_({"animate", {{"timeline", timeline_.text()}}, "animate"});
}

void SceneControls::stop() { give_({"animate", {{"timeline", "off"}}, "animate"}); }

}  // namespace telesplat::viewer
