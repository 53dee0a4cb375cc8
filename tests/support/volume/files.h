// Small volume files of every format, written by hand: tests compare them with the readers' results.
#pragma once

#include <zlib.h>

#include <array>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <optional>

#include "services/data/volume/volume.h"
#include "tests/support/files/data_files.h"

namespace telesplat::data::test {

/// A volume whose voxels all differ: the expected result of a reader.
struct Pattern {
  std::array<int, 3> size{5, 4, 3};
  glm::dmat4 index_to_data{1.0};
  double first = 0, step = 1;

  double value(int i, int j, int k) const { return first + step * (i + size[0] * (j + size[1] * k)); }
  size_t voxels() const { return size_t(size[0]) * size_t(size[1]) * size_t(size[2]); }

  template <class T>
  std::string bytes(bool big_endian = false) const {
    std::string out;
    for (size_t at = 0; at < voxels(); ++at) out += raw(T(first + step * double(at)), big_endian);
    return out;
  }
  std::string text() const {
    std::string out;
    for (size_t at = 0; at < voxels(); ++at)
      out += fmt::format("{}{}", first + step * double(at), at % 7 == 6 ? "\n" : " ");
    return out;
  }
};

/// Turned about all axes, with a different spacing on each; `mirror`: left-handed.
inline glm::dmat4 turned(bool mirror = false) {
  const double c = std::cos(0.4), s = std::sin(0.4), d = std::cos(0.7), e = std::sin(0.7);
  const glm::dvec3 x(c, s, 0), y(-s * d, c * d, e), z = glm::cross(x, y);
  return {glm::dvec4(x * 0.5, 0), glm::dvec4(y * 0.75, 0), glm::dvec4(z * (mirror ? -2.0 : 2.0), 0),
          glm::dvec4(-10, 20, 5, 1)};
}

/// Packs with gzip or, if window_bits is 15, zlib.
inline std::string packed(const std::string& content, int window_bits = 31) {
  z_stream stream{};
  EXPECT_EQ(deflateInit2(&stream, 6, Z_DEFLATED, window_bits, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::string out(deflateBound(&stream, content.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(content.data()));
  stream.avail_in = uInt(content.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = uInt(out.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  out.resize(out.size() - stream.avail_out);
  deflateEnd(&stream);
  return out;
}

/// The three numbers of a column, and each of three columns.
inline std::string three(const glm::dvec4& v, const char* between = " ") {
  return fmt::format("{:.17g}{}{:.17g}{}{:.17g}", v.x, between, v.y, between, v.z);
}
inline std::array<double, 3> spacing_of(const glm::dmat4& m) {
  return {glm::length(glm::dvec3(m[0])), glm::length(glm::dvec3(m[1])), glm::length(glm::dvec3(m[2]))};
}

inline std::string nrrd_header(const Pattern& p, const std::string& type, const std::string& more) {
  const glm::dmat4& m = p.index_to_data;
  return fmt::format(
      "NRRD0005\n# made for a test\ntype: {}\ndimension: 3\nspace: left-posterior-superior\nsizes: {} {} {}\n"
      "space directions: ({}) ({}) ({})\nspace origin: ({})\n{}",
      type, p.size[0], p.size[1], p.size[2], three(m[0], ","), three(m[1], ","), three(m[2], ","), three(m[3], ","),
      more);
}

inline std::string metaimage_header(const Pattern& p, const std::string& type, const std::string& more) {
  const glm::dmat4& m = p.index_to_data;
  const auto s = spacing_of(m);
  return fmt::format(
      "ObjectType = Image\nNDims = 3\nTransformMatrix = {} {} {}\nOffset = {}\nElementSpacing = {:.17g} {:.17g} "
      "{:.17g}\nDimSize = {} {} {}\nElementType = {}\n{}",
      three(m[0] / s[0]), three(m[1] / s[1]), three(m[2] / s[2]), three(m[3]), s[0], s[1], s[2], p.size[0], p.size[1],
      p.size[2], type, more);
}

/// Fields of a NIfTI header beside the pattern.
struct Nifti {
  int version = 1;
  bool big_endian = false, pair = false;
  int type = 4, bits = 16;
  bool sform = true, qform = false;
  std::array<double, 3> quaternion{};
  double qfac = 1, slope = 0, intercept = 0;
  int64_t time_steps = 1;
};

inline std::string nifti_header(const Pattern& p, const Nifti& n) {
  const bool two = n.version == 2;
  std::string h(two ? 544 : 352, '\0');
  const auto put = [&](size_t at, auto value) {
    const std::string bytes = raw(value, n.big_endian);
    h.replace(at, bytes.size(), bytes);
  };
  const auto real = [&](size_t at, size_t index, double value) {
    two ? put(at + 8 * index, value) : put(at + 4 * index, float(value));
  };
  const auto whole = [&](size_t at, int64_t value) { two ? put(at, value) : put(at, int16_t(value)); };
  put(0, int32_t(two ? 540 : 348));
  h.replace(two ? 4 : 344, 4, std::string(n.pair ? "ni" : "n+") + char('0' + n.version) + '\0');
  if (two) h.replace(8, 4, "\r\n\032\n");
  const size_t dim = two ? 16 : 40, dim_bytes = two ? 8 : 2;
  whole(dim, n.time_steps > 1 ? 4 : 3);
  for (size_t a = 0; a < 3; ++a) whole(dim + (a + 1) * dim_bytes, p.size[a]);
  for (size_t a = 4; a < 8; ++a) whole(dim + a * dim_bytes, a == 4 ? n.time_steps : 1);
  put(two ? 12 : 70, int16_t(n.type));
  put(two ? 14 : 72, int16_t(n.bits));
  const size_t pixdim = two ? 104 : 76, slope = two ? 176 : 112, rows = two ? 400 : 280, quaternion = two ? 352 : 256;
  const auto s = spacing_of(p.index_to_data);
  real(pixdim, 0, n.qfac);
  for (size_t a = 0; a < 3; ++a) real(pixdim, a + 1, s[a]);
  two ? put(168, int64_t(n.pair ? 0 : 544)) : put(108, float(n.pair ? 0 : 352));
  real(slope, 0, n.slope), real(slope, 1, n.intercept);
  two ? put(344, int32_t(n.qform)) : put(252, int16_t(n.qform));
  two ? put(348, int32_t(n.sform)) : put(254, int16_t(n.sform));
  for (size_t a = 0; a < 3; ++a) {
    real(quaternion, a, n.quaternion[a]);
    real(quaternion, a + 3, p.index_to_data[3][int(a)]);
    for (size_t c = 0; c < 4; ++c) real(rows, 4 * a + c, p.index_to_data[int(c)][int(a)]);
  }
  return h;
}

/// A DICOM slice, element by element.
class DicomWriter {
 public:
  enum class Syntax { kExplicit, kImplicit, kBigEndian };
  explicit DicomWriter(Syntax syntax, const std::string& syntax_uid = "") : syntax_(Syntax::kExplicit) {
    constexpr const char* kUids[] = {"1.2.840.10008.1.2.1", "1.2.840.10008.1.2", "1.2.840.10008.1.2.2"};
    out_ = std::string(128, '\0') + "DICM";
    const std::string uid = syntax_uid.empty() ? kUids[int(syntax)] : syntax_uid;
    put(0x00020000, "UL", raw(uint32_t(8 + (uid.size() + 1) / 2 * 2)));
    put(0x00020010, "UI", uid);
    syntax_ = syntax;
  }
  void put(uint32_t tag, const char* type, std::string value) {
    if (value.size() % 2) value += type[0] == 'U' ? '\0' : ' ';
    tag_and_length(tag, type, uint32_t(value.size()));
    out_ += value;
  }
  void put16(uint32_t tag, uint16_t value) { put(tag, "US", raw(value, big())); }
  /// Writes a sequence of one item of undefined length with its own pixels (an icon): readers must skip it.
  void put_icon() {
    tag_and_length(0x00880200, "SQ", 0xffffffff);
    out_ += tag(0xfffee000) + raw(uint32_t(0xffffffff), big());
    put16(0x00280010, 1);
    put(0x7fe00010, "OW", "\x7f\x7f");
    out_ += tag(0xfffee00d) + raw(uint32_t(0), big()) + tag(0xfffee0dd) + raw(uint32_t(0), big());
  }
  /// Writes a sequence of items, with their lengths unless `undefined`.
  void put_sequence(uint32_t t, const std::vector<std::string>& items, bool undefined = true) {
    std::string all;
    for (const std::string& item : items) {
      all += tag(0xfffee000) + raw(undefined ? 0xffffffff : uint32_t(item.size()), big()) + item;
      if (undefined) all += tag(0xfffee00d) + raw(uint32_t(0), big());
    }
    if (undefined) all += tag(0xfffee0dd) + raw(uint32_t(0), big());
    tag_and_length(t, "SQ", undefined ? 0xffffffff : uint32_t(all.size()));
    out_ += all;
  }
  /// Returns a writer of elements alone, for an item of a sequence.
  static DicomWriter item(Syntax syntax) {
    DicomWriter out(syntax);
    out.out_.clear();
    return out;
  }
  const std::string& content() const { return out_; }

 private:
  bool big() const { return syntax_ == Syntax::kBigEndian; }
  std::string tag(uint32_t t) const { return raw(uint16_t(t >> 16), big()) + raw(uint16_t(t), big()); }
  void tag_and_length(uint32_t t, const std::string& type, uint32_t bytes) {
    out_ += tag(t);
    if (syntax_ == Syntax::kImplicit)
      out_ += raw(bytes);
    else if (type == "OW" || type == "SQ" || type == "OB" || type == "UN")
      out_ += type + std::string(2, '\0') + raw(bytes, big());
    else
      out_ += type + raw(uint16_t(bytes), big());
  }
  Syntax syntax_;
  std::string out_;
};

/// Options for writing the slices of a pattern as DICOM.
struct Dicom {
  DicomWriter::Syntax syntax = DicomWriter::Syntax::kExplicit;
  std::string modality = "MR", series = "1.2.3", slope = "1", intercept = "0", syntax_uid;
  bool positions = true;
  uint16_t bits_stored = 16, representation = 1, components = 1;
  std::string uid, image_type = "ORIGINAL\\PRIMARY\\AXIAL", photometric = "MONOCHROME2";
  bool preamble = true, icon = true;
  int temporal_position = 0;  ///< 0: left out
  std::optional<int> padding = {};
  std::optional<glm::dvec3> position = {};  ///< instead of the pattern's
};

inline std::string dicom_slice(const Pattern& p, int k, const Dicom& d) {
  const glm::dmat4& m = p.index_to_data;
  const auto s = spacing_of(m);
  DicomWriter w(d.syntax, d.syntax_uid);
  if (!d.image_type.empty()) w.put(0x00080008, "CS", d.image_type);
  w.put(0x00080016, "UI", "1.2.840.10008.5.1.4.1.1." + std::string(d.modality == "CT" ? "2" : "4"));
  if (!d.uid.empty()) w.put(0x00080018, "UI", d.uid);
  w.put(0x00080060, "CS", d.modality);
  w.put(0x00180050, "DS", fmt::format("{:.12g}", s[2]));
  w.put(0x0020000e, "UI", d.series);
  w.put(0x00200013, "IS", std::to_string(k + 1));
  const glm::dvec4 at = d.position ? glm::dvec4(*d.position, 1) : m * glm::dvec4(0, 0, k, 1);
  if (d.positions) w.put(0x00200032, "DS", three(at, "\\"));
  w.put(0x00200037, "DS", three(m[0] / s[0], "\\") + "\\" + three(m[1] / s[1], "\\"));
  if (d.temporal_position > 0) w.put(0x00200100, "IS", std::to_string(d.temporal_position));
  w.put16(0x00280002, d.components);
  w.put(0x00280004, "CS", d.photometric);
  w.put16(0x00280010, uint16_t(p.size[1]));
  w.put16(0x00280011, uint16_t(p.size[0]));
  w.put(0x00280030, "DS", fmt::format("{:.12g}\\{:.12g}", s[1], s[0]));  // between rows, between columns
  w.put16(0x00280100, 16);
  w.put16(0x00280101, d.bits_stored);
  w.put16(0x00280102, uint16_t(d.bits_stored - 1));
  w.put16(0x00280103, d.representation);
  if (d.padding) w.put16(0x00280120, uint16_t(*d.padding));
  w.put(0x00281052, "DS", d.intercept);
  w.put(0x00281053, "DS", d.slope);
  if (d.icon) w.put_icon();
  std::string pixels;
  const uint16_t mask = uint16_t((1u << d.bits_stored) - 1);  // readers must ignore the bits above
  for (int j = 0; j < p.size[1]; ++j)
    for (int i = 0; i < p.size[0]; ++i)
      pixels += raw(uint16_t((uint16_t(int16_t(p.value(i, j, k))) & mask) | (0xa5a5 & ~mask)),
                    d.syntax == DicomWriter::Syntax::kBigEndian);
  w.put(0x7fe00010, "OW", pixels);
  return d.preamble ? w.content() : w.content().substr(w.content().find("\x08", 132, 1));
}

/// Reads the volume at `path`, or fails the test.
inline Volume read_or_fail(const std::string& path, const std::string& raw = "", size_t step = 0) {
  const auto source = find_volume(path, {.raw = raw});
  EXPECT_TRUE(source.ok()) << (source ? "" : source.error().text);
  if (!source) return {};
  auto volume = read_volume(*source, step, nullptr);
  EXPECT_TRUE(volume.ok()) << (volume ? "" : volume.error().text);
  return volume ? std::move(*volume) : Volume{};
}

/// Expects every voxel of the pattern at its place in data space, for any order of the reader; values to `tolerance`.
inline void expect_same(const Volume& volume, const Pattern& p, double scale = 1, double offset = 0,
                        double tolerance = 0) {
  ASSERT_EQ(volume.size, p.size);
  ASSERT_EQ(volume.stored.size(), p.voxels() * voxel_bytes(volume.type));
  const glm::dmat4 data_to_index = glm::inverse(volume.index_to_data);
  for (int k = 0; k < p.size[2]; ++k)
    for (int j = 0; j < p.size[1]; ++j)
      for (int i = 0; i < p.size[0]; ++i) {
        const glm::dvec4 at = data_to_index * p.index_to_data * glm::dvec4(i, j, k, 1);
        const int x = int(std::lround(at.x)), y = int(std::lround(at.y)), z = int(std::lround(at.z));
        ASSERT_LT(std::abs(at.x - x) + std::abs(at.y - y) + std::abs(at.z - z), 1e-4) << i << " " << j << " " << k;
        ASSERT_TRUE(x >= 0 && x < p.size[0] && y >= 0 && y < p.size[1] && z >= 0 && z < p.size[2])
            << i << " " << j << " " << k;
        ASSERT_NEAR(volume.value(size_t(x) + size_t(p.size[0]) * (size_t(y) + size_t(p.size[1]) * size_t(z))),
                    p.value(i, j, k) * scale + offset, tolerance)
            << i << " " << j << " " << k;
      }
  const double a = p.value(0, 0, 0) * scale + offset;
  const double b = p.value(p.size[0] - 1, p.size[1] - 1, p.size[2] - 1) * scale + offset;
  EXPECT_NEAR(volume.lo, std::min(a, b), tolerance);
  EXPECT_NEAR(volume.hi, std::max(a, b), tolerance);
}

}  // namespace telesplat::data::test
