// Inside services/data/cloud: points as rows of numbers, whose columns have names.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "services/data/cloud/cloud.h"
#include "services/data/cloud/reference.h"

namespace telesplat::data {

/// Number of columns, and of components of all fields.
inline constexpr size_t kMaxColumns = 256;

/// Meaning of a column's numbers.
enum class Column : uint8_t {
  kArray,  ///< a number that can colour the points
  kX,
  kY,
  kZ,
  kNormalX,
  kNormalY,
  kNormalZ,
  kRed,
  kGreen,
  kBlue,
  kPacked,  ///< 0x00RRGGBB
  kIgnored,
  kCount
};
/// Meaning of a column's name, in any case: "x", "nx", "normal_x", "red", "r", "rgb"; others are arrays.
Column column_named(std::string_view name);

/// Collects points row by row. Throws Refusal.
class PointRows {
 public:
  /// Columns of colours count only together, and so do those of normals: else they are arrays. array: colours the
  /// points; empty: no array. Error: no x, y or z, or no such array. name: for error texts.
  PointRows(const std::string& name, std::vector<std::string> columns, const std::string& array);

  void reserve(size_t points) { cloud_.points.positions.reserve(points); }
  /// Adds a point. row: as many numbers as there are columns.
  void add(std::span<const double> row);
  size_t size() const { return cloud_.points.positions.size(); }
  /// Points that follow were seen from here.
  void begin_scan(const glm::dvec3& scanner) { cloud_.scans.push_back({size(), scanner}); }
  /// Sets Mesh::frame, in the file's coordinates; a box that is damaged is left out.
  void set_frame(const geometry::DBox& box);
  void add_note(const std::string& note) { cloud_.points.notes.push_back(name_ + ": " + note); }

  /// Returns the cloud. Colours are the file's, judged by all of them; else its array `intensity` in grey.
  /// least_colour: as for RawColours::packed(). reference: the system of the coordinates, which become metres.
  std::shared_ptr<const SquareCloud> finish(const std::string& format, float least_colour,
                                            const std::optional<Reference>& reference = std::nullopt,
                                            bool z_up = false);

 private:
  bool has(Column first) const;  // it and the two behind it
  void set_colours(float least_colour);

  const std::string& name_;
  std::vector<Column> columns_;
  std::vector<int> arrays_of_;  // the array of each column; -1: it has none
  std::vector<scene::ArrayInfo> arrays_;
  int chosen_ = -1, intensity_ = -1;
  bool has_normals_ = false, has_colours_ = false, has_packed_ = false;
  std::vector<double> values_;      // those of the chosen array
  std::vector<float> intensities_;  // until there are colours
  std::vector<glm::vec3> colours_;
  Cloud cloud_;
};

/// One of several files that hold a cloud.
class Part {
 public:
  virtual ~Part() = default;
  virtual const std::vector<std::string>& columns() const = 0;
  /// Adds the points to rows of these columns; returns the number of those that are left out: withheld ones.
  virtual uint64_t add(PointRows& rows) const = 0;
};

/// Decodes a LAS file on this thread. It and its name, for error texts, live as long as the part. Throws Refusal.
std::unique_ptr<const Part> decode_las(std::string_view content, const std::string& name);

}  // namespace telesplat::data
