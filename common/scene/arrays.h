// The arrays of numbers that a mesh's file holds beside its shape: what `telesplat inspect` lists and a mesh can be
// coloured by.
#pragma once

#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.h"

namespace telesplat::scene {

inline constexpr size_t kMaxArrays = 256;        ///< told of a file
inline constexpr size_t kMaxArrayName = 256;     ///< bytes of a name or unit
inline constexpr int kMaxComponents = 9;         ///< that can be chosen one by one: a tensor's
inline constexpr size_t kMaxArraysText = 60000;  ///< bytes of to_text(): it travels as a fact

/// From the smallest to the largest finite value.
struct ValueSpan {
  double lo = std::numeric_limits<double>::infinity(), hi = -std::numeric_limits<double>::infinity();
  bool empty() const { return !(lo <= hi); }  ///< no finite value is known
  void add(double value);                     ///< widens it; values that are not finite change nothing
  bool operator==(const ValueSpan&) const = default;
};

struct ArrayInfo {
  std::string name;       ///< UTF-8, unique in its file: the second of a name has " (cell)" or " (2)" behind it
  std::string unit;       ///< empty: the file tells none
  bool of_cells = false;  ///< one value a face instead of one a vertex
  int components = 1;
  /// [0]: of the values, or of the vectors' lengths. Where there are several components, then one each, at most
  /// kMaxComponents.
  std::vector<ValueSpan> spans;
  std::string histogram;  ///< volume::to_text() of it; empty: it is not told
  bool operator==(const ArrayInfo&) const = default;
};

/// One array, or one component of it.
struct ArrayChoice {
  size_t index = 0;
  int component = -1;  ///< -1: the value, or the vector's length
  std::string name;    ///< "velocity", "velocity.x"
};

/// The array that `text` names: NAME, or NAME.x NAME.y NAME.z NAME[0] of a vector. A name that is there as a whole
/// comes first. Error: there is none; names those there are.
Result<ArrayChoice> choose_array(std::span<const ArrayInfo> arrays, std::string_view text);
/// Its finite values, as far as they are known.
ValueSpan span_of(std::span<const ArrayInfo> arrays, const ArrayChoice& choice);

/// Names that are UTF-8, not empty, not too long and unique; no more arrays than kMaxArrays, or than to_text() holds in
/// kMaxArraysText. The others are left out.
void make_tellable(std::vector<ArrayInfo>& arrays);

/// JSON: [{"name", "unit", "cells", "components", "spans": [[lo, hi] or null, ...], "histogram" if
/// there is one}, ...]. Precondition: make_tellable().
std::string to_text(std::span<const ArrayInfo> arrays);
/// Empty text: none. Error: no such text, a limit.
Result<std::vector<ArrayInfo>> arrays_from_text(std::string_view text);

}  // namespace telesplat::scene
