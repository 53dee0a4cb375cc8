// Colouring of a mesh in an epoch: an array of its file, a range of values, the colours between. The master sends it to
// all processes as the fact "colouring"; the run's record keeps it in epochs.csv; legends are drawn from it.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/colour/colour_map.h"
#include "common/scene/arrays.h"

namespace telesplat::scene {

inline constexpr size_t kMaxColouringText = 8000;           ///< bytes of the text form
inline constexpr double kMaxScalar = 1e300;                 ///< limit of both ends of a range
inline constexpr std::string_view kNoArray = "none";        ///< --colour-by none: the file's own colours
inline constexpr const char* kColouringFact = "colouring";  ///< absent or empty: the file's own colours
inline constexpr const char* kIsoFact = "iso";  ///< for an isosurface: "VALUE LO HI", LO and HI of its volume if known
inline constexpr const char* kArraysFact = "arrays";         ///< to_text() of the file's arrays
inline constexpr const char* kColourMapFact = "colour_map";  ///< colour::to_text(): map for arrays chosen later
/// Master -> data: "N ARRAY": prepare the chunks of this array (empty: of the file's colours); N counts orders.
inline constexpr const char* kArrayOrderFact = "array_order";
/// Data -> master: "N": they are ready; "N REASON": they cannot be made.
inline constexpr const char* kArrayAnswerFact = "array_answer";

struct Colouring {
  std::string array;      ///< "temperature", "velocity.x"; UTF-8
  std::string unit;       ///< empty: the file states none
  double lo = 0, hi = 1;  ///< the ends of the map; lo <= hi, equal only if the array has one value
  double origin = 0;      ///< chunks hold the array minus this: scalar_origin() of all its values
  colour::ColourMap map;  ///< 0 is lo, 1 is hi
  bool operator==(const Colouring&) const = default;
};

/// Writes JSON {"array", "unit", "lo", "hi", "origin", "map"}, with the map as in colour::to_text(); at most
/// kMaxColouringText. colouring_from_text reads the same from it, to the last bit.
std::string to_text(const Colouring& colouring);
/// Error: another form, too long, names that are not UTF-8, numbers that are not finite, an inverted range, no such
/// map.
Result<Colouring> colouring_from_text(std::string_view text);

/// Value of --colour-by and `ctl colour`: ARRAY[:MIN:MAX].
struct ColourBy {
  std::string array;       ///< empty: the file's colours
  bool has_range = false;  ///< false: the array's own range
  double lo = 0, hi = 0;
  bool operator==(const ColourBy&) const = default;
};
/// "none" and "" mean the file's colours. Text that does not end in two numbers is an array's name as a whole. Error:
/// MIN is not below MAX, or one of them is not finite.
Result<ColourBy> parse_colour_by(std::string_view text);

/// Completes the colouring that `by` describes. Error: no such array, or it has no finite values.
Result<Colouring> make_colouring(std::span<const ArrayInfo> arrays, const ColourBy& by, colour::ColourMap map);

/// Chunks hold arrays as 32-bit floats minus this: 0, or the smallest value if the values lie far from 0 and close to
/// each other (dates), so that floats resolve them.
double scalar_origin(const ValueSpan& span);
/// The value that chunks hold; NaN if `value` is not finite.
float stored_scalar(double value, double origin);

/// Colours of a range in kEntries equal steps, and the colour of missing values: samplers look them up. The entry is
/// rounded down and limited to [0, kEntries); if the range is empty, it is the middle one.
struct ColourTable {
  static constexpr int kEntries = 4096;
  float lo = 0, scale = 0, offset = 0;  ///< entry = (stored - lo) * scale + offset
  std::vector<uint32_t> colours;        ///< kEntries, then the colour of NaN

  /// 0x00RRGGBB of a stored scalar.
  uint32_t at(float stored) const {
    const float entry = (stored - lo) * scale + offset;
    if (!(entry == entry)) return colours[kEntries];
    return colours[entry < 0 ? 0 : entry < float(kEntries) ? size_t(entry) : size_t(kEntries - 1)];
  }
};
ColourTable make_table(const Colouring& colouring);

}  // namespace telesplat::scene
