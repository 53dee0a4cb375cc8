#include "tools/telesplat/control/pick.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

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

std::string with_unit(const std::string& text, const std::string& unit) {
  return unit.empty() ? text : text + " " + unit;
}

// What the data server has there; nothing where it is no volume's.
void add_value(ControlClient& client, Json& pick) {
  const auto room = numbers(pick, "room", 3);
  if (!room) return;
  const auto answer = client.order("probe", kPatience_s,
                                   {{"x", fmt::format("{}", (*room)[0])},
                                    {"y", fmt::format("{}", (*room)[1])},
                                    {"z", fmt::format("{}", (*room)[2])}});
  if (!answer || !answer->ok) return;
  const Json probed = Json::parse(answer->text, nullptr, false);
  if (!probed.is_object()) return;
  for (const char* key : {"value", "value_error", "index", "step"})
    if (probed.contains(key)) pick[key] = probed[key];
}

}  // namespace

Result<nlohmann::ordered_json> ask_pick(ControlClient& client, const PickQuestion& question) {
  std::map<std::string, std::string> arguments{{"at", fmt::format("{}", fmt::join(question.places, " "))}};
  if (!question.viewer.empty()) arguments["viewer"] = question.viewer;
  if (!question.opacity.empty()) arguments["opacity"] = question.opacity;
  const auto answer = client.ask("pick", kPatience_s, arguments);
  if (!answer) return answer.error();
  Json out = Json::parse(*answer, nullptr, false);
  if (!out.is_object() || !out.contains("picks") || !out["picks"].is_array())
    return Error{"the viewer's answer is no pick"};
  for (Json& pick : out["picks"])
    if (pick.is_object() && !pick.contains("value") && !pick.contains("normal")) add_value(client, pick);
  return out;
}

std::string value_text(const nlohmann::ordered_json& pick) {
  const auto* value = field(pick, "value");
  if (!value || !value->is_number()) return {};
  const std::string array = text(pick, "array"), name = array.empty() ? "value" : array;
  return with_unit(fmt::format("{} {:.6g} +- {:.2g}", name, value->get<double>(), amount(pick, "value_error")),
                   text(pick, "array_unit"));
}

std::string pick_text(const nlohmann::ordered_json& answer) {
  std::string out;
  const std::string unit = text(answer, "unit");
  for (const Json& pick : array(answer, "picks")) {
    if (!pick.is_object()) {
      out += "nothing is there\n";
      continue;
    }
    out += with_unit(triple(pick, "data"), unit) + "\n";
    out += fmt::format("  in the room  {} m, {:.4g} m before the eye, within {:.2g} m\n", triple(pick, "room"),
                       amount(pick, "depth_m"), amount(pick, "error_m"));
    if (pick.contains("normal")) out += fmt::format("  normal       {}\n", triple(pick, "normal"));
    out += fmt::format("  colour       {}\n", text(pick, "colour"));
    if (const std::string value = value_text(pick); !value.empty()) out += fmt::format("  value        {}\n", value);
  }
  for (const Json& distance : array(answer, "distances"))
    if (distance.is_number()) out += with_unit(fmt::format("distance {:.6g}", distance.get<double>()), unit) + "\n";
  if (const auto* angle = field(answer, "angle_deg"); angle && angle->is_number())
    out += fmt::format("angle {:.4g} degrees\n", angle->get<double>());
  return out;
}

}  // namespace telesplat::launcher
