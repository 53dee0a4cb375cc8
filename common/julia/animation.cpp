#include "common/julia/animation.h"

#include <fmt/format.h>

#include <algorithm>
#include <future>

#include "common/core/machine.h"

namespace telesplat::julia {
namespace {

constexpr int kBoxes = 24, kChecks = 256;
constexpr size_t kMaxInstants = 1024;  // a track may have thousands of key frames

}  // namespace

Result<Parameters> parameters_at(const Parameters& start, const Timeline& timeline, double t_s) {
  Parameters out = start;
  for (const auto& [name, value] : timeline.values(t_s))
    if (const Status s = set(out, name, value); !s) return s.error();
  if (const Status s = validate(out); !s) return s.error();
  return out;
}

std::vector<double> instants(const Timeline& timeline, int count) {
  std::vector<double> out{0};
  double length = 0;
  for (const auto& track : timeline.tracks) {
    length = std::max(length, track.keys.back().t_s);
    for (const auto& key : track.keys)
      if (key.t_s < track.keys.back().t_s) out.push_back(key.t_s);
  }
  for (int i = 1; i < count && length > 0; ++i) out.push_back(length * i / count);
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  if (out.size() > kMaxInstants) {
    std::vector<double> fewer;
    for (size_t i = 0; i < kMaxInstants; ++i) fewer.push_back(out[i * out.size() / kMaxInstants]);
    out = std::move(fewer);
  }
  return out;
}

Status validate(const Parameters& start, const Timeline& timeline) {
  if (timeline.empty()) return validate(start);
  for (const auto& track : timeline.tracks) {
    Parameters alone;
    const auto infos = parameter_infos();
    const auto info = std::find_if(infos.begin(), infos.end(), [&](const auto& i) { return i.name == track.name; });
    if (info == infos.end()) return set(alone, track.name, 0).error();  // lists the valid names
    if (!info->animates || info->whole) {
      std::string names;
      for (const auto& i : infos)
        if (i.animates && !i.whole) names += fmt::format("{}{}", names.empty() ? "" : ", ", i.name);
      return Error{fmt::format("{}: cannot be animated; these can: {}", track.name, names)};
    }
    for (const auto& key : track.keys)
      if (const Status s = set(alone, track.name, key.value); !s)
        return Error{fmt::format("animated to at {} s: {}", key.t_s, s.error().text)};
  }
  for (const double t : instants(timeline, kChecks))
    if (const auto p = parameters_at(start, timeline, t); !p)
      return Error{fmt::format("animated to at {:.4g} s: {}", t, p.error().text)};
  return ok_status();
}

AnimatedBounds animated_bounds(const Parameters& start, const Timeline& timeline,
                               const std::function<void(size_t, size_t)>& progress) {
  const auto times = instants(timeline, kBoxes);
  const auto lanes = size_t(usable_processors());
  AnimatedBounds out;
  for (size_t begin = 0; begin < times.size(); begin += lanes) {
    std::vector<std::future<geometry::DBox>> boxes;
    const size_t end = std::min(times.size(), begin + lanes);
    for (size_t i = begin; i < end; ++i) {
      const auto p = parameters_at(start, timeline, times[i]);
      CHECK(p.ok());
      boxes.push_back(std::async(std::launch::async, [p = *p] { return bounds(p); }));
    }
    for (size_t i = begin; i < end; ++i) {
      const auto box = boxes[i - begin].get();
      if (box.empty()) return {{}, times[i]};
      out.box.extend(box);
    }
    if (progress) progress(end, times.size());
  }
  return out;
}

}  // namespace telesplat::julia
