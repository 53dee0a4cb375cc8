#include "services/data/cloud/point_rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/scene/colouring.h"
#include "services/data/base/raw_colours.h"
#include "services/data/base/refusal.h"
#include "services/data/base/text_scanner.h"

namespace telesplat::data {
namespace {

// Colours in grey, from the 2nd to the 98th of 100 values.
std::vector<uint32_t> greys(const std::vector<float>& values) {
  std::vector<float> sorted;
  for (size_t i = 0; i < values.size(); i += std::max<size_t>(values.size() / 100'000, 1))
    if (std::isfinite(values[i])) sorted.push_back(values[i]);
  std::sort(sorted.begin(), sorted.end());
  if (sorted.empty() || sorted.front() == sorted.back()) return {};
  float lo = sorted[sorted.size() * 2 / 100], hi = sorted[sorted.size() * 98 / 100];
  if (lo == hi) lo = sorted.front(), hi = sorted.back();
  std::vector<uint32_t> out;
  out.reserve(values.size());
  for (const float v : values) {
    const float at = std::isfinite(v) ? std::clamp((v - lo) / (hi - lo), 0.0f, 1.0f) : 0.0f;
    const auto grey = uint32_t(40 + 215 * at);
    out.push_back(pack_rgb(grey, grey, grey));
  }
  return out;
}

constexpr double kPi = 3.14159265358979323846;

// Brings the points into metres, as elevation rasters are.
void apply(const Reference& reference, const std::string& name, Mesh& points) {
  points.coordinates = reference.coordinates;
  points.notes.insert(points.notes.end(), reference.notes.begin(), reference.notes.end());
  for (std::string& note : points.notes)
    if (!note.starts_with(name)) note = name + ": " + note;
  glm::dvec3& shown = points.coordinates.shown;
  if (reference.coordinates.space == scene::Space::kGeographic) {
    geometry::DBox box;
    for (const glm::dvec3& p : points.positions) box.extend(p);
    const double latitude = points.positions.empty() ? 0 : (box.lo.y + box.hi.y) / 2 * kPi / 180;
    shown.x = 111'320 * std::max(std::cos(latitude), 0.01), shown.y = 110'574;
  }
  points.coordinates.lengths = shown;
  if (points.frame) points.frame->lo *= shown, points.frame->hi *= shown;
  if (shown == glm::dvec3(1)) return;
  for (glm::dvec3& p : points.positions) p *= shown;
}

}  // namespace

Column column_named(std::string_view name) {
  constexpr std::string_view kNames[] = {"",
                                         "|x|",
                                         "|y|",
                                         "|z|",
                                         "|nx|normal_x|normalx|",
                                         "|ny|normal_y|normaly|",
                                         "|nz|normal_z|normalz|",
                                         "|red|r|",
                                         "|green|g|",
                                         "|blue|b|",
                                         "|rgb|rgba|",
                                         "|_|"};
  static_assert(std::size(kNames) == size_t(Column::kCount));
  const std::string word = '|' + lower(name) + '|';
  for (size_t i = 1; i < std::size(kNames); ++i)
    if (kNames[i].find(word) != word.npos) return Column(i);
  return Column::kArray;
}

PointRows::PointRows(const std::string& name, std::vector<std::string> columns, const std::string& array)
    : name_(name) {
  for (const std::string& column : columns) {
    const Column meaning = column_named(column);
    const bool again = meaning != Column::kArray && meaning != Column::kIgnored &&
                       std::count(columns_.begin(), columns_.end(), meaning) > 0;
    columns_.push_back(again ? Column::kArray : meaning);
  }
  if (!has(Column::kX)) refuse("{}: its points lack x, y or z", name);
  has_normals_ = has(Column::kNormalX), has_colours_ = has(Column::kRed);
  has_packed_ = !has_colours_ && std::count(columns_.begin(), columns_.end(), Column::kPacked) > 0;
  for (size_t i = 0; i < columns_.size(); ++i) {
    Column& c = columns_[i];
    if ((!has_normals_ && c >= Column::kNormalX && c <= Column::kNormalZ) ||
        (!has_colours_ && c >= Column::kRed && c <= Column::kBlue) || (!has_packed_ && c == Column::kPacked))
      c = Column::kArray;
    arrays_of_.push_back(c == Column::kArray ? int(arrays_.size()) : -1);
    if (c != Column::kArray) continue;
    if (lower(columns[i]) == "intensity" && intensity_ < 0) intensity_ = int(i);
    arrays_.push_back({columns[i], "", false, 1, {scene::ValueSpan{}}});
  }
  scene::make_tellable(arrays_);
  for (int& of : arrays_of_)  // columns beyond the limit have no array
    if (of >= int(arrays_.size())) of = -1;
  if (array.empty()) return;
  const auto choice = scene::choose_array(arrays_, array);
  if (!choice) refuse("{}: {}", name, choice.error().text);
  chosen_ = int(choice->index);
}

bool PointRows::has(Column first) const {
  for (int k = 0; k < 3; ++k)
    if (std::count(columns_.begin(), columns_.end(), Column(int(first) + k)) == 0) return false;
  return true;
}

void PointRows::add(std::span<const double> row) {
  std::array<double, size_t(Column::kCount)> of{};
  for (size_t i = 0; i < row.size(); ++i) {
    of[size_t(columns_[i])] = row[i];
    if (const int array = arrays_of_[i]; array >= 0) {
      arrays_[size_t(array)].spans[0].add(row[i]);
      if (array == chosen_) values_.push_back(row[i]);
    }
  }
  const auto three = [&](Column first) { return &of[size_t(first)]; };
  const double *p = three(Column::kX), *n = three(Column::kNormalX), *c = three(Column::kRed);
  if (size() == kMaxPoints) refuse("{}: more than {} points", name_, kMaxPoints);
  cloud_.points.positions.emplace_back(p[0], p[1], p[2]);
  if (has_normals_) cloud_.points.normals.emplace_back(n[0], n[1], n[2]);
  if (has_colours_) colours_.emplace_back(c[0], c[1], c[2]);
  const double packed = of[size_t(Column::kPacked)];
  if (has_packed_) cloud_.points.colours.push_back(std::abs(packed) < 1e15 ? uint32_t(int64_t(packed)) & 0xffffff : 0);
  if (intensity_ >= 0 && !has_packed_) intensities_.push_back(float(row[size_t(intensity_)]));
}

void PointRows::set_frame(const geometry::DBox& box) {
  const glm::dvec3 size = box.size();
  if (size.x >= 0 && size.y >= 0 && size.z >= 0 && std::isfinite(size.x + size.y + size.z)) cloud_.points.frame = box;
}

void PointRows::set_colours(float least_colour) {
  Mesh& points = cloud_.points;
  const bool dark = std::all_of(colours_.begin(), colours_.end(), [](const glm::vec3& c) { return c == glm::vec3(0); });
  if (has_colours_ && !dark) {
    RawColours raw;
    for (const glm::vec3& c : colours_) raw.add(c);
    points.colours = raw.packed(kNeutralAlbedo, least_colour);
  } else if (!has_packed_) {
    points.colours = greys(intensities_);
    if (!points.colours.empty())
      add_note(
          fmt::format("has {}; its intensity is shown in grey", has_colours_ ? "black colours alone" : "no colours"));
  }
  colours_ = {}, intensities_ = {};
}

std::shared_ptr<const SquareCloud> PointRows::finish(const std::string& format, float least_colour,
                                                     const std::optional<Reference>& reference, bool z_up) {
  Mesh& points = cloud_.points;
  points.format = format;
  set_colours(least_colour);
  if (chosen_ >= 0) {
    const double origin = scene::scalar_origin(arrays_[size_t(chosen_)].spans[0]);
    for (const double v : values_) points.scalars.push_back(scene::stored_scalar(v, origin));
    values_ = {};
  }
  points.arrays = std::move(arrays_);
  cloud_.z_up = z_up;
  if (reference) apply(*reference, name_, points);
  return need(SquareCloud::make(std::move(cloud_), name_));
}

}  // namespace telesplat::data
