#include "services/master/settings.h"

#include <algorithm>

#include "common/image/background.h"
#include "common/image/shading.h"
#include "common/scene/session.h"

namespace telesplat::master {
namespace {

const scene::Policy& policy(std::optional<scene::Kind> kind) {
  return scene::policy_of(kind.value_or(scene::Kind::kMesh));
}

void add_pictures(const ImageOptions& images, std::map<std::string, double>& out) {
  const auto& names = image::kShadingNames;
  const auto background = image::parse_background(images.background);
  out[scene::kPictureQuality] = images.quality;
  out["picture.samples"] = images.samples;
  out["picture.shading"] = double(std::find(names.begin(), names.end(), images.shading) - names.begin());
  out["picture.background"] = background ? double(background->colour) : 0.0;
}

}  // namespace

const char* name_of(Progressive progressive) {
  return progressive == Progressive::kAuto ? "auto" : progressive == Progressive::kOn ? "on" : "off";
}

const char* name_of(Redundancy redundancy) {
  return redundancy == Redundancy::kAuto ? "auto" : redundancy == Redundancy::kKeep ? "keep" : "eliminate";
}

const char* name_of(Steering steering) {
  return steering == Steering::kAuto ? "auto" : steering == Steering::kOn ? "on" : "off";
}

uint64_t octree_depth(const MasterOptions& options, std::optional<scene::Kind> kind) {
  return options.octree_depth > 0 ? options.octree_depth : uint64_t(policy(kind).octree_depth);
}

bool progressive(const MasterOptions& options, std::optional<scene::Kind> kind) {
  if (options.images.on()) return false;
  return options.progressive == Progressive::kAuto ? policy(kind).progressive : options.progressive == Progressive::kOn;
}

bool keeps_redundant(const MasterOptions& options, std::optional<scene::Kind> kind) {
  return options.redundancy == Redundancy::kAuto ? policy(kind).keep_redundant
                                                 : options.redundancy == Redundancy::kKeep;
}

bool steers(const MasterOptions& options, std::optional<scene::Kind> kind) {
  if (options.images.on() || scene::pipeline_of(kind.value_or(scene::Kind::kMesh)) != scene::Pipeline::kPoints)
    return false;
  return options.steering == Steering::kAuto ? !keeps_redundant(options, kind) : options.steering == Steering::kOn;
}

std::map<std::string, double> settings(const MasterOptions& options, std::optional<scene::Kind> kind) {
  auto out = options.settings;
  out.try_emplace("packing.max_points", policy(kind).max_points);
  if (options.schedule.max_rate_mbit > 0) out["packing.max_rate_mbit"] = options.schedule.max_rate_mbit;
  out["packing.keep_redundant"] = keeps_redundant(options, kind);
  out["sampling.steering"] = steers(options, kind);
  out["sampling.max_pixels"] = double(options.limits.max_sampling_pixels);
  out["viewer.least_sampling"] = policy(kind).least_sampling;
  if (options.images.on()) add_pictures(options.images, out);
  return out;
}

}  // namespace telesplat::master
