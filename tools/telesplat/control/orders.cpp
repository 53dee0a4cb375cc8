#include "tools/telesplat/control/orders.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>

#include "common/core/whole_file.h"
#include "common/julia/flags.h"
#include "common/net/control.h"
#include "common/scene/clip_order.h"
#include "common/scene/colouring.h"
#include "common/scene/settings.h"
#include "common/volume/session.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

using Arguments = Order::Arguments;
using Words = std::vector<std::string>;

constexpr uintmax_t kMaxMapBytes = 4 << 20;  // size of a colour-map file

// Reads words "NAME=VALUE".
Result<Arguments> set_arguments(const Words& words, ControlClient&) {
  Arguments out;
  if (words.empty()) return Error{"ctl set: needs NAME=VALUE, such as c.y=0.3 or volume.step=3"};
  for (const auto& a : words) {
    const size_t equals = a.find('=');
    if (equals == std::string::npos || equals == 0)
      return Error{fmt::format("ctl set: \"{}\" is not NAME=VALUE, such as c.y=0.3 or volume.step=3", a.substr(0, 80))};
    const std::string name = a.substr(0, equals);
    const auto value = julia::read_value(name, a.substr(equals + 1));
    if (!value) return Error{"ctl set: " + value.error().text};
    out[name] = fmt::format("{}", *value);
  }
  return out;
}

Result<Arguments> animate_arguments(const Words& words, ControlClient&) {
  if (words.size() != 1)
    return Error{
        "ctl animate: needs one timeline, such as c.y=-0.4:0.4:10s, or off; for a series of volumes on or off"};
  if (words.front() != "off" && words.front() != "on")
    if (const auto timeline = julia::parse_timeline(words.front()); !timeline) return timeline.error();
  return Arguments{{"timeline", words.front()}};
}

// Reads FILE.json or FILE.json:NAME. A colour-map file's values may lie in any range; the master sends the session's.
Result<std::string> read_map(const std::string& word, ControlClient& client) {
  const size_t named = word.find(".json:");
  const std::string path = word.substr(0, named == std::string::npos ? named : named + 5);
  const std::string name = path.size() < word.size() ? word.substr(path.size() + 1) : "";
  const auto content = read_whole(path, kMaxMapBytes);
  if (!content) return content.error();
  const auto status = client.status(kPatience_s);
  if (!status) return status.error();
  std::map<std::string, double> parameters;
  if (status->contains("parameters"))
    for (const auto& [name, value] : (*status)["parameters"].items())
      if (value.is_number()) parameters[name] = value.get<double>();
  const volume::TransferFunction any{{{}}};
  const auto session = volume::read_session(parameters, {{"transfer", volume::to_text(any)}});
  if (!session) return Error{fmt::format("ctl tf {}: the session shows no volume: {}", path, session.error().text)};
  const auto transfer = volume::parse_paraview_json(*content, path, session->range, name);
  if (!transfer) return transfer.error();
  return volume::to_text(*transfer);
}

std::string preset_names() {
  std::vector<std::string> names;
  for (const auto& preset : volume::transfer_presets()) names.emplace_back(preset.name);
  return fmt::format("{}", fmt::join(names, ", "));
}

// The master reads presets and points: it knows the range of the volume's values.
Result<Arguments> transfer_arguments(const Words& words, ControlClient& client) {
  if (words.size() != 1)
    return Error{
        fmt::format("ctl tf: needs one transfer function: a preset ({}), a ParaView JSON file, or points such as "
                    "\"0:#000000:0,255:#ffffff:0.5\"",
                    preset_names())};
  std::string text = words.front();
  std::error_code error;
  if (text.ends_with(".json") || text.find(".json:") != std::string::npos || fs::is_regular_file(text, error)) {
    auto map = read_map(text, client);
    if (!map) return map.error();
    text = *std::move(map);
  } else if (text.find(':') == std::string::npos) {
    const auto presets = volume::transfer_presets();
    if (std::none_of(presets.begin(), presets.end(), [&](const auto& p) { return p.name == text; }))
      return Error{
          fmt::format("ctl tf: \"{}\" is no preset ({}), no file that is there, and no points such as "
                      "\"0:#000000:0,255:#ffffff:0.5\"",
                      text.substr(0, 80), preset_names())};
  }
  if (text.size() > volume::kMaxTransferText)
    return Error{fmt::format("ctl tf: the transfer function is a text of {} bytes, limit {}", text.size(),
                             volume::kMaxTransferText)};
  return Arguments{{"transfer", text}};
}

