#include <fmt/format.h>

#include <algorithm>

#include "common/volume/transfer/function.h"

namespace telesplat::volume {
namespace {

struct PresetPoint {
  double at;  // Hounsfield units, or 0 = typical_lo to 1 = typical_hi
  uint32_t rgb;
  float opacity;
};

// For CTs in Hounsfield units (air -1000, water 0, muscle 50, contrast agent in vessels 150 to 500, dense bone 1000 and
// more).
constexpr PresetPoint kBoneHu[] = {{-3024, 0x3a2418, 0},  {140, 0x5a3420, 0},     {260, 0xb87848, 0.08f},
                                   {450, 0xe8c898, 0.3f}, {900, 0xfff4e0, 0.75f}, {3071, 0xffffff, 0.9f}};
constexpr PresetPoint kSkinHu[] = {{-3024, 0x8a5a48, 0},    {-600, 0x8a5a48, 0},    {-350, 0xd89a7c, 0.12f},
                                   {-150, 0xecb898, 0.25f}, {60, 0xd8846c, 0.25f},  {200, 0xf0d8b8, 0.45f},
                                   {500, 0xfff4e0, 0.8f},   {3071, 0xffffff, 0.95f}};
constexpr PresetPoint kCtAngioHu[] = {{-3024, 0x200000, 0},  {110, 0x400800, 0},     {170, 0xa81810, 0.1f},
                                      {300, 0xe84830, 0.4f}, {450, 0xf0b090, 0.45f}, {800, 0xffecd0, 0.7f},
                                      {3071, 0xffffff, 0.9f}};

// For any data: relative to the range of the values beyond the background. They begin above 0, so that the background's
// noise stays transparent.
constexpr PresetPoint kPlain[] = {{0.12, 0x284868, 0},     {0.2, 0x3868a0, 0.015f}, {0.38, 0x58a898, 0.07f},
                                  {0.65, 0xe0b860, 0.25f}, {1, 0xf8f0e0, 0.6f},     {1.6, 0xffffff, 0.85f}};
constexpr PresetPoint kBone[] = {
    {0.3, 0x5a3420, 0}, {0.5, 0xb87848, 0.08f}, {0.8, 0xe8c898, 0.35f}, {1.2, 0xfff4e0, 0.8f}};
constexpr PresetPoint kSkin[] = {{0.03, 0x8a5a48, 0},   {0.15, 0xd89a7c, 0.12f}, {0.35, 0xecb898, 0.25f},
                                 {0.7, 0xd8846c, 0.3f}, {1, 0xf0d8b8, 0.6f},     {1.5, 0xffffff, 0.9f}};
constexpr PresetPoint kCtAngio[] = {
    {0.15, 0x400800, 0}, {0.35, 0xa81810, 0.06f}, {0.7, 0xe84830, 0.35f}, {1, 0xf0b090, 0.6f}, {1.5, 0xffecd0, 0.9f}};
constexpr PresetPoint kMr[] = {{0.04, 0x281c18, 0},    {0.15, 0x683c30, 0.01f}, {0.4, 0xb07860, 0.06f},
                               {0.7, 0xd8b8a4, 0.22f}, {1, 0xf0e8e0, 0.5f},     {1.5, 0xffffff, 0.8f}};
constexpr PresetPoint kFire[] = {{0.05, 0x200008, 0},   {0.15, 0x580818, 0.02f}, {0.35, 0xb02010, 0.07f},
                                 {0.6, 0xf88010, 0.2f}, {0.85, 0xffd848, 0.45f}, {1.1, 0xffffe0, 0.8f}};
constexpr PresetPoint kGrey[] = {{0.02, 0x000000, 0}, {1, 0xffffff, 0.5f}};

struct Preset {
  std::span<const PresetPoint> relative, hounsfield;  // hounsfield: empty if `relative` serves both
};
constexpr TransferPreset kPresets[] = {
    {"plain", "blue mist over green and amber to white: for data nobody knows"},
    {"bone", "bone, flesh left out"},
    {"skin", "skin and flesh, bone shining through"},
    {"ct-angio", "vessels with contrast agent in red, bone in ivory"},
    {"mr", "magnetic resonance: flesh as mist, what is bright as surfaces"},
    {"fire", "black to red, yellow and white: flames, fuel"},
    {"grey", "black to white, opacity as the value"},
};
constexpr Preset kPoints[] = {{kPlain, {}}, {kBone, kBoneHu}, {kSkin, kSkinHu}, {kCtAngio, kCtAngioHu},
                              {kMr, {}},    {kFire, {}},      {kGrey, {}}};
static_assert(std::size(kPresets) == std::size(kPoints));

}  // namespace

std::span<const TransferPreset> transfer_presets() { return kPresets; }

Result<TransferFunction> transfer_preset(std::string_view name, const ValueRange& range) {
  const auto found =
      std::find_if(std::begin(kPresets), std::end(kPresets), [&](const TransferPreset& p) { return p.name == name; });
  if (found == std::end(kPresets)) {
    std::string names;
    for (const auto& p : kPresets) names += fmt::format("{}{}", names.empty() ? "" : ", ", p.name);
    return Error{fmt::format(
        "transfer function: \"{}\" is no preset (there are {}), no points value:colour:opacity and no .json file",
        name.substr(0, 80), names)};
  }
  const Preset& preset = kPoints[found - std::begin(kPresets)];
  const bool absolute = range.hounsfield && !preset.hounsfield.empty();
  TransferFunction out;
  for (const PresetPoint& p : absolute ? preset.hounsfield : preset.relative) {
    const double width = range.typical_hi - range.typical_lo;
    const double value = absolute ? p.at : range.typical_lo + width * p.at;
    const auto channel = [&](int shift) { return float(p.rgb >> shift & 255) / 255.0f; };
    out.points.push_back(
        {std::clamp(value, -kMaxTransferValue, kMaxTransferValue), channel(16), channel(8), channel(0), p.opacity});
  }
  return out;
}

std::string_view fitting_preset(const ValueRange& range) { return range.hounsfield ? "bone" : kPresets[0].name; }

}  // namespace telesplat::volume
