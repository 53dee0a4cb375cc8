#include "services/master/control.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "common/scene/session.h"

namespace telesplat::master {

Result<double> read_number(const std::string& name, const std::string& text) {
  double value = 0;
  const auto end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, value);
  if (text.empty() || read.ec != std::errc() || read.ptr != end || !std::isfinite(value))
    return Error{fmt::format("{} is \"{}\", not a finite number", name.substr(0, 64), text.substr(0, 40))};
  return value;
}

Result<CouplingOrder> read_coupling(const wire::Control& m) {
  const std::string name = scene::value_or(m.arguments, "coupling", std::string()),
                    buffers = scene::value_or(m.arguments, "buffers", std::string());
  CouplingOrder out{.viewer = scene::value_or(m.arguments, "viewer", std::string()), .text = name};
  if (name == "sync" || name == "loose") {
    out.mode = name == "sync" ? wire::CouplingOrder::kSync : wire::CouplingOrder::kLoose;
  } else if (name == "images") {
    return Error{"coupling images is of a session from its beginning: telesplat run --coupling images"};
  } else if (name != "async") {
    return Error{fmt::format("coupling is \"{}\", not async, sync or loose", name.substr(0, 40))};
  }
  if (!buffers.empty()) {
    if (name != "loose") return Error{fmt::format("buffers are of loose coupling; {} has none", name)};
    const auto number = read_number("buffers", buffers);
    if (!number) return number.error();
    if (*number < 1 || *number > double(wire::kMaxBuffers) || *number != std::floor(*number))
      return Error{
          fmt::format("buffers is {}, not a whole number of 1 to {}", buffers.substr(0, 40), wire::kMaxBuffers)};
    out.buffers = uint64_t(*number);
  }
  if (name == "loose") out.text = fmt::format("loose, {} buffer{}", out.buffers, out.buffers == 1 ? "" : "s");
  return out;
}

Result<PlayOrder> read_play(const wire::Control& m) {
  const std::string how = scene::value_or(m.arguments, "how", std::string()),
                    steps = scene::value_or(m.arguments, "steps", std::string());
  PlayOrder out;
  if (how == "pause")
    out.how = PlayOrder::How::kPause;
  else if (how == "step")
    out.how = PlayOrder::How::kStep;
  else if (how != "play")
    return Error{fmt::format("play: \"{}\" is not play, pause or step", how.substr(0, 40))};
  if (steps.empty()) return out;
  if (how != "step") return Error{fmt::format("play: steps are of step; {} has none", how)};
  const auto number = read_number("steps", steps);
  if (!number) return number.error();
  constexpr double kMost = 4096;
  if (*number != std::floor(*number) || *number == 0 || std::abs(*number) > kMost)
    return Error{
        fmt::format("steps is {}, not a whole number of -{} to {} other than 0", steps.substr(0, 40), kMost, kMost)};
  out.steps = int(*number);
  return out;
}

}  // namespace telesplat::master
