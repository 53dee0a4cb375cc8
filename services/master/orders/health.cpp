#include "services/master/orders/health.h"

#include <fmt/format.h>

#include "common/core/utf8.h"
#include "common/scene/session.h"

namespace telesplat::master {
namespace {

constexpr size_t kMostShown = 64;  // characters of a name

bool fits(const std::string& wanted, const std::string& value) { return wanted.empty() || wanted == value; }

std::string shown(const std::string& text) { return to_utf8(text.substr(0, kMostShown)); }

}  // namespace

HealthQuestion::HealthQuestion(const wire::Control& question)
    : role_(scene::value_or(question.arguments, "role", std::string())),
      name_(scene::value_or(question.arguments, "name", std::string())),
      host_(scene::value_or(question.arguments, "host", std::string())) {
  well_ = role_.empty() && name_.empty() && host_.empty();
}

void HealthQuestion::look_at(const wire::Hello& process, bool gone, double silent_s) {
  if (well_ || !fits(role_, process.role) || !fits(name_, process.name) ||
      !fits(host_, scene::value_or(process.facts, "host", std::string())))
    return;
  if (gone)
    wrong_ = shown(process.name) + " has left the session";
  else if (silent_s > kHealthySilence_s)
    wrong_ = fmt::format("{} has said nothing for more than {} s", shown(process.name), kHealthySilence_s);
  else
    well_ = true;
}

Result<std::string> HealthQuestion::answer() const {
  if (well_) return std::string("well");
  std::string who = role_.empty() ? "process" : shown(role_);
  if (!name_.empty()) who += " named " + shown(name_);
  if (!host_.empty()) who += " on " + shown(host_);
  return Error{fmt::format("no healthy {}: {}", who, wrong_)};
}

}  // namespace telesplat::master
