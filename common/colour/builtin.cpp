// The built-in colour maps. Published tables of 256 colours are reduced to a few stops, so that no channel differs by
// more than 1 in 255 (tests/unit/colour compares).
#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "common/colour/colour_map.h"
#include "common/colour/spaces.h"
#include "common/core/nearest.h"

namespace telesplat::colour {
namespace {

struct Entry {
  int at;  // place, 0 to 255
  uint32_t rgb;
};

// viridis, plasma, inferno, magma: Nathaniel J. Smith, Stefan van der Walt, Eric Firing, for matplotlib 1.5; CC0.
constexpr Entry kViridis[] = {{0, 0x440154},   {8, 0x470d60},   {23, 0x482173},  {29, 0x482979},  {50, 0x414287},
                              {81, 0x32648e},  {120, 0x23898e}, {132, 0x1f948c}, {139, 0x1e9b8a}, {151, 0x21a685},
                              {157, 0x25ac82}, {166, 0x2fb47c}, {177, 0x40bd72}, {190, 0x5ac864}, {203, 0x77d153},
                              {233, 0xc5e021}, {239, 0xd5e21a}, {242, 0xdde318}, {246, 0xe7e419}, {251, 0xf4e61e},
                              {255, 0xfde725}};
constexpr Entry kPlasma[] = {{0, 0x0d0887},   {7, 0x20068f},   {23, 0x3e049c},  {37, 0x5502a4},  {45, 0x6100a7},
                             {62, 0x7b02a8},  {68, 0x8405a7},  {78, 0x920fa3},  {92, 0xa51f99},  {123, 0xc7427c},
                             {148, 0xdd5e66}, {161, 0xe76e5b}, {188, 0xf79044}, {215, 0xfeb72d}, {229, 0xfccd25},
                             {235, 0xfbd724}, {250, 0xf3f027}, {253, 0xf1f525}, {255, 0xf0f921}};
constexpr Entry kInferno[] = {{0, 0x000004},   {2, 0x010106},   {6, 0x02020e},   {15, 0x0a0722},  {26, 0x180c3c},
                              {40, 0x2f0a5b},  {48, 0x3d0965},  {54, 0x470b6a},  {64, 0x57106e},  {88, 0x7d1e6d},
                              {110, 0xa02a63}, {132, 0xc13a50}, {144, 0xd24644}, {166, 0xea632a}, {175, 0xf1711f},
                              {189, 0xf8890c}, {193, 0xfa9008}, {199, 0xfb9b06}, {202, 0xfca108}, {209, 0xfcae12},
                              {222, 0xf9c72f}, {232, 0xf5db4c}, {241, 0xf1ec6d}, {246, 0xf2f482}, {251, 0xf6fa96},
                              {255, 0xfcffa4}};
constexpr Entry kMagma[] = {{0, 0x000004},   {2, 0x010106},   {12, 0x06051a},  {25, 0x140e36},  {32, 0x1d1147},
                            {42, 0x2c115f},  {48, 0x36106b},  {58, 0x471078},  {66, 0x54137d},  {74, 0x601880},
                            {93, 0x7e2482},  {120, 0xaa337d}, {129, 0xb83779}, {149, 0xd8456c}, {156, 0xe24d66},
                            {170, 0xf1605d}, {179, 0xf7705c}, {192, 0xfc8961}, {205, 0xfea16e}, {216, 0xfeb67c},
                            {235, 0xfed89a}, {255, 0xfcfdbf}};
// cividis: Nunez, Anderton, Renslow, "Optimizing colormaps with consideration for color vision deficiency", PLOS ONE
// 13(7), 2018, for matplotlib; CC0.
constexpr Entry kCividis[] = {{0, 0x00224e},   {20, 0x003070},  {23, 0x013271},  {28, 0x123570},  {33, 0x1c396f},
                              {44, 0x2d416d},  {53, 0x38476c},  {86, 0x585e6d},  {134, 0x828079}, {151, 0x928d78},
                              {171, 0xa69c74}, {191, 0xbbad6d}, {219, 0xd9c55c}, {233, 0xe8d24f}, {244, 0xf5dc41},
                              {251, 0xfde334}, {255, 0xfee838}};
// turbo: Anton Mikhailov, Google, 2019; Apache-2.0.
constexpr Entry kTurbo[] = {{0, 0x30123b},   {6, 0x372466},   {10, 0x3b2f80},  {14, 0x3f3b97},  {22, 0x4451bf},
                            {27, 0x455ed3},  {34, 0x4771e9},  {41, 0x4682f8},  {46, 0x448ffe},  {52, 0x3d9efe},
                            {58, 0x33adf7},  {61, 0x2eb4f2},  {69, 0x20c7df},  {73, 0x1bd0d5},  {77, 0x18d7ca},
                            {82, 0x18e0bd},  {89, 0x20eaac},  {94, 0x2cf09e},  {98, 0x38f491},  {108, 0x5dfc6f},
                            {119, 0x88ff4e}, {123, 0x96fe44}, {131, 0xacfb38}, {137, 0xbcf534}, {142, 0xc8ef34},
                            {148, 0xd7e535}, {155, 0xe5d938}, {158, 0xebd339}, {164, 0xf4c73a}, {170, 0xfaba39},
                            {177, 0xfea933}, {183, 0xfe992c}, {195, 0xf9751d}, {202, 0xf26014}, {208, 0xeb500e},
                            {215, 0xe14109}, {226, 0xcc2b04}, {237, 0xb21a01}, {242, 0xa41301}, {255, 0x7a0403}};

// These maps follow plain formulas.
constexpr Entry kGrey[] = {{0, 0x000000}, {255, 0xffffff}};
constexpr Entry kBlackBody[] = {{0, 0x000000}, {102, 0xe60000}, {204, 0xe6e600}, {255, 0xffffff}};  // ParaView's
constexpr int kEighths = 8;
constexpr uint32_t kJet[] = {0x000080, 0x0000ff, 0x0080ff, 0x00ffff, 0x80ff80, 0xffff00, 0xff8000, 0xff0000, 0x800000};

struct Builtin {
  std::string_view name;
  std::span<const Entry> entries;  // empty: computed
};
constexpr Builtin kMaps[] = {{"viridis", kViridis},      {"plasma", kPlasma}, {"inferno", kInferno}, {"magma", kMagma},
                             {"cividis", kCividis},      {"turbo", kTurbo},   {"cool-warm", {}},     {"grey", kGrey},
                             {"black-body", kBlackBody}, {"rainbow", {}}};
constexpr auto kNames = [] {
  std::array<std::string_view, std::size(kMaps)> names;
  std::transform(std::begin(kMaps), std::end(kMaps), names.begin(), [](const Builtin& map) { return map.name; });
  return names;
}();

// Other names of maps, as people write them: lower case, no hyphens.
constexpr std::pair<std::string_view, std::string_view> kAliases[] = {
    {"gray", "grey"}, {"greys", "grey"}, {"grays", "grey"}, {"jet", "rainbow"}, {"cooltowarm", "cool-warm"}};

std::string plain(std::string_view name) {
  std::string out;
  for (const char c : name)
    if (c != '-' && c != '_' && c != ' ') out += c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c;
  return out;
}

// ParaView's default: Kenneth Moreland's diverging map between this blue and this red, by his formula.
std::vector<ColourMap::Stop> cool_warm() {
  constexpr Rgb kBlue = {0.23137254902, 0.298039215686, 0.752941176471}, kGreyMiddle = {0.865, 0.865, 0.865},
                kRed = {0.705882352941, 0.0156862745098, 0.149019607843};
  constexpr int kPieces = 32;
  std::vector<ColourMap::Stop> out;
  for (int n = 0; n <= kPieces; ++n) {
    const double x = double(n) / kPieces;
    const Rgb c = x < 0.5 ? between(Space::kDiverging, kBlue, kGreyMiddle, 2 * x)
                          : between(Space::kDiverging, kGreyMiddle, kRed, 2 * x - 1);
    uint32_t rgb = 0;
    for (const double v : c) rgb = rgb << 8 | uint32_t(std::clamp(v, 0.0, 1.0) * 255 + 0.5);
    out.push_back({x, rgb});
  }
  return out;
}

std::vector<ColourMap::Stop> stops_of(const Builtin& map) {
  std::vector<ColourMap::Stop> out;
  if (map.name == "cool-warm") return cool_warm();
  if (map.name == "rainbow")
    for (int n = 0; n <= kEighths; ++n) out.push_back({double(n) / kEighths, kJet[n]});
  for (const Entry& e : map.entries) out.push_back({e.at / 255.0, e.rgb});
  return out;
}

Error no_such_map(std::string_view name) {
  std::string all;
  for (const auto& known : kNames) all += fmt::format("{}{}", all.empty() ? "" : ", ", known);
  const auto nearest = nearest_word(plain(name), kNames);
  return Error{
      fmt::format("\"{}\" is no colour map{}; there are {}, each with _r behind it the other way round, and "
                  "ParaView's FILE.json or FILE.json:NAME",
                  name.substr(0, 80), nearest ? fmt::format(", did you mean {}?", *nearest) : "", all)};
}

}  // namespace

std::span<const std::string_view> colour_map_names() { return kNames; }

Result<ColourMap> find_colour_map(std::string_view name) {
  const bool reversed = name.ends_with("_r");
  std::string wanted = plain(reversed ? name.substr(0, name.size() - 2) : name);
  for (const auto& [word, map] : kAliases)
    if (word == wanted) wanted = plain(map);
  const auto found =
      std::find_if(std::begin(kMaps), std::end(kMaps), [&](const Builtin& map) { return plain(map.name) == wanted; });
  if (found == std::end(kMaps)) return no_such_map(name);
  ColourMap map{std::string(found->name), stops_of(*found)};
  if (!reversed) return map;
  map.name += "_r";
  std::reverse(map.stops.begin(), map.stops.end());
  for (auto& stop : map.stops) stop.x = 1 - stop.x;
  return map;
}

}  // namespace telesplat::colour
