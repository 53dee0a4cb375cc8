#include "services/master/tiles/julia_parameters.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/julia/animation.h"
#include "common/scene/session.h"
#include "services/master/control.h"

namespace telesplat::master {

bool JuliaParameters::adopt(const wire::Hello& data, std::string& problem) {
  const auto fact = [&](const char* key) { return scene::value_or(data.facts, key, std::string()); };
  const bool other_data = fact("content_hash") != content_hash_;
  if (fact("kind") == kind_ && data.parameters == told_ && !other_data) return false;
  kind_ = fact("kind");
  told_ = data.parameters;
  content_hash_ = fact("content_hash");
  const bool changed = values_ != told_ || other_data;
  values_ = told_;
  julia_.reset();
  timeline_ = {};
  if (!is_julia()) {
    if (!wished_.empty()) problem = fmt::format("--animate: a scene of kind \"{}\" has no parameters", kind_);
    return changed;
  }
  const auto parameters = julia::from_map(values_);
  const Status valid = parameters ? julia::validate(*parameters) : Status(parameters.error());
  if (!valid) {
    problem = valid.error().text;
    return changed;
  }
  julia_ = *parameters;
  julia::Timeline timeline = wished_;
  if (const std::string text = fact("animate"); timeline.empty() && !text.empty()) {
    auto read = julia::parse_timeline(text);
    if (!read) {
      problem = read.error().text;
      return changed;
    }
    timeline = *std::move(read);
  }
  if (!timeline.empty())
    if (const Status s = begin(std::move(timeline)); !s) problem = s.error().text;
  return changed;
}

std::map<std::string, double> JuliaParameters::with(const julia::Parameters& parameters) const {
  auto out = values_;  // the placement is among them
  for (const auto& [name, value] : julia::to_map(parameters)) out[name] = value;
  return out;
}

Status JuliaParameters::set(const std::map<std::string, std::string>& arguments) {
  if (!julia_)
    return Error{kind_.empty() ? std::string("set: there is no data server yet")
                               : fmt::format("set: a scene of kind \"{}\" has no parameters", kind_)};
  if (arguments.empty()) return Error{"set: names no parameter; NAME=VALUE is needed"};
  julia::Parameters wanted = *julia_;
  for (const auto& [name, text] : arguments) {
    const auto value = read_number(name, text);
    if (!value) return value.error();
    if (const Status s = julia::set(wanted, name, *value); !s) return s;
    for (const auto& info : julia::parameter_infos())
      if (info.name == name && !info.animates)
        return Error{fmt::format("{} is fixed for a session: the set's place in the room follows from it", name)};
    for (const auto& track : timeline_.tracks)
      if (track.name == name) return Error{fmt::format("{} is animated; end the animation first", name)};
  }
  if (const Status s = julia::validate(wanted, timeline_); !s) return s;
  julia_ = wanted;
  values_ = with(wanted);
  return ok_status();
}

Status JuliaParameters::begin(julia::Timeline timeline) {
  if (const Status s = julia::validate(*julia_, timeline); !s) return s;
  timeline_ = std::move(timeline);
  begun_s_.reset();
  from_s_ = elapsed_s_ = 0;
  paused_ = false;
  return ok_status();
}

Status JuliaParameters::animate(const std::string& text) {
  if (!julia_)
    return Error{kind_.empty() ? std::string("animate: there is no data server yet")
                               : fmt::format("animate: a scene of kind \"{}\" has no parameters", kind_)};
  if (text == "off") {
    timeline_ = {};
    return ok_status();
  }
  auto timeline = julia::parse_timeline(text);
  if (!timeline) return timeline.error();
  return begin(*std::move(timeline));
}

bool JuliaParameters::step(double now_s) {
  if (!playing()) return false;
  if (!begun_s_) begun_s_ = now_s;
  return take(from_s_ + now_s - *begun_s_);
}

Result<bool> JuliaParameters::play(const PlayOrder& order) {
  if (!animated()) return Error{"play: nothing is animated; ctl animate begins an animation"};
  if (order.how == PlayOrder::How::kPlay) {
    paused_ = false;
    return false;
  }
  paused_ = true;
  begun_s_.reset();
  const bool other = order.how == PlayOrder::How::kStep && take(std::max(elapsed_s_ + order.steps * kStep_s, 0.0));
  from_s_ = elapsed_s_;
  return other;
}

// Takes the values at `elapsed_s` on the timeline. True: they changed.
bool JuliaParameters::take(double elapsed_s) {
  elapsed_s_ = elapsed_s;
  auto next = julia::parameters_at(*julia_, timeline_, elapsed_s);
  // Checked at 256 instants when it began; between two of them a combination may still be out of limits: the last
  // values stay.
  if (!next || *next == *julia_) return false;
  julia_ = *next;
  values_ = with(*next);
  return true;
}

}  // namespace telesplat::master
