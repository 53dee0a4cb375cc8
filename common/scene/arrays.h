// The arrays of numbers that a mesh's file holds beside its shape: `telesplat inspect` lists them, and one can colour
// the mesh.
#pragma once

#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.h"

namespace telesplat::scene {

inline constexpr size_t kMaxArrays = 256;        ///< listed of a file
inline constexpr size_t kMaxArrayName = 256;     ///< bytes of a name or unit
inline constexpr int kMaxComponents = 9;         ///< components that can be chosen one by one: a tensor's
inline constexpr size_t kMaxArraysText = 60000;  ///< bytes of to_text(): it is sent as a fact

/// From the smallest to the largest finite value.
struct ValueSpan {
  double lo = std::numeric_limits<double>::infinity(), hi = -std::numeric_limits<double>::infinity();
  bool empty() const { return !(lo <= hi); }  ///< no finite value is known
  void add(double value);                     ///< widens the span; ignores values that are not finite
  bool operator==(const ValueSpan&) const = default;
};

struct ArrayInfo {
  std::string name;       ///< UTF-8, unique in its file: the second of a name has " (cell)" or " (2)" behind it
  std::string unit;       ///< empty: the file states none
  bool of_cells = false;  ///< one value a face instead of one a vertex
  int components = 1;
  /// [0]: of the values, or of the vectors' lengths. If there are several components, one more for each, at most
  /// kMaxComponents.
  std::vector<ValueSpan> spans;
  std::string histogram;  ///< volume::to_text() of it; empty: not known
  bool operator==(const ArrayInfo&) const = default;
};

/// One array, or one component of it.
struct ArrayChoice {
  size_t index = 0;
  int component = -1;  ///< -1: the value, or the vector's length
  std::string name;    ///< "velocity", "velocity.x"
};

/// Finds the array that `text` names: NAME, or NAME.x NAME.y NAME.z NAME[0] of a vector. An array with exactly this
/// name comes first. Error: no such array; lists the valid names.
Result<ArrayChoice> choose_array(std::span<const ArrayInfo> arrays, std::string_view text);
/// Span of its finite values, as far as known.
ValueSpan span_of(std::span<const ArrayInfo> arrays, const ArrayChoice& choice);

/// Makes names valid UTF-8, not empty, not too long and unique. Leaves out arrays beyond kMaxArrays, and those
/// for which to_text() has no room in kMaxArraysText.
void make_tellable(std::vector<ArrayInfo>& arrays);

/// Writes JSON: [{"name", "unit", "cells", "components", "spans": [[lo, hi] or null, ...], "histogram" if known}, ...].
/// Precondition: make_tellable().
std::string to_text(std::span<const ArrayInfo> arrays);
/// Empty text: no arrays. Error: another form, a limit.
Result<std::vector<ArrayInfo>> arrays_from_text(std::string_view text);

}  // namespace telesplat::scene
