#include "client/displays/window/panel/scene_controls.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/within.h"
#include "common/scene/session.h"

namespace telesplat::viewer {
namespace {

constexpr double kSameTime_s = 0.05;

// Ten seconds with the value that it has, then the new one, then back: what repeats should not jump.
constexpr double kFirstLength_s = 10;

}  // namespace

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
  transfer_.on_refusal();  // what the session tells next is the preset
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

void SceneControls::play_series(bool plays) {
  give_({"animate", {{"timeline", plays ? "on" : "off"}}, "animate"});
}

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
    const double now = this->value(info.name), end_s = std::max(2 * t_s, kSameTime_s);
    tracks.push_back({std::string(info.name), {{0, now}, {t_s > 0 ? end_s : kFirstLength_s, now}}});
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

// A track without two key frames is none.
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
