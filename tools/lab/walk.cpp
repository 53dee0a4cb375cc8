#include "tools/lab/walk.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <sstream>

namespace telesplat::lab {

Result<Walk> Walk::open(const std::string& names) {
  Walk walk;
  std::istringstream list(names);
  for (std::string name; std::getline(list, name, ',');) {
    if (name == "orbit") {
      walk.parts_.push_back(geometry::Trajectory::orbit());
      walk.ends_s_.push_back(walk.length_s() + 20);
      continue;
    }
    auto read = geometry::Trajectory::read_csv(name);
    if (!read) return read.error();
    if (!(read->duration_s() > 0)) return Error{fmt::format("{}: takes no time, so nothing is walked", name)};
    walk.parts_.push_back(std::move(*read));
    walk.ends_s_.push_back(walk.length_s() + walk.parts_.back().duration_s());
  }
  if (walk.parts_.empty()) return Error{"--trajectory: names no file"};
  return walk;
}

geometry::Pose Walk::at(double t_s) const {
  t_s = std::fmod(t_s, length_s());
  size_t i = 0;
  while (i + 1 < parts_.size() && t_s >= ends_s_[i]) ++i;
  return parts_[i].at(i == 0 ? t_s : t_s - ends_s_[i - 1]);
}

image::DepthImage cut(const image::DepthImage& whole, const geometry::Rect& part) {
  image::DepthImage out(part.width, part.height);
  for (int y = 0; y < part.height; ++y) {
    const size_t from = size_t(part.y + y) * whole.width + part.x, to = size_t(y) * part.width;
    std::copy_n(whole.depth.data() + from, part.width, out.depth.data() + to);
    std::copy_n(whole.colour.data() + from, part.width, out.colour.data() + to);
    std::copy_n(whole.normal.data() + from, part.width, out.normal.data() + to);
  }
  return out;
}

}  // namespace telesplat::lab
