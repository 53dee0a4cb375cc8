#include "client/stereo/mode.h"

#include <algorithm>

namespace telesplat::stereo {

const std::vector<std::string>& mode_names() {
  static const std::vector<std::string> names{
      "off",           "side-by-side",    "side-by-side-half", "top-bottom", "top-bottom-half",
      "anaglyph-grey", "anaglyph-colour", "anaglyph-dubois",   "rows",       "columns",
      "checker",       "autostereo",      "quad-buffer"};
  return names;
}

std::string_view name_of(Mode mode) { return mode_names()[size_t(mode)]; }

std::optional<Mode> mode_named(std::string_view name) {
  const auto& names = mode_names();
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) return std::nullopt;
  return Mode(found - names.begin());
}

Size eye_size(Mode mode, Size display) {
  if (mode == Mode::kSideBySide) display.width /= 2;
  if (mode == Mode::kTopBottom) display.height /= 2;
  return {std::max(display.width, 1), std::max(display.height, 1)};
}

Size composed_size(Mode mode, Size eye) {
  if (mode == Mode::kSideBySide || mode == Mode::kQuadBuffer) eye.width *= 2;
  if (mode == Mode::kTopBottom) eye.height *= 2;
  return eye;
}

}  // namespace telesplat::stereo
