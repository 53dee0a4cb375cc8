#include "client/viewer/hands/meaning.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <nlohmann/json.hpp>

#include "common/scene/session.h"

namespace telesplat::viewer {
namespace {

using Json = nlohmann::ordered_json;

// A colour that is farther from all of a map's is none of them: the largest difference of a channel.
constexpr int kNearColour = 3;

int difference(uint32_t a, uint32_t b) {
  int out = 0;
  for (const int shift : {0, 8, 16}) out = std::max(out, std::abs(int(a >> shift & 255) - int(b >> shift & 255)));
  return out;
}

Json numbers(const glm::dvec3& v) { return {v.x + 0.0, v.y + 0.0, v.z + 0.0}; }

}  // namespace

SceneTerms terms_of(const wire::Welcome& session) {
  const scene::SessionView view(session);
  SceneTerms out;
  if (const auto placement = scene::placement_from_text(view.fact(scene::kPlacementFact))) {
    out.placement = *placement;
    out.placed = true;
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

PickedPlace meaning_of(const Pick& pick, const SceneTerms& terms) {
  PickedPlace out{.room = pick.position_room,
                  .data = terms.placed ? terms.placement.to_data(pick.position_room) : pick.position_room,
                  .pick = pick,
                  .value = std::nullopt};
  if (terms.colouring) out.value = value_of_colour(*terms.colouring, pick.colour);
  return out;
}

nlohmann::ordered_json to_json(const PickedPlace& place, const SceneTerms& terms) {
  Json out{{"room", numbers(place.room)},
           {"data", numbers(place.data)},
           {"unit", terms.placement.unit},
           {"colour", fmt::format("#{:06x}", place.pick.colour)},
           {"depth_m", place.pick.depth_m},
           {"error_m", place.pick.error_m},
           {"error", place.pick.error_m * (terms.placed ? terms.placement.units_per_metre() : 1)}};
  if (glm::length(place.pick.normal_room) > 0)
    out["normal"] =
        numbers(terms.placed ? terms.placement.direction_to_data(place.pick.normal_room) : place.pick.normal_room);
  if (!terms.colouring) return out;
  out["array"] = terms.colouring->array;
  out["array_unit"] = terms.colouring->unit;
  out["value"] = place.value ? Json((place.value->lo + place.value->hi) / 2) : Json();
  if (place.value) out["value_error"] = (place.value->hi - place.value->lo) / 2;
  return out;
}

Measured measure(std::span<const PickedPlace> places, const SceneTerms& terms) {
  Measured out{.distances = {}, .angle_deg = std::nullopt, .unit = terms.placement.unit};
  for (size_t i = 1; i < places.size(); ++i) out.distances.push_back(glm::distance(places[i - 1].data, places[i].data));
  if (places.size() != 3) return out;
  const glm::dvec3 a = places[0].data - places[1].data, b = places[2].data - places[1].data;
  if (glm::length(a) > 0 && glm::length(b) > 0)
    out.angle_deg = glm::degrees(std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b)));
  return out;
}

std::string length_text(double length, const std::string& unit) {
  return fmt::format("{:.4g}{}{}", length, unit.empty() ? "" : " ", unit);
}

}  // namespace telesplat::viewer
