#include "tools/lab/simulation/order_checks.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/scene/clip_order.h"
#include "common/scene/session.h"

namespace telesplat::simulation {
namespace {

constexpr double kOrderAnswers_s = 2.5;
constexpr double kEpochShown_s = 4;  // from an epoch's beginning until each viewer shows it

std::string value_of(const wire::Welcome& w, const std::string& name) {
  if (name == "volume.layers") return fmt::format("{}", w.settings.layers);
  if (const auto number = w.parameters.find(name); number != w.parameters.end())
    return fmt::format("{}", number->second);
  const std::string fact = fact_of(w, name == "clip" ? scene::kClipOrderFact : name);
  return fact.empty() ? "off" : fact;
}

}  // namespace

std::string fact_of(const wire::Welcome& session, const std::string& name) {
  return scene::value_or(session.facts, name, std::string());
}

void OrderChecks::on_welcome(const wire::Welcome& welcome, double now_s) {
  // Orders go with the data that they were given for.
  for (const char* name : {"kind", "content_hash", scene::kPlacementFact})
    if (fact_of(session_, name) != fact_of(welcome, name)) values_.clear(), scene_since_s_ = now_s;
  session_ = welcome;
  if (epochs_.empty() || epochs_.back().second < welcome.epoch.value) epochs_.emplace_back(now_s, welcome.epoch.value);
  while (epochs_.size() > 1 && epochs_[1].first < now_s - kEpochShown_s) epochs_.pop_front();
}

void OrderChecks::on_new_master() {
  epochs_.clear();
  values_.clear();
  session_ = {};
}

// Answers to two people may come in another order than they were given in.
void OrderChecks::on_reply(int process, const wire::ControlReply& reply, double sent_s, double now_s) {
  const auto asked = open_.find(process);
  if (asked == open_.end()) return;
  const auto [at_s, order, speaker] = asked->second;
  const bool wrong = speaker.fault == Fault::kOrder && speaker.amount == 1;
  open_.erase(asked);
  if (reply.ok && order.command == "status" && now_s > duration_s_ - kLast_s) status_ = reply.text;
  const auto now_is = [&](const std::string& name, const std::string& value) {
    Value& v = values_[name];
    if (sent_s >= v.at_s) v = {sent_s, sent_s > v.at_s ? value : ""};
  };
  if (wrong && (reply.ok || reply.text.empty()))
    fail_(fmt::format("the wrong order {} is answered by \"{}\"", order.command, reply.text));
  if (sent_s <= scene_since_s_ || fact_of(session_, "kind").empty()) return;
  const bool fits =
      order.command == "epoch" || order.command == "clip" ||
      (fact_of(session_, "kind") == "volume" && (order.command == "tf" || order.arguments.contains("volume.layers")));
  if (!reply.ok && !wrong && fits && speaker.fault == Fault::kOrder)
    fail_(fmt::format("{} is refused: {}", order.command, reply.text));
  if (!reply.ok) return;
  if (order.command == "animate" || order.command == "play")
    for (const char* name : {"c.x", "c.y", "c.z", "volume.step"}) now_is(name, "");
  if (order.command == "set" || order.command == "clip" || order.command == "tf")
    for (const auto& [name, value] : order.arguments) now_is(name, value);
}

bool OrderChecks::reshaped() const {
  return std::any_of(values_.begin(), values_.end(), [](const auto& v) { return v.first.starts_with("c."); });
}

uint64_t OrderChecks::due_epoch(double now_s, const Excuses& excuses) const {
  if (epochs_.empty() || now_s - epochs_.front().first < kEpochShown_s) return 0;
  return excuses.disturbed(epochs_.front().first, now_s) ? 0 : epochs_.front().second;
}

void OrderChecks::look_at_open(double now_s, const Excuses& excuses) const {
  for (const auto& [process, open] : open_)
    if (now_s - open.at_s > kOrderAnswers_s && !excuses.disturbed(open.at_s - kRecovers_s, now_s))
      fail_(open.order.command + " has no answer");
}

void OrderChecks::look_at_values() const {
  for (const auto& [name, v] : values_)
    if (!v.text.empty() && value_of(session_, name) != v.text)
      fail_(fmt::format("{} was ordered to be {} and is {}", name, v.text, value_of(session_, name)));
}

void OrderChecks::look_at_values(const wire::Welcome& known, const std::string& name) const {
  if (known.epoch != session_.epoch) return;
  for (const auto& [setting, v] : values_)
    if (value_of(known, setting) != value_of(session_, setting))
      fail_(fmt::format("{} takes {} for {}", name, setting, value_of(known, setting)));
}

}  // namespace telesplat::simulation