// Reads ARRAY[:MIN:MAX], none, map NAME, or ARRAY map NAME. Map files lie on this machine: they are read here.
Result<Arguments> colour_arguments(const Words& words, ControlClient&) {
  const bool maps = words.size() >= 2 && words[words.size() - 2] == "map";
  const size_t arrays = words.size() - (maps ? 2 : 0);
  if (words.empty() || arrays > 1)
    return Error{
        "ctl colour: needs an array such as temperature or temperature:0:100, none, or map NAME, or both: "
        "temperature map plasma"};
  Arguments out;
  if (arrays == 1) {
    if (const auto by = scene::parse_colour_by(words.front()); !by) return Error{"ctl colour: " + by.error().text};
    out["array"] = words.front();
  }
  if (!maps) return out;
  const auto map = colour::resolve_colour_map(words.back());
  if (!map) return Error{"ctl colour: " + map.error().text};
  out["map"] = colour::to_text(*map);
  return out;
}

Result<Arguments> overlay_arguments(const Words& words, ControlClient&) {
  if (words.size() != 2 || (words.back() != "on" && words.back() != "off"))
    return Error{"ctl overlay: needs NAME on or NAME off, such as axes on"};
  return Arguments{{"name", words.front()}, {"on", words.back()}};
}

// Reads play, pause, step or step N.
Result<Arguments> play_arguments(const Words& words, ControlClient&) {
  const std::string how = words.empty() ? "play" : words.front();
  if ((how != "play" && how != "pause" && how != "step") || words.size() > (how == "step" ? 2u : 1u))
    return Error{"ctl play: needs play, pause, step or step N, such as step -1"};
  Arguments out{{"how", how}};
  if (words.size() == 2) out["steps"] = words.back();
  return out;
}

// Reads plane ..., box ..., off; ";" may separate parts.
Result<Arguments> clip_arguments(const Words& words, ControlClient&) {
  if (words.empty()) return Error{"ctl clip: needs plane x>=50%, plane A,B,C,D, box X0,Y0,Z0,X1,Y1,Z1 or off"};
  const std::string text = fmt::format("{}", fmt::join(words, " "));
  if (const auto order = scene::parse_clip(text); !order) return Error{"ctl " + order.error().text};
  return Arguments{{"clip", text}};
}

// An order without a help has that of the settings that it changes.
std::vector<Order> all_orders() {
  std::vector<Order> all{
      {.name = "stop",
       .help = "end the session: the master writes the record, everyone exits",
       .words = {},
       .read =
           [](const auto&, auto&) {
             return Result<Order::Arguments>({{"by", net::this_person()}});
           }},
      {.name = "epoch", .help = "drop all points and sample anew", .words = {}},
      {.name = "set", .words = "NAME=VALUE, such as c.y=0.3 or volume.step=3", .read = set_arguments},
      {.name = "animate",
       .words = "a timeline as --animate of run takes it, or off; for a series of volumes on or off",
       .read = animate_arguments},
      {.name = "play",
       .words = "play, pause, or step N: N steps of a series, or tenths of a second of an animation, farther on (back "
                "if it is below 0)",
       .read = play_arguments},
      {.name = "overlay",
       .words = "NAME on or NAME off; NAME is axes, scale, cursor, fps or all",
       .read = overlay_arguments},
      {.name = "tf",
       .words = "as --tf of run: a preset (" + preset_names() +
                "), a ParaView JSON file, or points VALUE:COLOUR:OPACITY,...",
       .read = transfer_arguments},
      {.name = "colour",
       .words = "ARRAY[:MIN:MAX] as --colour-by of run, or none; map NAME, NAME as --colour-map of run; or both: ARRAY "
                "map NAME",
       .read = colour_arguments},
      {.name = "clip",
       .words = "in the data's own coordinates: plane x>=50% (x, y, z; >= or <=; a number or a share of the data's "
                "box) or plane A,B,C,D keeps A x + B y + C z >= D; box X0,Y0,Z0,X1,Y1,Z1 keeps the inside; several "
                "are separated by \";\"; off: nothing is cut away; without words: prints what is cut away",
       .read = clip_arguments,
       .shown = "clip"}};
  for (Order& order : all)
    if (order.help.empty()) order.help = scene::help_of_order(order.name);
  return all;
}

}  // namespace

const std::vector<Order>& orders() {
  static const std::vector<Order> all = all_orders();
  return all;
}

}  // namespace telesplat::launcher
