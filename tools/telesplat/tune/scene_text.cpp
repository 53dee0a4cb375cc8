#include "tools/telesplat/tune/scene_text.h"

#include <fmt/format.h>

#include <cmath>
#include <sstream>

#include "common/core/machine.h"
#include "common/core/version.h"
#include "common/options/table.h"
#include "tools/common/text_table.h"
#include "tools/telesplat/tune/costs.h"

namespace telesplat::launcher {
namespace {

std::string spread_text(const Measured& m, double TuneFigures::*figure, int decimals) {
  const Spread s = spread_of(m, figure);
  if (s.runs == 0) return "-";
  const auto text = [&](double value) { return fmt::format("{:.{}f}", value, decimals); };
  const std::string median = text(s.median), least = text(s.least), most = text(s.most);
  return least == most ? median : fmt::format("{} ({}..{})", median, least, most);
}

// Comments; what is in them must not end a line.
std::string commented(const std::string& text) {
  std::istringstream in(text);
  std::string line, out;
  while (std::getline(in, line)) out += line.empty() ? "#\n" : "# " + line + "\n";
  return out;
}

void add_keys(const std::map<std::string, std::map<std::string, std::string>>& keys, const std::string& group,
              std::string& out) {
  const auto found = keys.find(group);
  if (found == keys.end() || found->second.empty()) return;
  out += fmt::format("\n[{}]\n", group);
  for (const auto& [key, value] : found->second) {
    const bool dotted = key.find('.') != key.npos;
    const bool truth = value == "true" || value == "false";
    out += fmt::format("{} = {}\n", dotted ? options::quoted(key) : key, truth ? value : options::quoted(value));
  }
}

}  // namespace

std::string table_text(const std::vector<Checked>& all, const std::string& indent) {
  tools::TextTable table({{"candidate", false},
                          {"latency ms: predicted"},
                          {"measured"},
                          {"updates/s: predicted"},
                          {"measured"},
                          {"quality dB: predicted"},
                          {"PSNR dB"},
                          {"age ms"},
                          {"frame ms"}});
  for (const Checked& c : all)
    table.add({c.measured.name, fmt::format("{:.1f}", 1e3 * c.predicted.latency_s),
               spread_text(c.measured, &TuneFigures::latency_ms, 1), fmt::format("{:.1f}", c.predicted.updates_per_s),
               spread_text(c.measured, &TuneFigures::updates_per_s, 1), fmt::format("{:.1f}", c.predicted.quality_db),
               spread_text(c.measured, &TuneFigures::psnr_db, 2), spread_text(c.measured, &TuneFigures::age_ms, 0),
               spread_text(c.measured, &TuneFigures::frame_ms, 1)});
  return table.text(indent);
}

std::string scene_text(const TuneSubject& subject, const TuneCosts& costs, const std::vector<Checked>& all,
                       const Choice& choice) {
  std::string why = fmt::format("Tuned by telesplat {}: telesplat run of this file starts the session.\n", version());
  for (const std::string& link : subject.request.links)
    why += fmt::format("It was tuned for --link {}, which is not part of this file.\n", link);
  why += "\n" + choice.sentence + "\n\nCosts, measured:\n";
  for (const std::string& line : describe(costs)) why += "  " + line + "\n";
  why += "\nCandidates:\n" + table_text(all, "  ");
  for (size_t i = 1; i < all.size(); ++i) why += fmt::format("  {}: {}\n", all[i].measured.name, choice.reasons[i]);
  why += "docs/tuning.md explains the model and the choice.\n";

  std::string out = commented(why);
  auto keys = subject.keys;
  for (const std::string& flag : tuned_flags(subject, all[choice.chosen].settings)) {
    const size_t equals = flag.find('=');
    std::string key = flag.substr(2, equals - 2);
    for (char& c : key)
      if (c == '-') c = '_';
    keys["tuned"][key] = flag.substr(equals + 1);
  }
  for (const char* group : {"scene", "view", "tuned", "packing", "julia"}) add_keys(keys, group, out);
  return out;
}

}  // namespace telesplat::launcher
