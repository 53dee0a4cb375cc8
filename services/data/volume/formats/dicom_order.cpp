#include "services/data/volume/formats/dicom.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <glm/geometric.hpp>
#include <set>
#include <tuple>

namespace telesplat::data {
namespace {

using Slices = std::vector<DicomSlice>;
using Place = std::vector<size_t>;  // slices at the same height, ordered by time

constexpr size_t kMostKinds = 64;    // slices of further kinds are left out
constexpr double kSamePlace = 1e-3;  // in pixels
constexpr double kEven = 0.1;        // in distances of slices: largest shift of a slice without resampling
constexpr double kSilentlyEven = 0.01;
constexpr double kSilentlyTilted = 0.5;  // degrees

std::string name_of(const DicomSlice& s) {
  const std::string file = std::filesystem::path(s.path).filename().string();
  return s.frames > 1 ? fmt::format("frame {} of {}", s.frame + 1, file) : file;
}

std::string counted(size_t n, const char* what) { return fmt::format("{} {}{}", n, what, n == 1 ? "" : "s"); }

bool is_localizer(const DicomSlice& s) { return s.image_type.find("LOCALIZER") != std::string::npos; }

bool same_kind(const DicomSlice& a, const DicomSlice& b) {
  if (a.plane.stacked && b.plane.stacked && a.path != b.path) return false;
  return a.pixels.rows == b.pixels.rows && a.pixels.columns == b.pixels.columns && is_localizer(a) == is_localizer(b) &&
         a.plane.is_like(b.plane);
}

std::string why_other(const DicomSlice& s, const DicomSlice& taken) {
  if (is_localizer(s) && !is_localizer(taken)) return "a localizer";
  if (s.pixels.rows != taken.pixels.rows || s.pixels.columns != taken.pixels.columns)
    return fmt::format("of {} x {} pixels instead of {} x {}", s.pixels.columns, s.pixels.rows, taken.pixels.columns,
                       taken.pixels.rows);
  return s.plane.stacked ? "another file of frames" : "turned, spaced or placed otherwise";
}

// Returns the largest group of slices that can make one volume.
Slices most_alike(Slices all, std::string& remark) {
  std::vector<Slices> kinds;
  Slices others;
  for (DicomSlice& s : all) {
    const auto kind = std::find_if(kinds.begin(), kinds.end(), [&](auto& k) { return same_kind(s, k.front()); });
    if (kind != kinds.end())
      kind->push_back(std::move(s));
    else if (kinds.size() < kMostKinds)
      kinds.push_back({std::move(s)});
    else
      others.push_back(std::move(s));
  }
  const auto rank = [](const Slices& k) { return std::pair(!is_localizer(k.front()), k.size()); };
  const auto taken = std::max_element(kinds.begin(), kinds.end(), [&](auto& a, auto& b) { return rank(a) < rank(b); });
  for (Slices& kind : kinds)
    if (&kind != &*taken)
      say(remark, fmt::format("left out {}: {} ({})", counted(kind.size(), "slice"),
                              why_other(kind.front(), taken->front()), name_of(kind.front())));
  if (!others.empty()) say(remark, fmt::format("left out {} of other kinds", counted(others.size(), "slice")));
  return std::move(*taken);
}

// Removes copies, by their UIDs; the first one stays.
void drop_copies(Slices& slices, std::string& remark) {
  std::set<std::pair<std::string, int>> seen;
  const auto copies = std::stable_partition(slices.begin(), slices.end(), [&](const DicomSlice& s) {
    return s.uid.empty() || seen.insert({s.uid, s.frame}).second;
  });
  if (copies == slices.end()) return;
  say(remark, fmt::format("left out {} that are there twice ({})", counted(size_t(slices.end() - copies), "slice"),
                          name_of(*copies)));
  slices.erase(copies, slices.end());
}

bool earlier(const DicomSlice& a, const DicomSlice& b) {
  return std::tie(a.times, a.instance, a.path, a.frame) < std::tie(b.times, b.instance, b.path, b.frame);
}

// Groups slices by ascending height; without positions each slice has its own place.
std::vector<Place> places_of(const Slices& slices) {
  const glm::dvec3 normal = slices.front().plane.normal();
  std::vector<std::pair<double, size_t>> by_height;
  for (size_t i = 0; i < slices.size(); ++i)
    by_height.emplace_back(slices[i].plane.position ? glm::dot(*slices[i].plane.position, normal) : 0, i);
  std::stable_sort(by_height.begin(), by_height.end(), [&](auto& a, auto& b) {
    const DicomSlice &s = slices[a.second], &t = slices[b.second];
    return s.plane.position ? a.first < b.first : std::tie(s.instance, s.frame) < std::tie(t.instance, t.frame);
  });
  std::vector<Place> places;
  double height = 0;
  for (const auto& [h, i] : by_height) {
    const bool same =
        !places.empty() && slices[i].plane.position && h - height <= kSamePlace * slices[i].plane.spacing.x;
    if (!same) places.emplace_back(), height = h;
    places.back().push_back(i);
  }
  for (Place& p : places)
    std::sort(p.begin(), p.end(), [&](size_t a, size_t b) { return earlier(slices[a], slices[b]); });
  return places;
}

bool equally_many(const std::vector<Place>& places) {
  return std::all_of(places.begin(), places.end(), [&](auto& p) { return p.size() == places[0].size(); });
}

std::string told_apart_by(const Slices& slices, const Place& place) {
  const DicomSlice &a = slices[place[0]], &b = slices[place[1]];
  for (size_t i = 0; i < a.times.size(); ++i)
    if (a.times[i] != b.times[i]) return kDicomTimes[i];
  return "number";
}

// Sorts out places with several slices: copies, time steps, or neither.
void sort_out(const Slices& slices, std::vector<Place>& places,
              const std::function<bool(const DicomSlice&, const DicomSlice&)>& same_pixels, std::string& remark) {
  const auto several = [](const Place& p) { return p.size() > 1; };
  if (std::none_of(places.begin(), places.end(), several)) return;
  std::vector<Place> once = places;
  size_t copies = 0;
  for (Place& p : once) {
    const auto end =
        std::unique(p.begin(), p.end(), [&](size_t a, size_t b) { return same_pixels(slices[a], slices[b]); });
    copies += size_t(p.end() - end);
    p.erase(end, p.end());
  }
  // Time steps may have equal slices (air), so copies are removed only if each place then has as many slices.
  if (copies > 0 && equally_many(once)) {
    say(remark, fmt::format("left out {} with the pixels of others at their place", counted(copies, "slice")));
    places = std::move(once);
  }
  if (std::none_of(places.begin(), places.end(), several)) return;
  const auto first = std::find_if(places.begin(), places.end(), several);
  const std::string by = told_apart_by(slices, *first);
  if (equally_many(places)) {
    say(remark, fmt::format("{} at each place, told apart by {}: time steps", counted(first->size(), "slice"), by));
    return;
  }
  size_t left_out = 0;
  for (Place& p : places) left_out += p.size() - 1, p.resize(1);
  say(remark, fmt::format("left out {} at places that others have, but not all places have as many ({}, by {})",
                          counted(left_out, "slice"), name_of(slices[first->front()]), by));
}

// Positions of slices on a grid whose layers are the whole numbers.
using GridPlaces = std::vector<double>;

std::vector<DicomLayer> layers_at(const GridPlaces& at) {
  std::vector<DicomLayer> out;
  size_t k = 0;
  for (double n = 0; n <= std::round(at.back()); ++n) {
    while (k + 1 < at.size() && at[k + 1] <= n + kSilentlyEven) ++k;
    const size_t above = std::min(k + 1, at.size() - 1);
    const double share = above > k ? (n - at[k]) / (at[above] - at[k]) : 0;
    out.push_back(share < kSilentlyEven ? DicomLayer{k, k, 0} : DicomLayer{k, above, share});
  }
  return out;
}

// Returns the largest shift of a slice from its place on the grid, in distances of layers.
double unevenness(const std::vector<double>& heights, const GridPlaces& at) {
  const double distance = (heights.back() - heights.front()) / at.back();
  double most = 0;
  for (size_t k = 0; k < heights.size(); ++k)
    most = std::max(most, std::abs((heights[k] - heights[0]) / distance - at[k]));
  return most;
}

GridPlaces grid_of(const std::vector<double>& heights, const std::function<std::string(size_t)>& name,
                   std::string& remark) {
  std::vector<double> gaps;
  for (size_t k = 1; k < heights.size(); ++k) gaps.push_back(heights[k] - heights[k - 1]);
  const auto by_gaps = [&](auto&& count) {
    GridPlaces at{0};
    for (const double gap : gaps) at.push_back(at.back() + count(gap));
    return at;
  };
  std::vector<double> sorted = gaps;
  std::sort(sorted.begin(), sorted.end());
  const double least = sorted.front(), most = sorted.back(), usual = sorted[(sorted.size() - 1) / 2];
  GridPlaces at = by_gaps([](double) { return 1; });
  if (unevenness(heights, at) <= kEven) {
    if (most > (1 + kSilentlyEven) * least)
      say(remark, fmt::format("slices are {:.4g} to {:.4g} mm apart and were evened", least, most));
    return at;
  }
  const double extent = heights.back() - heights.front(), most_layers = 4.0 * double(heights.size()) + 64;
  at = by_gaps([&](double gap) { return std::max(1.0, std::round(gap / usual)); });
  if (at.back() < most_layers && unevenness(heights, at) <= kEven) {
    std::string where;
    size_t named = 0;
    for (size_t k = 0; k + 1 < at.size(); ++k)
      if (at[k + 1] - at[k] > 1 && named++ < 3)
        where +=
            fmt::format("{}{} between {} and {}", named > 1 ? ", " : "", at[k + 1] - at[k] - 1, name(k), name(k + 1));
    say(remark, fmt::format("{}, {:.4g} mm apart, mixed from neighbours: {}{}",
                            counted(size_t(at.back()) + 1 - at.size(), "missing slice"), extent / at.back(), where,
                            named > 3 ? ", ..." : ""));
    return at;
  }
  const double distance = extent / std::round(extent / std::max(least, extent / most_layers));
  say(remark, fmt::format("slices are {:.4g} to {:.4g} mm apart; resampled to {:.4g} mm", least, most, distance));
  return by_gaps([&](double gap) { return gap / distance; });
}

// Computes the offset from one layer to the next from the positions; it may be askew (gantry tilt).
void place(DicomOrder& out, const std::vector<Place>& places, double distance) {
  const DicomSlice &first = out.slices[places.front()[0]], &last = out.slices[places.back()[0]];
  const glm::dvec3 normal = first.plane.normal(), way = *last.plane.position - *first.plane.position;
  out.step = way * (distance / glm::dot(way, normal));
  const double tilt = std::acos(std::min(1.0, distance / glm::length(out.step))) * 180 / M_PI;
  if (tilt > kSilentlyTilted)
    say(out.remark, fmt::format("slices are askew by {:.3g} degrees (gantry tilt), and shown so", tilt));
}

}  // namespace

DicomOrder order_slices(Slices slices, const std::function<bool(const DicomSlice&, const DicomSlice&)>& same_pixels) {
  DicomOrder out;
  out.slices = most_alike(std::move(slices), out.remark);
  drop_copies(out.slices, out.remark);
  std::vector<Place> places = places_of(out.slices);
  sort_out(out.slices, places, same_pixels, out.remark);
  const DicomSlice first = out.slices[places.front()[0]];
  const DicomPlane& plane = first.plane;
  const double said = plane.slice_spacing > 0 ? plane.slice_spacing : plane.thickness > 0 ? plane.thickness : 1;
  out.origin = plane.position.value_or(glm::dvec3(0));
  out.step = plane.normal() * said;
  GridPlaces at;
  for (size_t k = 0; k < places.size(); ++k) at.push_back(double(k));
  if (plane.position && places.size() > 1) {
    std::vector<double> heights;
    for (const Place& p : places) heights.push_back(glm::dot(*out.slices[p[0]].plane.position, plane.normal()));
    at = grid_of(
        heights, [&](size_t k) { return name_of(out.slices[places[k][0]]); }, out.remark);
    place(out, places, (heights.back() - heights.front()) / at.back());
  }
  if (places.size() > 1 && (!plane.position || plane.stacked))
    say(out.remark, fmt::format("{} of no position of their own are stacked {:.4g} mm apart",
                                counted(places.size(), first.frames > 1 ? "frame" : "slice"), glm::length(out.step)));
  Slices used;
  for (Place& p : places)
    for (size_t& i : p) used.push_back(std::move(out.slices[i])), i = used.size() - 1;
  out.slices = std::move(used);
  for (size_t t = 0; t < places[0].size(); ++t) {
    out.steps.emplace_back();
    for (const DicomLayer& l : layers_at(at))
      out.steps.back().push_back({places[l.below][t], places[l.above][t], l.share});
  }
  return out;
}

}  // namespace telesplat::data
