#include "common/image/srgb.h"

#include <algorithm>
#include <cmath>

namespace telesplat::image {

const std::array<float, 256>& linear_of_srgb() {
  static const std::array<float, 256> table = [] {
    std::array<float, 256> t{};
    for (int i = 0; i < 256; ++i) {
      const double c = i / 255.0;
      t[i] = static_cast<float>(c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4));
    }
    return t;
  }();
  return table;
}

uint32_t srgb_of_linear(float v) {
  const double c = v <= 0.0031308f ? 12.92 * v : 1.055 * std::pow(static_cast<double>(v), 1 / 2.4) - 0.055;
  return c > 0 ? static_cast<uint32_t>(std::min(c, 1.0) * 255.0 + 0.5) : 0;  // NaN becomes 0
}

}  // namespace telesplat::image
