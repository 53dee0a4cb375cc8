#include "services/master/orders/errands.h"

#include <fmt/format.h>

#include <utility>

namespace telesplat::master {

Result<uint64_t> Errands::begin(const std::string& peer, std::set<std::string> asked, double now_s) {
  if (errands_.size() >= kMost) return Error{fmt::format("{} orders wait for their answers, limit {}", kMost, kMost)};
  errands_[++last_] = {peer, std::move(asked), {}, now_s + kPatience_s};
  return last_;
}

std::optional<Errands::Reply> Errands::answered(const std::string& from, const wire::OrderAnswer& answer) {
  const auto errand = errands_.find(answer.number);
  if (errand == errands_.end() || errand->second.open.erase(from) == 0) return std::nullopt;
  if (!answer.ok && !errand->second.open.empty()) {
    errand->second.refusal = answer.text;
    return std::nullopt;
  }
  Reply out{std::move(errand->second.peer), {answer.ok, answer.text}};
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
    out.push_back({std::move(e.peer), {false, std::move(e.refusal)}});
    at = errands_.erase(at);
  }
  return out;
}

std::vector<Errands::Reply> Errands::overdue(double now_s) {
  std::vector<Reply> out;
  std::erase_if(errands_, [&](auto& errand) {
    if (now_s < errand.second.until_s) return false;
    out.push_back({std::move(errand.second.peer), {false, fmt::format("no answer within {} s", kPatience_s)}});
    return true;
  });
  return out;
}

std::string errand_for(const std::string& command) {
  for (const char* of_viewer : {"pick", "where", "go", "overlay"})
    if (command == of_viewer) return "viewer";
  return command == "probe" ? "data" : "";
}

}  // namespace telesplat::master
