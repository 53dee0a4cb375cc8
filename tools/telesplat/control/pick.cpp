#include "tools/telesplat/control/pick.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <cstdlib>

#include "common/scene/told_place.h"
#include "tools/telesplat/control/json_fields.h"
#include "tools/telesplat/control/orders.h"

namespace telesplat::launcher {
namespace {

using Json = nlohmann::ordered_json;

double amount(const Json& json, const char* key) { return number(json, key).value_or(0); }

std::string triple(const Json& json, const char* key) {
  std::string out;
  for (const Json& v : array(json, key))
    if (v.is_number()) out += fmt::format("{}{:.6g}", out.empty() ? "" : ", ", v.get<double>());
  return out;
}

std::string within_text(const Json& place, const std::string& unit) {
  if (place.contains("pending")) return "  within       is being looked up\n";
  if (const auto within = number(place, "error"))
    return fmt::format("  within       {}\n",
                       scene::length_text(std::strtod(fmt::format("{:.2g}", *within).c_str(), nullptr), unit));
  const std::string why = text(place, "estimate");
  return fmt::format("  within       no bound is known{}\n", why.empty() ? "" : "; an estimate: " + why);
}

// Asks the data server for the exact place of a pick.
Result<scene::Probed> probe(ControlClient& client, const Json& pick) {
  std::map<std::string, std::string> arguments;
  if (const auto* told = field(pick, "probe"); told && told->is_object())
    for (const auto& [key, value] : told->items())
      if (value.is_string()) arguments[key] = value.get<std::string>();
  const auto answer = client.order("probe", kPatience_s, arguments);
  if (!answer) return answer.error();
  if (!answer->ok) return Error{answer->text};
  return scene::probed_from_text(answer->text);
}

// Returns the place as the data have it; if they do not, the place says why it is an estimate.
scene::ToldPlace refined(ControlClient& client, Json& pick, scene::ToldPlace place, const scene::Placement& placement) {
  if (const auto found = probe(client, pick))
    scene::refine(place, *found, placement);
  else
    place.estimate = found.error().text;
  for (const char* old : {"estimate", "value", "array", "array_unit"}) pick.erase(old);
  pick.update(scene::to_json(place, placement));
  return place;
}

}  // namespace

Result<nlohmann::ordered_json> ask_pick(ControlClient& client, const PickQuestion& question) {
  std::map<std::string, std::string> arguments{{"at", fmt::format("{}", fmt::join(question.places, " "))}};
  if (!question.viewer.empty()) arguments["viewer"] = question.viewer;
  if (!question.opacity.empty()) arguments["opacity"] = question.opacity;
  const auto answer = client.ask("pick", kPatience_s, arguments);
  if (!answer) return answer.error();
  Json out = Json::parse(*answer, nullptr, false);
  const auto* told = out.is_object() ? field(out, "placement") : nullptr;
  const auto placement = scene::placement_from_text(told ? told->dump() : "");
  if (!placement || !out.contains("picks") || !out["picks"].is_array()) return Error{"the viewer's answer is no pick"};
  std::vector<scene::ToldPlace> places;
  for (Json& pick : out["picks"])
    if (auto place = scene::told_place_from(pick, *placement))
      places.push_back(refined(client, pick, *std::move(place), *placement));
  const scene::Measured measured = scene::measure(places, *placement);
  out["distances"] = measured.distances;
  if (measured.angles_deg.size() == 1 && std::isfinite(measured.angles_deg[0]))
    out["angle_deg"] = measured.angles_deg[0];
  out["unit"] = placement->unit;
  return out;
}

std::string value_text(const nlohmann::ordered_json& pick) {
  const auto place = scene::told_place_from(pick, {});
  return place ? scene::value_text(*place) : "";
}

std::string pick_text(const nlohmann::ordered_json& answer) {
  std::string out;
  const std::string unit = text(answer, "unit");
  for (const Json& pick : array(answer, "picks")) {
    if (!pick.is_object()) {
      out += "nothing is there\n";
      continue;
    }
    out += text(pick, "place") + "\n" + within_text(pick, unit);
    out += fmt::format("  in the room  {} m, {:.4g} m before the eye\n", triple(pick, "room"), amount(pick, "depth_m"));
    if (pick.contains("normal")) out += fmt::format("  normal       {}\n", triple(pick, "normal"));
    out += fmt::format("  colour       {}\n", text(pick, "colour"));
    if (const std::string value = value_text(pick); !value.empty()) out += fmt::format("  value        {}\n", value);
  }
  for (const Json& distance : array(answer, "distances"))
    if (distance.is_number()) out += "distance " + scene::length_text(distance.get<double>(), unit) + "\n";
  if (const auto* angle = field(answer, "angle_deg"); angle && angle->is_number())
    out += fmt::format("angle {:.4g} degrees\n", angle->get<double>());
  return out;
}

std::string measurements_text(const nlohmann::ordered_json& answer) {
  std::string out;
  for (const Json& place : array(answer, "places")) {
    out += fmt::format("{}  {}\n", count(place, "number"), text(place, "place"));
    out += within_text(place, text(answer, "unit"));
    if (const std::string value = value_text(place); !value.empty()) out += fmt::format("  value        {}\n", value);
    if (const std::string between = text(place, "between"); !between.empty())
      out += fmt::format("  between      {}\n", between);
  }
  return out.empty() ? "nothing is measured; ctl measure add X,Y or key X of a window measures a place\n" : out;
}

}  // namespace telesplat::launcher
