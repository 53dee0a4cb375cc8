// Files of VTK for tests, in all encodings.
#pragma once

#include <lz4.h>
#include <lzma.h>
#include <zlib.h>

#include <glm/geometric.hpp>
#include <map>
#include <sstream>

#include "services/data/mesh/reader.h"
#include "tests/support/files/data_files.h"

namespace telesplat::data::test {

struct VtkEncoding {
  enum class Mode { kAscii, kBase64, kAppendedRaw, kAppendedBase64 } mode = Mode::kAscii;
  std::string packing;  ///< "ZLib", "LZ4", "LZMA"
  bool wide_header = false, big_endian = false;
  bool joined = false;  ///< header and data in one base64 text, as some writers do
  size_t block = 64;    ///< bytes packed at once: several blocks, the last one smaller
};

inline std::string base64(const std::string& bytes) {
  constexpr const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t bits = 0;
    for (size_t b = 0; b < 3; ++b) bits = bits << 8 | (i + b < bytes.size() ? uint8_t(bytes[i + b]) : 0);
    for (size_t d = 0; d < 4; ++d) out += i + d > bytes.size() ? '=' : kDigits[bits >> (18 - 6 * d) & 63];
  }
  return out;
}

inline std::string packed_by(const std::string& packing, const std::string& bytes) {
  std::string out(bytes.size() * 2 + 1000, '\0');
  size_t size = 0;
  if (packing == "ZLib") {
    uLongf length = out.size();
    compress(reinterpret_cast<Bytef*>(out.data()), &length, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
    size = length;
  } else if (packing == "LZ4") {
    size = size_t(LZ4_compress_default(bytes.data(), out.data(), int(bytes.size()), int(out.size())));
  } else {
    lzma_easy_buffer_encode(5, LZMA_CHECK_CRC32, nullptr, reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size(),
                            reinterpret_cast<uint8_t*>(out.data()), &size, out.size());
  }
  return out.substr(0, size);
}

/// Writes arrays in one encoding; collects appended data.
class VtkWriter {
 public:
  explicit VtkWriter(VtkEncoding encoding = {}) : encoding_(std::move(encoding)) {}

  template <class T>
  std::string array(const char* type, const std::string& attributes, const std::vector<T>& values) {
    const std::string tag = fmt::format("<DataArray type=\"{}\" {} ", type, attributes);
    using Mode = VtkEncoding::Mode;
    if (encoding_.mode == Mode::kAscii)
      return fmt::format("{}format=\"ascii\">\n{}\n</DataArray>\n", tag, fmt::join(values, " "));
    std::string bytes;
    for (const T& v : values) bytes += raw(v, encoding_.big_endian);
    if (encoding_.mode == Mode::kBase64)
      return tag + "format=\"binary\">\n  " + encoded(bytes, true) + "\n</DataArray>\n";
    const size_t at = appended_.size();
    appended_ += encoded(bytes, encoding_.mode == Mode::kAppendedBase64);
    return fmt::format("{}format=\"appended\" offset=\"{}\"/>\n", tag, at);
  }

  /// Wraps the root's content into a file.
  std::string file(const std::string& type, const std::string& content) const {
    std::string out = fmt::format(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"{}\" version=\"1.0\" byte_order=\"{}\" header_type=\"{}\"{}>\n{}",
        type, encoding_.big_endian ? "BigEndian" : "LittleEndian", encoding_.wide_header ? "UInt64" : "UInt32",
        encoding_.packing.empty() ? "" : " compressor=\"vtk" + encoding_.packing + "DataCompressor\"", content);
    if (!appended_.empty())
      out += fmt::format("<AppendedData encoding=\"{}\">\n _{}\n</AppendedData>",
                         encoding_.mode == VtkEncoding::Mode::kAppendedRaw ? "raw" : "base64", appended_);
    return out + "</VTKFile>\n";
  }

 private:
  std::string number(uint64_t n) const {
    return encoding_.wide_header ? raw(n, encoding_.big_endian) : raw(uint32_t(n), encoding_.big_endian);
  }
  std::string encoded(const std::string& bytes, bool base) const {
    std::string header = number(bytes.size()), data = bytes;
    if (!encoding_.packing.empty()) {
      const size_t block = encoding_.block, blocks = (bytes.size() + block - 1) / block;
      header = number(blocks) + number(block) + number(bytes.size() % block), data = {};
      for (size_t b = 0; b < blocks; ++b) {
        const std::string one = packed_by(encoding_.packing, bytes.substr(b * block, block));
        header += number(one.size()), data += one;
      }
    }
    if (!base) return header + data;
    return encoding_.joined ? base64(header + data) : base64(header) + base64(data);
  }

  VtkEncoding encoding_;
  std::string appended_;
};

/// Points and cells of an unstructured grid, with the number of each as an array.
struct Grid {
  std::vector<double> points;
  std::vector<std::vector<int64_t>> cells;
  std::vector<uint8_t> types;
  std::string more;  ///< arrays behind those of the cells
};

inline std::string vtu_piece(const Grid& grid, VtkWriter& writer, const std::string& cell_data = {}) {
  std::vector<int64_t> ids, ends;
  std::vector<float> heat;
  std::vector<int32_t> number;
  for (const auto& cell : grid.cells) {
    ids.insert(ids.end(), cell.begin(), cell.end());
    ends.push_back(int64_t(ids.size()));
    number.push_back(int32_t(number.size()));
  }
  for (size_t i = 0; i < grid.points.size() / 3; ++i) heat.push_back(0.5f * float(i));
  return fmt::format("<Piece NumberOfPoints='{}' NumberOfCells='{}'>", heat.size(), ends.size()) +
         "<PointData Scalars=\"heat\">" + writer.array("Float32", "Name=\"heat\"", heat) + "</PointData>\n<CellData>" +
         writer.array("Int32", "Name=\"number\"", number) + cell_data + "</CellData>\n<Points>" +
         writer.array("Float64", "NumberOfComponents=\"3\"", grid.points) + "</Points>\n<Cells>" +
         writer.array("Int64", "Name=\"connectivity\"", ids) + writer.array("Int64", "Name=\"offsets\"", ends) +
         writer.array("UInt8", "Name=\"types\"", grid.types) + grid.more + "</Cells></Piece>\n";
}
inline std::string vtu(const Grid& grid, VtkEncoding encoding = {}, const std::string& cell_data = {}) {
  VtkWriter writer(std::move(encoding));
  const std::string piece = vtu_piece(grid, writer, cell_data);
  return writer.file("UnstructuredGrid", "<UnstructuredGrid>" + piece + "</UnstructuredGrid>\n");
}

/// `n` hexahedra along x, from x0 on.
inline Grid bricks(int n, double x0 = 0) {
  Grid out;
  for (int k = 0; k < 2; ++k)
    for (int j = 0; j < 2; ++j)
      for (int i = 0; i <= n; ++i) out.points.insert(out.points.end(), {x0 + i, double(j), double(k)});
  const int64_t row = n + 1, layer = 2 * row;
  for (int64_t i = 0; i < n; ++i) {
    out.cells.push_back(
        {i, i + 1, i + 1 + row, i + row, i + layer, i + 1 + layer, i + 1 + row + layer, i + row + layer});
    out.types.push_back(12);
  }
  return out;
}

/// Measures of a surface.
struct Shape {
  size_t triangles = 0;
  double area = 0, volume = 0;  ///< right only if the surface is closed and faces outward
  bool closed = true;           ///< judged by positions
};
inline Shape shape_of(const Mesh& mesh) {
  Shape out{mesh.indices.size() / 3, 0, 0, true};
  using Key = std::array<double, 6>;
  std::map<Key, int> edges;
  for (size_t i = 0; i < mesh.indices.size(); i += 3) {
    const auto at = [&](size_t c) { return mesh.positions[mesh.indices[i + c % 3]]; };
    out.area += glm::length(glm::cross(at(1) - at(0), at(2) - at(0))) / 2;
    out.volume += glm::dot(at(0), glm::cross(at(1), at(2))) / 6;
    for (size_t c = 0; c < 3; ++c) {
      const auto a = at(c), b = at(c + 1);
      ++edges[Key{a.x, a.y, a.z, b.x, b.y, b.z}];
      --edges[Key{b.x, b.y, b.z, a.x, a.y, a.z}];
    }
  }
  for (const auto& [key, count] : edges) out.closed = out.closed && count == 0;
  return out;
}

inline Mesh mesh_or_fail(const std::string& path, const std::string& array = {}) {
  auto mesh = read_mesh(path, nullptr, {}, array);
  EXPECT_TRUE(mesh.ok()) << (mesh ? "" : mesh.error().text);
  return mesh ? std::move(*mesh) : Mesh();
}

inline void expect_shape(const Mesh& mesh, size_t triangles, double area, double volume) {
  const Shape shape = shape_of(mesh);
  EXPECT_EQ(shape.triangles, triangles);
  EXPECT_NEAR(shape.area, area, 1e-6 * area);
  EXPECT_NEAR(shape.volume, volume, 1e-6 * volume);
  EXPECT_TRUE(shape.closed);
}

}  // namespace telesplat::data::test
