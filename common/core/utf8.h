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

}  // namespace telesplat
