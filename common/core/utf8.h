// Text from outside (file names, messages) as UTF-8: JSON, metrics and terminals take nothing else.
#pragma once

#include <string>
#include <string_view>

namespace telesplat {

/// True if all of `text` is well-formed UTF-8 (Unicode 15, table 3-7): no overlong forms, no surrogates, no code point
/// above U+10FFFF. Zero bytes and control characters are fine.
bool valid_utf8(std::string_view text);

/// `text` with U+FFFD in place of bytes that are not UTF-8: one for each longest beginning of a character, one for any
/// other byte (as Unicode recommends in section 3.9). Valid text stays as it is; the result is always valid.
std::string to_utf8(std::string_view text);

/// Makes foreign `text` fit for a line of a log or a terminal: valid UTF-8 with U+FFFD in place of control characters
/// (C0, DEL, C1, line and paragraph separators, and characters that turn the direction of text). Longer text is cut to
/// `most` bytes, the last three of them "...".
std::string printable(std::string_view text, size_t most = 256);

/// The same for text of several lines, without a limit: line feeds stay.
std::string printable_lines(std::string_view text);

}  // namespace telesplat
