#include "services/data/base/volume.h"

#include <cmath>
#include <cstring>

namespace telesplat::data {

double Volume::value(size_t at) const {
  const double v = with_type(type, [&](auto stored_value) {
    std::memcpy(&stored_value, stored.data() + at * sizeof stored_value, sizeof stored_value);
    return double(stored_value) * scale + offset;
  });
  return std::isfinite(v) ? v : lo;
}

geometry::DBox Volume::box() const {
  geometry::DBox out;
  for (int corner = 0; corner < 8; ++corner) {
    const auto at = [&](int axis) { return corner >> axis & 1 ? size[size_t(axis)] - 0.5 : -0.5; };
    out.extend(glm::dvec3(index_to_data * glm::dvec4(at(0), at(1), at(2), 1)));
  }
  return out;
}

}  // namespace telesplat::data
