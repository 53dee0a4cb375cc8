#include "common/core/utf8.h"

#include <algorithm>
#include <cstddef>

namespace telesplat {
namespace {

bool in(unsigned char c, int least, int most) { return c >= least && c <= most; }

// The character, or the part of one, that `text` begins with. Precondition: text is not empty. bytes is at least 1.
struct Front {
  size_t bytes;
  bool valid;
};

Front front_of(std::string_view text) {
  const auto byte = [&](size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char lead = byte(0);
  if (lead < 0x80) return {1, true};
  if (!in(lead, 0xc2, 0xf4)) return {1, false};  // a trailing byte, an overlong form, or beyond U+10FFFF
  const size_t length = lead < 0xe0 ? 2 : lead < 0xf0 ? 3 : 4;
  // The second byte's range excludes overlong forms, surrogates and code points beyond U+10FFFF.
  const int least = lead == 0xe0 ? 0xa0 : lead == 0xf0 ? 0x90 : 0x80;
  const int most = lead == 0xed ? 0x9f : lead == 0xf4 ? 0x8f : 0xbf;
  for (size_t i = 1; i < length; ++i)
    if (i == text.size() || !in(byte(i), i == 1 ? least : 0x80, i == 1 ? most : 0xbf)) return {i, false};
  return {length, true};
}

}  // namespace

bool valid_utf8(std::string_view text) {
  while (!text.empty()) {
    const Front front = front_of(text);
    if (!front.valid) return false;
    text.remove_prefix(front.bytes);
  }
  return true;
}

std::string to_utf8(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const Front front = front_of(text);
    out += front.valid ? text.substr(0, front.bytes) : std::string_view("\xef\xbf\xbd");
    text.remove_prefix(front.bytes);
  }
  return out;
}

std::string printable(std::string_view text, size_t most) {
  const bool cut = text.size() > most;
  const std::string valid = to_utf8(cut ? text.substr(0, most > 3 ? most - 3 : 0) : text);
  std::string out;
  for (size_t i = 0; i < valid.size();) {
    const auto byte = [&](size_t k) { return static_cast<unsigned char>(valid[i + k]); };
    const size_t bytes = byte(0) < 0x80 ? 1 : byte(0) < 0xe0 ? 2 : byte(0) < 0xf0 ? 3 : 4;
    const bool control = byte(0) < 0x20 || byte(0) == 0x7f || (byte(0) == 0xc2 && byte(1) < 0xa0);
    // Characters that turn the direction of text: U+200E, U+200F, U+2028 to U+202E, U+2066 to U+2069
    const bool turns =
        bytes == 3 && byte(0) == 0xe2 &&
        ((byte(1) == 0x80 && (byte(2) == 0x8e || byte(2) == 0x8f || (byte(2) >= 0xa8 && byte(2) <= 0xae))) ||
         (byte(1) == 0x81 && byte(2) >= 0xa6 && byte(2) <= 0xa9));
    if (control || turns)
      out += "\xef\xbf\xbd";
    else
      out.append(valid, i, bytes);
    i += bytes;
  }
  return cut ? out + "..." : out;
}

std::string printable_lines(std::string_view text) {
  std::string out;
  for (;;) {
    const size_t end = std::min(text.find('\n'), text.size());
    out += printable(text.substr(0, end), text.size());
    if (end == text.size()) return out;
    out += '\n';
    text.remove_prefix(end + 1);
  }
}

}  // namespace telesplat
