#include "services/master/orders.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <utility>

#include "common/core/utf8.h"
#include "common/scene/session.h"
#include "common/scene/settings.h"

namespace telesplat::master {

Result<uint64_t> Errands::begin(const Asker& asker, std::set<std::string> asked, double now_s) {
  const auto own = std::count_if(errands_.begin(), errands_.end(),
                                 [&](const auto& errand) { return errand.second.asker.person == asker.person; });
  if (size_t(own) >= kMostOfOne)
    return Error{fmt::format("{} orders of yours wait for their answers, limit {}", own, kMostOfOne)};
  if (errands_.size() >= kMost) return Error{fmt::format("{} orders wait for their answers, limit {}", kMost, kMost)};
  errands_[++last_] = {asker, std::move(asked), {}, now_s + kPatience_s, {}};
  return last_;
}

Result<uint64_t> Errands::ask_launcher(const Asker& asker, const wire::Control& order, const std::string& started_by,
                                       double now_s) {
  if (started_by.empty() || started_by == "hand")
    return Error{fmt::format("{}: this session was started by hand: whoever started its processes starts and ends them",
                             order.command)};
  auto number = begin(asker, {kLauncher}, now_s);
  if (number) errands_[*number].wish = order;
  return number;
}

std::map<uint64_t, wire::Control> Errands::wishes() const {
  std::map<uint64_t, wire::Control> out;
  for (const auto& [number, errand] : errands_)
    if (errand.wish) out.emplace(number, *errand.wish);
  return out;
}

std::optional<Errands::Reply> Errands::answered(const std::string& from, const wire::OrderAnswer& answer) {
  const auto errand = errands_.find(answer.number);
  if (errand == errands_.end() || errand->second.open.erase(from) == 0) return std::nullopt;
  if (!answer.ok && !errand->second.open.empty()) {
    errand->second.refusal = answer.text;
    return std::nullopt;
  }
  Reply out{std::move(errand->second.asker.peer), {answer.ok, answer.text}};
  errands_.erase(errand);
  return out;
}

std::vector<Errands::Reply> Errands::lost(const std::string& asked) {
  std::vector<Reply> out;
  for (auto at = errands_.begin(); at != errands_.end();) {
    Errand& e = at->second;
    if (e.open.erase(asked) == 0 || !e.open.empty()) {
      ++at;
      continue;
    }
    if (e.refusal.empty()) e.refusal = "who was asked is gone, and has not answered";
    out.push_back({std::move(e.asker.peer), {false, std::move(e.refusal)}});
    at = errands_.erase(at);
  }
  return out;
}

std::vector<Errands::Reply> Errands::overdue(double now_s) {
  std::vector<Reply> out;
  std::erase_if(errands_, [&](auto& errand) {
    if (now_s < errand.second.until_s) return false;
    out.push_back({std::move(errand.second.asker.peer), {false, fmt::format("no answer within {} s", kPatience_s)}});
    return true;
  });
  return out;
}

std::string errand_for(const std::string& command) {
  for (const char* of_viewer : {"pick", "where", "go", "measure"})
    if (command == of_viewer) return "viewer";
  if (command == "probe") return "data";
  const auto* setting = scene::setting_of_order(command);
  if (!setting) return "";
  return setting->keeper == scene::Keeper::kViewer     ? "viewer"
         : setting->keeper == scene::Keeper::kLauncher ? Errands::kLauncher
                                                       : "";
}

Result<wire::OrderAnswer> read_done(const wire::Control& m) {
  const std::string number = scene::value_or(m.arguments, "number", std::string());
  wire::OrderAnswer out{.ok = scene::value_or(m.arguments, "ok", std::string()) == "true",
                        .text = scene::value_or(m.arguments, "text", std::string())};
  const auto read = std::from_chars(number.data(), number.data() + number.size(), out.number);
  if (number.empty() || read.ec != std::errc() || read.ptr != number.data() + number.size())
    return Error{fmt::format("done: \"{}\" is no order's number", number.substr(0, 40))};
  return out;
}

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
