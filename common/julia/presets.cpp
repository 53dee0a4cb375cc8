#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "common/julia/parameters.h"

namespace telesplat::julia {
namespace {

enum Palette { kEmber, kOcean, kForest, kSpectrum, kIvory, kDusk, kCopper, kIce };

// c in the order of the literature: real part first.
Parameters set_of(const std::array<double, 4>& c, Colour colour, Palette palette, double scale, double shift) {
  Parameters p;
  p.c = {c[1], c[2], c[3], c[0]};
  p.colour = colour;
  p.palette = palette;
  p.colour_scale = scale;
  p.colour_shift = shift;
  return p;
}

const Preset kPresets[] = {
    {"coral", "folded bands about two openings", set_of({-0.2, 0.4, -0.4, -0.4}, Colour::kDistance, kEmber, 1.6, 0.75)},
    {"lantern", "rings and arches about a core", set_of({-0.2, 0.8, 0, 0}, Colour::kDistance, kCopper, 1.3, 0)},
    {"knots", "thin strands round nested rings", set_of({-0.125, -0.256, 0.847, 0.0895}, Colour::kTrap, kOcean, 1, 0)},
    {"beads", "spindles on a string, each smaller than the one before",
     set_of({-1, 0.2, 0, 0}, Colour::kDistance, kIvory, 1, 0)},
    {"shell", "grooved lobes curled into one another",
     set_of({-0.291, -0.399, 0.339, 0.437}, Colour::kTrapPlane, kDusk, 2, 0.3)},
    {"cocoon", "a smooth case with slits", set_of({-0.213, -0.041, -0.563, -0.56}, Colour::kDistance, kForest, 1, 0)},
    {"orchid", "grooved petals about a waist", set_of({-0.45, -0.447, 0.181, 0.306}, Colour::kTrap, kDusk, 2, 0.25)},
    {"urn", "a ribbed vessel", set_of({-0.218, -0.113, -0.181, -0.496}, Colour::kTrapPlane, kSpectrum, 1, 0)},
    {"wings", "a cage of bands and a ribbed tail",
     set_of({-0.137, -0.63, -0.475, -0.046}, Colour::kDistance, kIce, 1, 0)},
    {"skein", "threads wound into a coil", set_of({0.185, 0.478, 0.125, -0.392}, Colour::kTrap, kIvory, 2, 0)},
    {"hood", "a hood of bands, open in front", set_of({-0.08, 0, -0.83, -0.025}, Colour::kDistance, kSpectrum, 1.2, 0)},
};

}  // namespace

std::span<const Preset> presets() { return kPresets; }

Result<Parameters> preset_named(std::string_view name) {
  std::string names;
  for (const auto& p : kPresets) {
    if (p.name == name) return p.parameters;
    names += fmt::format("{}{}", names.empty() ? "" : ", ", p.name);
  }
  return Error{fmt::format("{}: no preset of that name; there are {}", name.substr(0, 64), names)};
}

}  // namespace telesplat::julia
