#include "common/scene/legend.h"

#include <algorithm>

namespace telesplat::scene {
namespace {

constexpr int kSamples = 128;  // samples of a transfer function; few enough for a colour map's stops

uint32_t code(const volume::TransferFunction::Point& p) {
  uint32_t rgb = 0;
  for (const float v : {p.r, p.g, p.b}) rgb = rgb << 8 | uint32_t(std::clamp(v, 0.0f, 1.0f) * 255 + 0.5f);
  return rgb;
}

}  // namespace

image::Legend legend_of(const Colouring& c) {
  return {c.unit.empty() ? c.array : c.array + " [" + c.unit + "]", c.lo, c.hi, c.map, {}};
}

image::Legend legend_of(const volume::Session& session) {
  const auto& points = session.transfer.points;
  image::Legend out;
  out.title = session.range.hounsfield ? "CT number [HU]" : session.array.empty() ? "value" : session.array;
  out.lo = std::max(points.front().value, session.range.lo);
  out.hi = std::min(points.back().value, session.range.hi);
  if (!(out.lo < out.hi)) out.lo = session.range.lo, out.hi = std::max(session.range.lo, session.range.hi);
  out.map.name = "transfer";
  for (int n = 0; n < kSamples; ++n) {
    const double x = double(n) / (kSamples - 1);
    const auto p = session.transfer.at(out.lo + (out.hi - out.lo) * x);
    out.map.stops.push_back({x, code(p)});
    out.opacity.push_back(std::clamp(p.opacity, 0.0f, 1.0f));
  }
  return out;
}

std::optional<image::Legend> legend_of(const std::map<std::string, std::string>& facts,
                                       const std::map<std::string, double>& parameters) {
  if (const auto found = facts.find(kColouringFact); found != facts.end() && !found->second.empty()) {
    const auto colouring = colouring_from_text(found->second);
    return colouring ? std::optional(legend_of(*colouring)) : std::nullopt;
  }
  if (!facts.contains("transfer")) return std::nullopt;
  const auto session = volume::read_session(parameters, facts);
  return session ? std::optional(legend_of(*session)) : std::nullopt;
}

}  // namespace telesplat::scene
