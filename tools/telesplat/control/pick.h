// Asks a session's viewer what lies at places of its display.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/telesplat/control/client.h"

namespace telesplat::launcher {

struct PickQuestion {
  std::vector<std::string> places;  ///< "X,Y", in pixels or in per cent of the display
  std::string viewer;               ///< empty: the first viewer
  std::string opacity;              ///< opacity of a volume's surface; empty: the viewer's
};

/// Returns the viewer's answer with each place as the data server found it (docs/hands.md), and "distances",
/// "angle_deg" and "unit". "estimate" says why it finds none. Error: the viewer does not answer, or refuses.
Result<nlohmann::ordered_json> ask_pick(ControlClient& client, const PickQuestion& question);

/// Writes a paragraph a pick, then distances and the angle, for people.
std::string pick_text(const nlohmann::ordered_json& answer);
/// Writes the places that a window has marked, a paragraph each.
std::string measurements_text(const nlohmann::ordered_json& answer);
/// "temperature 21.50 +- 0.02 K"; empty: the place has no known value.
std::string value_text(const nlohmann::ordered_json& pick);

}  // namespace telesplat::launcher
