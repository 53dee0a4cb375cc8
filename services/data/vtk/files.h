// Inside services/data/vtk: single files. What is said to be an error is thrown as a Refusal that names the file.
// Sources: vtk.org, "VTK File Formats"; VTK's vtkXMLDataParser and vtkDataReader.
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

/// The elements and attributes of a file of VTK's XML formats, without what stands between them.
class XmlFile {
 public:
  /// `content` must stay. Error, starting with `name`: it is no XML, or is cut off.
  XmlFile(std::string_view content, const std::string& name);

  pugi::xml_node root() const { return tree_.child("VTKFile"); }
  /// The text directly in an element, without blanks around.
  std::string_view text(pugi::xml_node element) const;
  /// Reads a DataArray: ascii, base64, appended; unpacked; native byte order. Raw ones are not copied. Memory grows
  /// with what the file gives. Error: it is cut, damaged, or no numbers; fewer than `tuples`. More are left out; -1:
  /// as many as there are.
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

/// The value of a DataArray's type, as text: "Float32"; nothing: strings and bits.
bool type_of(std::string_view text, StoredType& out);

/// The root element of a file alone, as a document; quick for files of any size. Empty: it is no XML file of VTK's.
pugi::xml_document root_tag(std::string_view content);

/// The pieces of a file that holds points and arrays itself: one data set each. Error: an array that is cut, damaged or
/// missing, cells that do not fit.
std::vector<DataSet> read_pieces(const XmlFile& file);

/// The placement of an image: where its index (i, j, k) lies.
glm::dmat4 placement_of(pugi::xml_node image);
/// Six whole numbers, "0 9 0 9 0 0". False: they are none.
bool parse_extent(std::string_view text, std::array<int64_t, 6>& out);
/// The extent of a piece. Error: it is none, or one that the file cannot hold.
std::array<int64_t, 6> piece_extent(const XmlFile& file, std::string_view text);

/// The kind of data set of a legacy file ("# vtk DataFile Version 1.0" to 5.1, text and binary), in capitals:
/// "POLYDATA", "STRUCTURED_POINTS"; empty: it is no legacy file.
std::string legacy_kind(std::string_view content);

/// A legacy file with all its arrays; those whose size does not fit are left out. Without `values` arrays have sizes,
/// but no data; of structured points alone. Error, with the line of text: it is cut, claims more than it holds, or is
/// of an unknown kind.
DataSet read_legacy(std::string_view content, const std::string& name, bool values = true);

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
Bytes read_plain(EncodedBytes& in, size_t header_bytes, bool big_endian, const std::string& what);
/// Reads a header (number of blocks, bytes of a block, bytes of the last one, packed bytes of each) and its blocks.
/// Unpacks them on all cores. Error, starting with `what`: they are not there, are damaged, or claim more than such
/// data can become.
Bytes unpack(EncodedBytes& in, Packing packing, size_t header_bytes, bool big_endian, const std::string& what);

}  // namespace telesplat::data::vtk
