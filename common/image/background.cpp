#include "common/image/background.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>

namespace telesplat::image {
namespace {

constexpr std::array kNames{
    std::pair{"white", 0xffffffu},    std::pair{"black", 0x000000u},     std::pair{"grey", 0x808080u},
    std::pair{"gray", 0x808080u},     std::pair{"lightgrey", 0xd3d3d3u}, std::pair{"lightgray", 0xd3d3d3u},
    std::pair{"darkgrey", 0x404040u}, std::pair{"darkgray", 0x404040u},  std::pair{"red", 0xff0000u},
    std::pair{"green", 0x008000u},    std::pair{"blue", 0x0000ffu},      std::pair{"navy", 0x000080u},
    std::pair{"skyblue", 0x87ceebu},  std::pair{"beige", 0xf5f5dcu}};

uint32_t channel(uint32_t colour, int shift) { return colour >> shift & 255; }

}  // namespace

Result<Background> parse_background(const std::string& text) {
  if (text == "transparent") return Background{0, true};
  for (const auto& [name, colour] : kNames)
    if (text == name) return Background{colour, false};
  uint32_t colour = 0;
  if (text.size() == 7 && text[0] == '#') {
    const auto [end, error] = std::from_chars(text.data() + 1, text.data() + 7, colour, 16);
    if (error == std::errc() && end == text.data() + 7) return Background{colour, false};
  }
  std::string names;
  for (const auto& [name, unused] : kNames) names += fmt::format("{}{}", names.empty() ? "" : ", ", name);
  return Error{fmt::format("not #rrggbb, transparent or one of {}", names)};
}

void find_coverage(const View& over_white, View& over_black) {
  CHECK(over_white.colour.size() == over_black.colour.size());
  for (size_t i = 0; i < over_black.colour.size(); ++i) {
    uint32_t& black = over_black.colour[i];
    // Takes the channel with the smallest difference, which gives the largest coverage.
    uint32_t through = 255;
    for (const int shift : {0, 8, 16}) {
      const uint32_t white = channel(over_white.colour[i], shift), dark = channel(black, shift);
      through = std::min(through, white > dark ? white - dark : 0);
    }
    black = (black & 0xffffffu) | (255 - through) << 24;
  }
}

uint32_t straight_colour(uint32_t over_black) {
  const uint32_t alpha = over_black >> 24;
  if (alpha == 0) return 0;
  uint32_t out = alpha << 24;
  for (const int shift : {0, 8, 16})
    out |= std::min(255u, (channel(over_black, shift) * 255 + alpha / 2) / alpha) << shift;
  return out;
}

}  // namespace telesplat::image
