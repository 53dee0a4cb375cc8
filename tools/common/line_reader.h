// Lines of a file that may be anything: no line takes more memory than it may.
#pragma once

#include <cstddef>
#include <cstdint>
#include <istream>
#include <optional>
#include <string>
#include <string_view>

namespace telesplat::tools {

class LineReader {
 public:
  /// Reads on from where the stream is. most: bytes of a line that are kept, the first ones.
  LineReader(std::istream& in, size_t most) : in_(in), most_(most) {}

  struct Line {
    std::string_view text;  ///< without its end, until the next call
    uint64_t left_out = 0;  ///< bytes behind the text that were read and not kept
    bool ended = false;     ///< false: the file ended before the line did
  };
  /// Nothing: the file is over, or cannot be read.
  std::optional<Line> next();
  uint64_t bytes() const { return bytes_; }  ///< of the lines so far, their ends included

 private:
  bool fill();

  std::istream& in_;
  size_t most_;
  std::string buffer_, line_;
  size_t at_ = 0;  // what was taken of the buffer
  uint64_t bytes_ = 0;
};

}  // namespace telesplat::tools
