#include "client/displays/window/panel/order_undo.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "common/scene/clip_order.h"
#include "common/scene/colouring.h"

namespace telesplat::viewer {
namespace {

using Arguments = std::map<std::string, std::string>;

std::string fact(const wire::Welcome& session, const char* name) {
  const auto found = session.facts.find(name);
  return found == session.facts.end() ? std::string() : found->second;
}

Arguments colour_of(const wire::Welcome& session) {
  const auto now = scene::colouring_from_text(fact(session, scene::kColouringFact));
  if (!now) return {{"array", std::string(scene::kNoArray)}};
  return {{"array", fmt::format("{}:{}:{}", now->array, now->lo, now->hi)}, {"map", colour::to_text(now->map)}};
}

}  // namespace

std::optional<Order> OrderUndo::back_of(const Order& order) const {
  if (!session_) return std::nullopt;
  Order out{order.command, {}, order.subject};
  if (order.command == "tf") {
    if (const std::string text = fact(*session_, "transfer"); !text.empty()) out.arguments = {{"transfer", text}};
  } else if (order.command == "clip") {
    const std::string text = fact(*session_, scene::kClipOrderFact);
    out.arguments = {{"clip", text.empty() ? "off" : text}};
  } else if (order.command == "colour") {
    out.arguments = colour_of(*session_);
  } else if (order.command == "set") {
    for (const auto& [name, value] : order.arguments)
      if (const auto before = session_->parameters.find(name); before != session_->parameters.end())
        out.arguments[name] = fmt::format("{}", before->second);
  }
  return out.arguments.empty() || out.arguments == order.arguments ? std::nullopt : std::optional(out);
}

// A later order replaces a waiting one of the same subject, which gets no answer: so it takes over that one's `back`.
void OrderUndo::given(const Order& order, bool undoes) {
  Given now{order, undoes ? std::nullopt : back_of(order)};
  if (!order.subject.empty()) {
    const auto same = [&](const Given& g) { return g.order.subject == order.subject; };
    if (const auto first = std::find_if(given_.begin(), given_.end(), same); first != given_.end() && first->back)
      now.back = first->back;
  }
  given_.push_back(std::move(now));
}

std::optional<Order> OrderUndo::answered(const OrderAnswer& answer) {
  const auto found =
      std::find_if(given_.begin(), given_.end(), [&](const Given& g) { return g.order == answer.order; });
  if (found == given_.end()) return std::nullopt;
  std::optional<Order> back = std::move(found->back);
  given_.erase(given_.begin(), found + 1);
  return answer.obeyed ? back : std::nullopt;
}

}  // namespace telesplat::viewer
