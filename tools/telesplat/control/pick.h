// Asks a session's viewer what lies at places of its display.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/telesplat/control/client.h"

namespace telesplat::launcher {

struct PickQuestion {
  std::vector<std::string> places;  ///< "X,Y", pixels, or per cent of the display
  std::string viewer;               ///< empty: the first one
  std::string opacity;              ///< of volumes; empty: the viewer's
};

/// The viewer's answer with each place as the data server found it (docs/hands.md), and "distances", "angle_deg" and
/// "unit". Where the data server does not find it, "estimate" says why. Error: the viewer does not answer, or refuses.
Result<nlohmann::ordered_json> ask_pick(ControlClient& client, const PickQuestion& question);

/// For people: a paragraph a pick, then distances and the angle.
std::string pick_text(const nlohmann::ordered_json& answer);
/// The places that a window has marked, a paragraph each.
std::string measurements_text(const nlohmann::ordered_json& answer);
/// "temperature 21.50 +- 0.02 K"; empty: no value is known there.
std::string value_text(const nlohmann::ordered_json& pick);

}  // namespace telesplat::launcher
