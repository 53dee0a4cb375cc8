// What `telesplat bench codec` prints and writes.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "tools/telesplat/bench/codec/measure.h"
#include "tools/telesplat/bench/codec/slices.h"

namespace telesplat::launcher {

/// A table of bits a covered pixel, one of speeds, and a line of errors, as Markdown.
std::string to_markdown(const CodecReport& report);
std::string to_markdown(const SliceReport& report);

/// The same figures: bits a covered pixel by coder and plane, Mpx/s by instruction set, errors.
nlohmann::json to_json(const CodecReport& report);
nlohmann::json to_json(const SliceReport& report);

}  // namespace telesplat::launcher
