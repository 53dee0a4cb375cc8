#include <fmt/format.h>

#include <algorithm>

#include "common/julia/parameters.h"

namespace telesplat::julia {
namespace {

enum Palette { kEmber, kOcean, kForest, kSpectrum, kIvory, kDusk, kCopper, kIce };

// c as the literature writes it: real part first.
Parameters set_of(double real, double i, double j, double k, Colour colour, Palette palette, double scale,
                  double shift) {
  Parameters p;
  p.c = {i, j, k, real};
  p.colour = colour;
  p.palette = palette;
  p.colour_scale = scale;
  p.colour_shift = shift;
  return p;
}

const Preset kPresets[] = {
    {"coral", "branching folds with holes through them",
     set_of(-0.2, 0.4, -0.4, -0.4, Colour::kDistance, kEmber, 1, 0)},
    {"lantern", "rings about an axis, open at both ends", set_of(-0.2, 0.8, 0, 0, Colour::kDistance, kCopper, 1, 0)},
    {"knots", "strands that split and meet again", set_of(-0.125, -0.256, 0.847, 0.0895, Colour::kTrap, kOcean, 1, 0)},
    {"beads", "a row of bulbs, each with smaller ones", set_of(-1, 0.2, 0, 0, Colour::kDistance, kIvory, 1, 0)},
    {"shell", "smooth lobes that curl inwards", set_of(-0.291, -0.399, 0.339, 0.437, Colour::kTrapPlane, kDusk, 1, 0)},
    {"driftwood", "a bent trunk with stumps", set_of(-0.213, -0.041, -0.563, -0.56, Colour::kDistance, kForest, 1, 0)},
    {"orchid", "petals about a narrow waist", set_of(-0.45, -0.447, 0.181, 0.306, Colour::kTrap, kDusk, 1, 0)},
    {"pebble", "a dented stone", set_of(-0.218, -0.113, -0.181, -0.496, Colour::kTrapPlane, kSpectrum, 1, 0)},
    {"wings", "two sheets, torn at their rims", set_of(-0.137, -0.63, -0.475, -0.046, Colour::kDistance, kIce, 1, 0)},
    {"cloud", "puffs upon puffs", set_of(0.185, 0.478, 0.125, -0.392, Colour::kTrap, kIvory, 1, 0)},
    {"tower", "storeys that turn as they rise", set_of(-0.08, 0, -0.83, -0.025, Colour::kDistance, kSpectrum, 1, 0)},
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
