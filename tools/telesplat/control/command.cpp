// `telesplat ctl COMMAND ...`: asks or tells a running session's master.
#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <fstream>

#include "common/julia/flags.h"
#include "common/volume/session.h"
#include "tools/common/complain.h"
#include "tools/telesplat/command.h"
#include "tools/telesplat/control/client.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

using Arguments = std::map<std::string, std::string>;

struct ControlOptions {
  std::string command, master = "tcp://127.0.0.1:7700";
  std::vector<std::string> arguments;
};

constexpr double kPatience_s = 5;
constexpr uintmax_t kMaxMapBytes = 4 << 20;  // of a colour-map file

// "NAME=VALUE"s.
Result<Arguments> set_arguments(const std::vector<std::string>& given) {
  Arguments out;
  if (given.empty()) return Error{"ctl set: needs NAME=VALUE, such as c.y=0.3 or volume.step=3"};
  for (const auto& a : given) {
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

Result<Arguments> animate_arguments(const std::vector<std::string>& given) {
  if (given.size() != 1)
    return Error{
        "ctl animate: needs one timeline, such as c.y=-0.4:0.4:10s, or off; for a series of volumes on or off"};
  if (given.front() != "off" && given.front() != "on")
    if (const auto timeline = julia::parse_timeline(given.front()); !timeline) return timeline.error();
  return Arguments{{"timeline", given.front()}};
}

// A colour-map file's values may lie in any range; the session's is asked for. Otherwise the master reads the text: it
// knows the range.
Result<Arguments> transfer_arguments(const std::vector<std::string>& given, ControlClient& client) {
  if (given.size() != 1)
    return Error{
        "ctl tf: needs one transfer function: a preset, a ParaView JSON file, or points such as "
        "\"0:#000000:0,255:#ffffff:0.5\""};
  std::string text = given.front();
  std::error_code error;
  if (text.ends_with(".json") || fs::is_regular_file(text, error)) {
    const uintmax_t bytes = fs::file_size(text, error);
    if (error) return Error{fmt::format("{}: {}", text, error.message())};
    if (bytes > kMaxMapBytes) return Error{fmt::format("{}: {} bytes, limit {}", text, bytes, kMaxMapBytes)};
    std::ifstream in(text, std::ios::binary);
    const std::string content((std::istreambuf_iterator<char>(in)), {});
    const auto answer = client.ask("status", kPatience_s);
    if (!answer) return answer.error();
    const auto status = nlohmann::json::parse(*answer, nullptr, false);
    std::map<std::string, double> parameters;
    if (status.is_object() && status.contains("parameters"))
      for (const auto& [name, value] : status["parameters"].items())
        if (value.is_number()) parameters[name] = value.get<double>();
    const volume::TransferFunction any{{{}}};
    const auto session = volume::read_session(parameters, {{"transfer", volume::to_text(any)}});
    if (!session) return Error{fmt::format("ctl tf {}: the session shows no volume: {}", text, session.error().text)};
    const auto transfer = volume::parse_paraview_json(content, text, session->range);
    if (!transfer) return transfer.error();
    text = volume::to_text(*transfer);
  }
  if (text.size() > volume::kMaxTransferText)
    return Error{fmt::format("ctl tf: the transfer function is a text of {} bytes, limit {}", text.size(),
                             volume::kMaxTransferText)};
  return Arguments{{"transfer", text}};
}

Result<Arguments> read_arguments(const ControlOptions& o, ControlClient& client) {
  if (o.command == "set") return set_arguments(o.arguments);
  if (o.command == "animate") return animate_arguments(o.arguments);
  if (o.command == "tf") return transfer_arguments(o.arguments, client);
  if (!o.arguments.empty())
    return Error{fmt::format("ctl {}: takes nothing more, not \"{}\"", o.command, o.arguments.front().substr(0, 80))};
  return Arguments{};
}

options::Table table(ControlOptions& o) {
  return {{.flag = "command",
           .value = &o.command,
           .help = "status: who takes part and what they count; stop: end the session; epoch: drop all points; set "
                   "NAME=VALUE...: change a Julia set's parameters, or volume.step of a series; animate TIMELINE: as "
                   "--animate of run, or off; tf TRANSFER: a volume's transfer function, as --tf of run",
           .limits = options::Names{"status", "stop", "epoch", "set", "animate", "tf"},
           .required = true},
          {.flag = "arguments", .value = &o.arguments, .help = "of set, animate and tf"},
          {.flag = "--master", .value = &o.master, .help = "address of the master"}};
}

int control(ControlOptions o, const options::Given&) {
  log::initialise("ctl", "warn");
  ControlClient client(o.master);
  const auto arguments = read_arguments(o, client);
  if (!arguments) return tools::complain(arguments.error());
  const auto answer = client.ask(o.command, kPatience_s, *arguments);
  if (!answer) return tools::complain(answer.error(), 1);
  const auto json = nlohmann::ordered_json::parse(*answer, nullptr, false);
  std::printf("%s\n", json.is_object() ? json.dump(2).c_str() : answer->c_str());
  return 0;
}

}  // namespace

Command control_command() { return make_command("ctl", "ask or tell a running session's master", table, control); }

}  // namespace telesplat::launcher
