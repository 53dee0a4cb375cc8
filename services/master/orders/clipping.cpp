#include "services/master/orders/clipping.h"

#include "common/scene/session.h"

namespace telesplat::master {
namespace {

Result<geometry::Clip> planes_of(const std::string& order, const scene::Placement& placement) {
  const auto parsed = scene::parse_clip(order);
  if (!parsed) return parsed.error();
  return scene::place_clip(*parsed, placement);
}

}  // namespace

bool Clipping::adopt(const wire::Hello& data, std::string& problem) {
  const std::string text = scene::value_or(data.facts, scene::kPlacementFact, std::string());
  if (known_ && text == placement_text_) return false;
  if (known_) order_.clear();
  known_ = true;
  placement_text_ = text;
  placement_ = {};
  if (!text.empty()) {
    const auto read = scene::placement_from_text(text);
    if (read)
      placement_ = *read;
    else
      problem = read.error().text;
  }
  const auto clip = planes_of(order_, placement_);
  if (!clip) {
    problem = clip.error().text;
    order_.clear();
  }
  const geometry::Clip before = std::exchange(clip_, clip ? *clip : geometry::Clip{});
  return before != clip_;
}

Result<Obeyed> Clipping::obey(const wire::Control& command) {
  const auto order = command.arguments.find("clip");
  if (order == command.arguments.end())
    return Error{"clip: the argument clip is missing, such as plane x>=50%, box 0,0,0,1,1,1 or off"};
  if (!known_) return Error{"clip: there is no data server yet"};
  const auto clip = planes_of(order->second, placement_);
  if (!clip) return clip.error();
  clip_ = *clip;
  order_ = clip_.empty() ? std::string() : order->second;
  return Obeyed{.begins_epoch = true, .answer = {}};
}

void Clipping::describe(wire::Welcome& welcome) const {
  welcome.facts.erase(scene::kClipFact);
  welcome.facts.erase(scene::kClipOrderFact);
  if (clip_.empty()) return;
  welcome.facts[scene::kClipFact] = text();
  welcome.facts[scene::kClipOrderFact] = order_;
}

}  // namespace telesplat::master
