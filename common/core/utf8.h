// Text from outside (file names, messages) as UTF-8: JSON, metrics and terminals take nothing else.
#pragma once

#include <string>
#include <string_view>

namespace telesplat {

/// Whether all of `text` is well-formed UTF-8 (Unicode 15, table 3-7): no overlong forms, no surrogates, nothing above
/// U+10FFFF. Zero bytes and control characters are fine.
bool valid_utf8(std::string_view text);

/// `text` with U+FFFD in place of what is not UTF-8: one for each longest beginning of a character, one for any other
/// byte (as Unicode recommends in section 3.9). Text that is valid stays as it is; what it returns is always valid.
std::string to_utf8(std::string_view text);

/// `text` of somebody else as a line of a log or a terminal takes it: valid UTF-8 with U+FFFD in place of control
/// characters (C0, DEL, C1, line and paragraph separators, and what turns the direction of text), of `most` bytes at
/// most, the last of which are then "...".
std::string printable(std::string_view text, size_t most = 256);

/// The same of text of several lines, whole: line feeds stay.
std::string printable_lines(std::string_view text);

}  // namespace telesplat
