// Encoded and compressed bytes of VTK's XML files.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.h"

namespace telesplat::data::vtk {

/// Bytes as a file has them, raw or in base64, read from front to back. Base64 may be padded in its midst: VTK encodes
/// an array's header and data apart, others in one.
class EncodedBytes {
 public:
  EncodedBytes(std::string_view text, bool base64) : text_(text), base64_(base64) {}

  /// False: the text ends before, or is no base64.
  bool read(std::byte* to, size_t bytes);
  /// The next bytes of raw text, where they lie; empty: there are not as many.
  std::optional<std::span<const std::byte>> in_place(size_t bytes);
  bool base64() const { return base64_; }
  size_t most_left() const { return base64_ ? (text_.size() - at_) / 4 * 3 + 3 : text_.size() - at_; }

 private:
  bool read_group();

  std::string_view text_;
  bool base64_;
  size_t at_ = 0;
  std::byte group_[3];
  int group_at_ = 0, group_size_ = 0;
};

enum class Packing { kNone, kZlib, kLz4, kLzma };
/// Which one an attribute "vtkZLibDataCompressor" names; empty: none.
std::optional<Packing> packing_of(std::string_view name);

struct Bytes {
  std::vector<std::byte> owned;
  std::span<const std::byte> in_file;  ///< instead of `owned`
};
/// Reads a header of one number, the count, and as many bytes. Error, starting with `what`: they are not there.
Result<Bytes> read_plain(EncodedBytes& in, size_t header_bytes, bool big_endian, const std::string& what);
/// Reads a header (number of blocks, bytes of a block, bytes of the last one, packed bytes of each) and its blocks.
/// Unpacks them on all cores. Error, starting with `what`: they are not there, are damaged, or claim more than such
/// data can become.
Result<Bytes> unpack(EncodedBytes& in, Packing packing, size_t header_bytes, bool big_endian, const std::string& what);

}  // namespace telesplat::data::vtk
