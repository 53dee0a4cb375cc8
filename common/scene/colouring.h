// What a mesh is coloured by in an epoch: an array of its file, the range that counts, the colours between. The master
// tells everyone as the fact "colouring", the run's record keeps it in epochs.csv, legends are drawn from it.
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
inline constexpr double kMaxScalar = 1e300;                 ///< of either end of a range
inline constexpr std::string_view kNoArray = "none";        ///< --colour-by none: the file's own colours
inline constexpr const char* kColouringFact = "colouring";  ///< absent or empty: the file's own colours
inline constexpr const char* kIsoFact = "iso";  ///< of an isosurface: "VALUE LO HI", LO and HI of its volume if known
inline constexpr const char* kArraysFact = "arrays";         ///< to_text() of the file's arrays
inline constexpr const char* kColourMapFact = "colour_map";  ///< colour::to_text(): of arrays that are chosen later
/// Master -> data: "N ARRAY", have the chunks of this array (empty: of the file's colours) ready; N counts orders.
inline constexpr const char* kArrayOrderFact = "array_order";
/// Data -> master: "N": they are; "N REASON": they cannot be had.
inline constexpr const char* kArrayAnswerFact = "array_answer";

struct Colouring {
  std::string array;      ///< "temperature", "velocity.x"; UTF-8
  std::string unit;       ///< empty: the file tells none
  double lo = 0, hi = 1;  ///< the ends of the map; lo <= hi, equal only if the array has one value
  double origin = 0;      ///< what chunks hold is the array minus this: scalar_origin() of all its values
  colour::ColourMap map;  ///< 0 is lo, 1 is hi
  bool operator==(const Colouring&) const = default;
};

/// JSON {"array", "unit", "lo", "hi", "origin", "map"}, the map as colour::to_text() has it; at most kMaxColouringText.
/// from_text of it gives the same again, to the last bit.
std::string to_text(const Colouring& colouring);
/// Error: no such text, too long, names that are no UTF-8, numbers that are not finite, a range upside down, no such
/// map.
Result<Colouring> colouring_from_text(std::string_view text);

/// What --colour-by and `ctl colour` take: ARRAY[:MIN:MAX].
struct ColourBy {
  std::string array;       ///< empty: none
  bool has_range = false;  ///< else the array's own
  double lo = 0, hi = 0;
  bool operator==(const ColourBy&) const = default;
};
/// "none" and "" are none. Text that does not end in two numbers is an array's name as a whole. Error: MIN is not below
/// MAX, or one of them is not finite.
Result<ColourBy> parse_colour_by(std::string_view text);

/// The colouring that this comes to. Error: no such array, it has no finite values.
Result<Colouring> make_colouring(std::span<const ArrayInfo> arrays, const ColourBy& by, colour::ColourMap map);

/// Chunks hold arrays as 32-bit floats minus this: 0, or the smallest value where the values lie far from 0 and close
/// to each other (dates), so that floats tell them apart.
double scalar_origin(const ValueSpan& span);
/// As chunks hold it; NaN where the value is not finite.
float stored_scalar(double value, double origin);

/// Colours of a range in kEntries equal steps, and the one of values that are missing: what samplers look up.
/// entry = floor((stored - lo) * scale), kept in [0, kEntries); where the range is empty, the one in the middle.
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
