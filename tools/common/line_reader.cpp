#include "tools/common/line_reader.h"

#include <algorithm>

namespace telesplat::tools {
namespace {

constexpr size_t kAtOnce = 1 << 16;

}  // namespace

// False: there is no more.
bool LineReader::fill() {
  buffer_.resize(kAtOnce);
  in_.read(buffer_.data(), std::streamsize(buffer_.size()));
  buffer_.resize(size_t(in_.gcount()));
  at_ = 0;
  return !buffer_.empty();
}

std::optional<LineReader::Line> LineReader::next() {
  Line out;
  line_.clear();
  const uint64_t before = bytes_;
  while (!out.ended && (at_ < buffer_.size() || fill())) {
    const size_t end = std::min(buffer_.find('\n', at_), buffer_.size()), length = end - at_;
    const size_t kept = std::min(length, most_ - line_.size());
    line_.append(buffer_, at_, kept);
    out.left_out += length - kept;
    out.ended = end < buffer_.size();
    at_ = end + (out.ended ? 1 : 0);
    bytes_ += length + (out.ended ? 1 : 0);
  }
  if (bytes_ == before) return std::nullopt;
  out.text = line_;
  return out;
}

}  // namespace telesplat::tools
