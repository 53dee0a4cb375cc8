#include "services/sampler/julia/palette.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>

#include "common/core/check.h"

namespace telesplat::sampler {
namespace {

// In the order of julia::palette_names(): ember, ocean, forest, spectrum, ivory, dusk, copper, ice.
constexpr uint32_t kEmber[] = {0x5a2016, 0x8d2c1c, 0xc24a1e, 0xe98a35, 0xf6cf7a, 0xe9a04a, 0xb8502a, 0x7d2c22};
constexpr uint32_t kOcean[] = {0x2a6f96, 0x2490a0, 0x6cc7b6, 0xd8ecd0, 0x86cdd0, 0x3f8fbc, 0x2a5f98, 0x24547f};
constexpr uint32_t kForest[] = {0x456e3e, 0x6c9447, 0xb5bd62, 0xe8dfa6, 0xb39a5c, 0x8a7a40, 0x5d6a38, 0x3f5f38};
constexpr uint32_t kSpectrum[] = {0xc8504e, 0xd8884a, 0xd6bc56, 0x7fb862, 0x49a89c, 0x4a80c0, 0x7c66b8, 0xb45a92};
constexpr uint32_t kIvory[] = {0xf2ead8, 0xe4d3b4, 0xcdb38c, 0xb0906c, 0x9c7d62, 0xb89d7e, 0xd6c3a2, 0xeadfc8};
constexpr uint32_t kDusk[] = {0x8f5f9c, 0xcb6f86, 0xf0a98a, 0xf4d3ac, 0xb98fae, 0x7a6aa8, 0x5a4f90, 0x6a5298};
constexpr uint32_t kCopper[] = {0x4a2a20, 0x8a4b30, 0xc47a4c, 0xe8b388, 0x9fb8a4, 0x4f8f84, 0x386460, 0x3a4440};
constexpr uint32_t kIce[] = {0xf0f6fa, 0xc6e0f0, 0x8fbfe0, 0x5a93c8, 0x4a6fae, 0x6d86b8, 0xa3b8d4, 0xd6e2ee};

const auto& palettes() {
  static const std::array all{JuliaPalette(kEmber),    JuliaPalette(kOcean), JuliaPalette(kForest),
                              JuliaPalette(kSpectrum), JuliaPalette(kIvory), JuliaPalette(kDusk),
                              JuliaPalette(kCopper),   JuliaPalette(kIce)};
  return all;
}

}  // namespace

JuliaPalette::JuliaPalette(const uint32_t* stops, size_t count) {
  const auto stop = [&](size_t i) {
    const uint32_t c = stops[i % count];
    return glm::vec3(c >> 16 & 255, c >> 8 & 255, c & 255);
  };
  for (int i = 0; i < kEntries; ++i) {
    const float at = static_cast<float>(i) * static_cast<float>(count) / kEntries, f = at - std::floor(at);
    const auto k = static_cast<size_t>(at) + count;
    const glm::vec3 a = stop(k - 1), b = stop(k), c = stop(k + 1), d = stop(k + 2);
    const glm::vec3 curve =
        b + 0.5f * f * ((c - a) + f * ((2.0f * a - 5.0f * b + 4.0f * c - d) + f * (3.0f * (b - c) + d - a)));
    entries_[i] = glm::clamp(curve, 0.0f, 255.0f);
  }
}

const glm::vec3& JuliaPalette::at(float tone) const {
  const float part = tone - std::floor(tone);  // not a number where tone is infinite
  return entries_[part >= 0 && part < 1 ? static_cast<int>(part * kEntries) : 0];
}

const JuliaPalette& julia_palette(int index) {
  CHECK(index >= 0 && index < julia_palette_count());
  return palettes()[static_cast<size_t>(index)];
}

int julia_palette_count() { return static_cast<int>(palettes().size()); }

}  // namespace telesplat::sampler
