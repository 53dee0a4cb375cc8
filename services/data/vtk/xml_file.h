// A file of VTK's XML formats: its elements, and the arrays that these hold or name.
// Source: vtk.org, "VTK File Formats"; VTK's vtkXMLDataParser.
#pragma once

#include <memory>
#include <pugixml.hpp>
#include <string>
#include <string_view>

#include "services/data/vtk/data_set.h"

namespace telesplat::data::vtk {

/// The elements and attributes of a file of VTK's, without what stands between them. Whether it is one its root tells:
/// text without <VTKFile> behind comments gives an empty node.
class XmlFile {
 public:
  /// `content` must stay. Error, starting with `name`: it is no XML, or is cut off.
  static Result<std::unique_ptr<const XmlFile>> open(std::string_view content, const std::string& name);

  pugi::xml_node root() const { return tree_.child("VTKFile"); }
  /// The text directly in an element, without blanks around.
  std::string_view text(pugi::xml_node element) const;
  /// Reads a DataArray: ascii, base64, appended; unpacked; native byte order. Raw ones are not copied. Memory grows
  /// with what the file gives. Error: it is cut, damaged, or no numbers; fewer than `tuples`. More are left out; -1:
  /// as many as there are.
  Result<Array> array(pugi::xml_node element, int64_t tuples) const;
  const std::string& name() const { return name_; }
  size_t bytes() const { return content_.size(); }

 private:
  Result<Array> decode(Array out, std::string_view encoded, bool base64, const std::string& what) const;

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

}  // namespace telesplat::data::vtk
