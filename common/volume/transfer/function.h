// Transfer functions: colour and opacity for each value of a voxel. From presets, ParaView's JSON files or points on
// the command line; one text form, for messages and records.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.h"
#include "common/volume/levels.h"

namespace telesplat::volume {

inline constexpr size_t kMaxTransferPoints = 1024;
inline constexpr size_t kMaxTransferText = 4000;  ///< bytes of the text form: it is sent in one string of a message
inline constexpr double kMaxTransferValue = 1e30;

/// Linear between points, constant outside the first and last. Several points at one value make a jump; the last one
/// holds at that value.
struct TransferFunction {
  struct Point {
    double value = 0;           ///< in the data's own units
    float r = 1, g = 1, b = 1;  ///< 0 to 1
    float opacity = 0;          ///< 0 to 1: opacity of a path of Grid::unit_m() through voxels of this value
    bool operator==(const Point&) const = default;
  };
  std::vector<Point> points;  ///< at least one, values ascending
  bool operator==(const TransferFunction&) const = default;

  Point at(double value) const;
};

/// Figures of the values, for presets that are relative to them.
struct ValueRange {
  double lo = 0, hi = 1;  ///< smallest and largest value (finite ones)
  double typical_lo = 0,
         typical_hi = 1;    ///< range of most values beyond the background: percentiles, services/data/volume/slices.h
  bool hounsfield = false;  ///< a CT in Hounsfield units: presets then use absolute values
  bool operator==(const ValueRange&) const = default;
};

struct TransferPreset {
  std::string_view name, text;  ///< text: one line for people
};
/// bone, skin, ct-angio, mr, fire, and others that look good; the first is the default for unknown data.
std::span<const TransferPreset> transfer_presets();
/// Error: no such preset; lists the valid names.
Result<TransferFunction> transfer_preset(std::string_view name, const ValueRange& range);
/// Name of the default preset for data of this range.
std::string_view fitting_preset(const ValueRange& range);

/// "value:colour:opacity, ..." such as "0:#000000:0, 80:#ff8800:0.1, 255:#ffffff:0.9"; values may be percentages of
/// [lo, hi] ("30%"), colours three numbers from 0 to 1 ("1/0.5/0"). Error: a point has another form; as validate(); a
/// text over kMaxTransferText.
Result<TransferFunction> parse_transfer(std::string_view text, const ValueRange& range);
/// Writes the text form with absolute values; parse_transfer reads the same function from it, to the last bit.
std::string to_text(const TransferFunction& transfer);
/// Reads a ParaView colour-map JSON file's content: RGBPoints with Points (opacity), or without (opacity rises over the
/// range). name: for errors. Takes the map called `wanted`, or the first. A map from 0 (or -1) to 1 is stretched over
/// [lo, hi] if that is wider than 2. Drops the least important points if kMaxTransferText cannot hold all.
Result<TransferFunction> parse_paraview_json(std::string_view content, const std::string& name, const ValueRange& range,
                                             std::string_view wanted = {});
/// Keeps as many of the points as a text of `max_bytes` holds, chosen so that the function changes least; all of them
/// if they fit.
TransferFunction shortened(const TransferFunction& transfer, size_t max_bytes);
/// Writes it as ParaView's JSON, one colour map called `name` with Points and RGBPoints, which ParaView and
/// parse_paraview_json read.
std::string to_paraview_json(const TransferFunction& transfer, std::string_view name);
/// Reads a user's text: FILE.json or FILE.json:NAME, points (they have a ':'), or a preset's name.
Result<TransferFunction> resolve_transfer(const std::string& text, const ValueRange& range);

/// Refuses no points, too many, values beyond kMaxTransferValue or not ascending, colours or opacities outside [0, 1].
Status validate(const TransferFunction& transfer);

/// Colour and extinction of every level, computed once an epoch.
struct LevelColour {
  float r = 0, g = 0, b = 0;
  /// Per Grid::unit_m(): -log(1 - opacity), opacity at most kMaxOpacity. Below kLeastOpacity it is 0: the voxel is
  /// transparent and never sent.
  float extinction = 0;
};
inline constexpr float kMaxOpacity = 0.9999f;
inline constexpr float kLeastOpacity = 1e-4f;  ///< 256 such voxels in a row hide 2.5 % of the background
/// Converts an opacity to LevelColour::extinction.
float extinction(float opacity);
std::vector<LevelColour> level_colours(const TransferFunction& transfer, const Levels& levels);

}  // namespace telesplat::volume
