// Inside services/data/vtk: single files. Errors named below are thrown as Refusals that name the file. Sources:
// vtk.org, "VTK File Formats"; VTK's vtkXMLDataParser and vtkDataReader.
#pragma once

#include <cstdint>
#include <optional>
#include <pugixml.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.h"
#include "services/data/vtk/data_set.h"

namespace telesplat::data::vtk {

/// The elements and attributes of a file in VTK's XML formats, without the text between them.
class XmlFile {
 public:
  /// `content` must outlive it. Error, starting with `name`: not XML, or cut off.
  XmlFile(std::string_view content, const std::string& name);

  pugi::xml_node root() const { return tree_.child("VTKFile"); }
  /// Returns the text directly in an element, without blanks around it.
  std::string_view text(pugi::xml_node element) const;
  /// Reads a DataArray: ascii, base64, appended; unpacked; native byte order. Raw ones are not copied. Memory grows
  /// with the file's data. Error: cut off, damaged, not numbers, or fewer than `tuples`. Further values are left out;
  /// -1: all values are read.
  Array array(pugi::xml_node element, int64_t tuples) const;
  const std::string& name() const { return name_; }
  size_t bytes() const { return content_.size(); }

 private:
  Array decode(Array out, std::string_view encoded, bool base64, const std::string& what) const;

  std::string_view content_, appended_;
  std::string name_, skeleton_, compressor_;
  bool appended_base64_ = false, big_endian_ = false;
  size_t header_bytes_ = 4;
  pugi::xml_document tree_;
};

/// Parses a DataArray's type: "Float32". False: strings and bits.
bool type_of(std::string_view text, StoredType& out);

/// Returns only the root element of a file, as a document; fast for files of any size. Empty: not a VTK XML file.
pugi::xml_document root_tag(std::string_view content);

/// Reads the pieces of a file that holds points and arrays itself: one data set each. Error: an array is cut off,
/// damaged or missing, cells do not fit.
std::vector<DataSet> read_pieces(const XmlFile& file);

/// Returns the placement of an image: the position of its index (i, j, k).
glm::dmat4 placement_of(pugi::xml_node image);
/// Parses six integers, "0 9 0 9 0 0". False: the text is not that.
bool parse_extent(std::string_view text, std::array<int64_t, 6>& out);
/// Returns the extent of a piece. Error: it is not an extent, or larger than the file can hold.
std::array<int64_t, 6> piece_extent(const XmlFile& file, std::string_view text);

/// Returns the kind of data set in a legacy file ("# vtk DataFile Version 1.0" to 5.1, text and binary), in capitals:
/// "POLYDATA", "STRUCTURED_POINTS"; empty: not a legacy file.
std::string legacy_kind(std::string_view content);

/// Reads a legacy file with all its arrays; arrays of the wrong size are left out. Without `values`, arrays have sizes,
/// but no data; only for structured points. Error, with the line of text: it is cut off, claims more than it holds, or
/// is of an unknown kind.
DataSet read_legacy(std::string_view content, const std::string& name, bool values = true);

/// Bytes of a file, raw or in base64, read from front to back. Base64 may be padded in its midst: VTK encodes an
/// array's header and data apart, other programs in one.
class EncodedBytes {
 public:
  EncodedBytes(std::string_view text, bool base64) : text_(text), base64_(base64) {}

  /// False: the text ends too early, or is not base64.
  bool read(std::byte* to, size_t bytes);
  /// Returns the next bytes of raw text in place; nullopt: fewer are left.
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
/// Parses an attribute "vtkZLibDataCompressor"; an empty one means kNone.
std::optional<Packing> packing_of(std::string_view name);

struct Bytes {
  std::vector<std::byte> owned;
  std::span<const std::byte> in_file;  ///< instead of `owned`
};
/// Reads a header of one number, the count of bytes, and the bytes. Error, starting with `what`: they are missing.
Bytes read_plain(EncodedBytes& in, size_t header_bytes, bool big_endian, const std::string& what);
/// Reads a header (number of blocks, bytes of a block, bytes of the last one, packed bytes of each) and its blocks.
/// Unpacks them on all cores. Error, starting with `what`: they are missing, damaged, or claim more than packed data
/// can become.
Bytes unpack(EncodedBytes& in, Packing packing, size_t header_bytes, bool big_endian, const std::string& what);

}  // namespace telesplat::data::vtk
