#include "client/viewer/hands/meaning.h"

#include <algorithm>
#include <cstdlib>
#include <glm/geometric.hpp>

#include "common/scene/session.h"

namespace telesplat::viewer {
namespace {

// A colour belongs to a map if a colour of the map is this near: largest difference in a channel.
constexpr int kNearColour = 3;

int difference(uint32_t a, uint32_t b) {
  int out = 0;
  for (const int shift : {0, 8, 16}) out = std::max(out, std::abs(int(a >> shift & 255) - int(b >> shift & 255)));
  return out;
}

}  // namespace

SceneTerms terms_of(const wire::Welcome& session) {
  const scene::SessionView view(session);
  SceneTerms out;
  if (const auto placement = scene::placement_from_text(view.fact(scene::kPlacementFact))) {
    out.placement = *placement;
  } else {
    out.placement.unit = "m";
  }
  out.data_file = view.fact("data_file");
  out.scene = view.fact("scene");
  if (const std::string text = view.fact(scene::kColouringFact); !text.empty())
    if (auto colouring = scene::colouring_from_text(text)) out.colouring = *std::move(colouring);
  return out;
}

std::optional<ValueRange> value_of_colour(const scene::Colouring& colouring, uint32_t colour) {
  const scene::ColourTable table = scene::make_table(colouring);
  constexpr int kEntries = scene::ColourTable::kEntries;
  int best = kNearColour + 1;
  for (int i = 0; i < kEntries; ++i) best = std::min(best, difference(table.colours[size_t(i)], colour));
  if (best > kNearColour || difference(table.colours[kEntries], colour) < best) return std::nullopt;
  int first = -1, last = -1;
  for (int i = 0; i < kEntries; ++i)
    if (difference(table.colours[size_t(i)], colour) == best) {
      if (first < 0) first = i;
      last = i;
    }
  const double step = (colouring.hi - colouring.lo) / kEntries;
  return ValueRange{colouring.lo + first * step, colouring.lo + (last + 1) * step};
}

scene::ToldPlace meaning_of(const Pick& pick, const SceneTerms& terms) {
  scene::ToldPlace out{.room = pick.position_room, .data = terms.placement.to_data(pick.position_room)};
  out.estimate = "from what the viewer shows";
  if (glm::length(pick.normal_room) > 0) out.normal_data = terms.placement.direction_to_data(pick.normal_room);
  if (!terms.colouring) return out;
  out.array = terms.colouring->array, out.array_unit = terms.colouring->unit;
  if (const auto range = value_of_colour(*terms.colouring, pick.colour)) out.value = (range->lo + range->hi) / 2;
  return out;
}

scene::Probe probe_of(const Pick& pick, EpochId epoch, double opacity) {
  return {epoch, pick.origin_room, pick.direction_room, opacity};
}

}  // namespace telesplat::viewer
