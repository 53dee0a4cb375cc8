#include "common/net/connections/waiting.h"

#include <fmt/format.h>
#include <netdb.h>

#include <algorithm>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "common/core/clock.h"

namespace telesplat::net {
namespace {

constexpr double kSearchEvery_s = 30;

}  // namespace

std::optional<std::string> Waiting::look(const std::string& what, double now_s) {
  if (what.empty()) {
    *this = Waiting(most_s_);
    return std::nullopt;
  }
  if (!since_s_) since_s_ = now_s;
  if (what != what_) what_ = what, what_since_s_ = now_s;
  const bool is_new = !told_.contains(what);
  if (now_s - what_since_s_ < kGrace_s || (!is_new && now_s - told_s_ < kEvery_s)) return std::nullopt;
  told_.insert(what);
  told_s_ = now_s;
  return fmt::format("{}; waiting ({:.0f} s so far)", what, waited_s(now_s));
}

std::string lacking_text(std::string_view roles) {
  std::vector<std::string> lacks;
  for (size_t begin = 0; begin < roles.size();) {
    const size_t end = std::min(roles.find(',', begin), roles.size());
    const std::string role(roles.substr(begin, end - begin));
    lacks.push_back("no " + (role == "data" ? "data server" : role));
    begin = end + 1;
  }
  std::string out;
  for (size_t i = 0; i < lacks.size(); ++i) out += (i == 0 ? "" : i + 1 < lacks.size() ? ", " : " and ") + lacks[i];
  return out.empty() ? out : "the session has " + out;
}

std::string host_problem(const std::string& endpoint) {
  constexpr std::string_view kTcp = "tcp://";
  const size_t colon = endpoint.rfind(':');
  if (!endpoint.starts_with(kTcp) || colon <= kTcp.size()) return {};
  const std::string host = endpoint.substr(kTcp.size(), colon - kTcp.size());
  if (host.front() == '[') return {};  // an IPv6 address
  addrinfo hints{}, *found = nullptr;
  hints.ai_socktype = SOCK_STREAM;
  const int failed = getaddrinfo(host.c_str(), nullptr, &hints, &found);
  if (failed == 0) freeaddrinfo(found);
  return failed == 0 ? std::string() : fmt::format("no host called {} is found: {}", host, gai_strerror(failed));
}

struct HostSearch::Found {
  std::mutex mutex;
  bool under_way = false;
  double begun_s = -1e9;
  std::string problem;
};

void HostSearch::begin() {
  if (!found_) found_ = std::make_shared<Found>();
  {
    const std::lock_guard lock(found_->mutex);
    const double now_s = monotonic_s();
    if (found_->under_way || now_s - found_->begun_s < kSearchEvery_s) return;
    found_->under_way = true;
    found_->begun_s = now_s;
  }
  // A search cannot be interrupted: no thread waits for it.
  std::thread([found = found_, endpoint = endpoint_] {
    std::string problem = host_problem(endpoint);
    const std::lock_guard lock(found->mutex);
    found->problem = std::move(problem);
    found->under_way = false;
  }).detach();
}

std::string HostSearch::problem() const {
  if (!found_) return {};
  const std::lock_guard lock(found_->mutex);
  return found_->problem;
}

}  // namespace telesplat::net
