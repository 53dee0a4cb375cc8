#include "services/master/orders/errands.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <utility>

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

}  // namespace telesplat::master
