#include "common/metrics/roster.h"

#include <algorithm>
#include <cstdlib>

#include "common/scene/session.h"

namespace telesplat::metrics {

size_t Roster::count(const std::string& role) const {
  return size_t(std::ranges::count_if(processes_, [&](const Process& p) { return p.role == role && !p.replaced; }));
}

size_t Roster::lost(const std::string& role) const {
  return size_t(std::ranges::count_if(processes_, [&](const Process& p) { return p.role == role && p.lost; }));
}

std::string Roster::fact(const std::string& role, const std::string& key) const {
  const std::string* found = nullptr;
  for (const Process& p : processes_) {
    const auto it = p.facts.find(key);
    if (p.role != role || p.replaced || it == p.facts.end()) continue;
    if (scene::value_or(p.facts, "records_in", std::string()) == ".") return it->second;
    if (!found) found = &it->second;
  }
  return found ? *found : "";
}

double Roster::number(const std::string& role, const std::string& key) const {
  return std::strtod(fact(role, key).c_str(), nullptr);
}

double Roster::counted(const std::string& role, const std::string& key) const {
  double sum = 0;
  for (const Process& p : processes_)
    if (role.empty() || p.role == role) sum += scene::value_or(p.values, key, 0.0);
  return sum;
}

double Roster::present(const std::string& role, const std::string& key) const {
  double sum = 0;
  for (const Process& p : processes_)
    if (p.role == role && !p.replaced) sum += scene::value_or(p.values, key, 0.0);
  return sum;
}

std::vector<double> Roster::each(const std::string& role, const std::string& key) const {
  std::vector<double> out;
  for (const Process& p : processes_)
    if (const auto it = p.values.find(key); p.role == role && it != p.values.end()) out.push_back(it->second);
  return out;
}

}  // namespace telesplat::metrics
