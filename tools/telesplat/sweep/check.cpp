#include "tools/telesplat/sweep/check.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/options/parser.h"
#include "tools/telesplat/run/run_options.h"
#include "tools/telesplat/scene/scene_file.h"

namespace telesplat::launcher {
namespace {

struct Refused {
  const char* flag;
  const char* why;
};
constexpr Refused kRefused[] = {
    {"--out", "the sweep gives each run a folder of its own"},
    {"--label", "its runs are called by what varies"},
    {"--overwrite", "the sweep replaces what it did not finish, and nothing else"},
    {"--master", "each run of a sweep is a session of its own"},
    {"--movie", "all runs would write one file; telesplat movie makes one of a run's folder"},
};

}  // namespace

Result<double> check_run(const std::vector<std::string>& arguments) {
  RunOptions o;
  const options::Table flags = table(o);
  auto words = expand_scene_file(arguments, flags);
  if (!words) return words.error();
  options::Parser parser("");
  parser.add(flags);
  if (const Status s = parser.parse("telesplat run", std::move(*words)); !s) return s.error();
  const options::Given given = parser.given();
  for (const auto& [flag, why] : kRefused)
    if (std::find(given.begin(), given.end(), flag) != given.end())
      return Error{fmt::format("{}: is not for sweeps: {}", flag, why)};
  if (o.data.scene.empty()) return Error{"a scene is needed: telesplat sweep SCENE, or --vary scene=A,B"};
  o.out = "run";  // it will have one
  if (const auto scene = settle(o, given); !scene) return scene.error();
  const auto& display = o.viewer.display;
  if (display.duration_s <= 0 && display.frames == 0) return Error{"--duration 0: such a run does not end by itself"};
  return display.duration_s;
}

}  // namespace telesplat::launcher
