#include "services/master/settings.h"

namespace telesplat::master {
namespace {

const scene::Policy& policy(std::optional<scene::Kind> kind) {
  return scene::policy_of(kind.value_or(scene::Kind::kMesh));
}

}  // namespace

const char* name_of(Progressive progressive) {
  return progressive == Progressive::kAuto ? "auto" : progressive == Progressive::kOn ? "on" : "off";
}

bool progressive(const MasterOptions& options, std::optional<scene::Kind> kind) {
  if (options.settings.pictures) return false;
  return options.progressive == Progressive::kAuto ? policy(kind).progressive : options.progressive == Progressive::kOn;
}

wire::SessionSettings settings(const MasterOptions& options, std::optional<scene::Kind> kind) {
  wire::SessionSettings out = options.settings;
  const bool points = scene::pipeline_of(kind.value_or(scene::Kind::kMesh)) == scene::Pipeline::kPoints;
  out.steering = out.steering && points && !out.pictures && !out.keep_redundant;
  out.max_rate_mbit = options.schedule.max_rate_mbit;
  out.max_sampling_pixels = options.limits.max_sampling_pixels;
  out.least_sampling = policy(kind).least_sampling;
  return out;
}

}  // namespace telesplat::master
