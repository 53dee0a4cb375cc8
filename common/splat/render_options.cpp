#include "common/splat/render_options.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace telesplat::splat {
namespace {

constexpr std::pair<std::string_view, bool Finish::*> kStages[] = {
    {"fill", &Finish::fill}, {"smooth", &Finish::smooth}, {"antialias", &Finish::antialias}};

}  // namespace

std::string finish_name(const Finish& finish) {
  std::string out;
  for (const auto& [name, on] : kStages)
    if (finish.*on) out.append(out.empty() ? "" : ",").append(name);
  if (out.empty()) return "off";
  return finish.fill && finish.smooth && finish.antialias ? "on" : out;
}

std::optional<Finish> finish_named(std::string_view name) {
  if (name == "on") return Finish{true, true, true};
  Finish out{false, false, false};
  if (name == "off") return out;
  for (size_t begin = 0; begin <= name.size();) {
    const size_t comma = std::min(name.find(',', begin), name.size());
    const std::string_view stage = name.substr(begin, comma - begin);
    bool known = false;
    for (const auto& [text, on] : kStages)
      if (stage == text) known = out.*on = true;
    if (!known) return std::nullopt;
    begin = comma + 1;
  }
  return out;
}

unsigned finish_bits(const Finish& finish) {
  unsigned out = 0, bit = 1;
  for (const auto& [name, on] : kStages) {
    if (finish.*on) out |= bit;
    bit *= 2;
  }
  return out;
}

std::optional<Finish> finish_of_bits(uint64_t bits) {
  if (bits >= 1u << std::size(kStages)) return std::nullopt;
  Finish out;
  for (const auto& [name, on] : kStages) {
    out.*on = bits & 1;
    bits /= 2;
  }
  return out;
}

}  // namespace telesplat::splat
