// Parses NIfTI 1 and 2 headers. Offsets from https://nifti.nimh.nih.gov/pub/dist/src/niftilib/nifti1.h and nifti2.h.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "services/data/volume/formats/header_text.h"

namespace telesplat::data {
namespace {

constexpr size_t kBytes1 = 348, kBytes2 = 540;

// Reads fields at given offsets, in the file's byte order.
class NiftiFields {
 public:
  NiftiFields(std::string_view content, bool swapped) : content_(content), swapped_(swapped) {}
  template <class T>
  T at(size_t offset) const {
    char bytes[sizeof(T)];
    std::memcpy(bytes, content_.data() + offset, sizeof(T));
    if (swapped_) std::reverse(bytes, bytes + sizeof(T));
    T value;
    std::memcpy(&value, bytes, sizeof value);
    return value;
  }

 private:
  std::string_view content_;
  bool swapped_;
};

// Fields of both versions, as doubles where their types differ.
struct Values {
  int64_t dim[8];
  int type;
  double pixdim[8], data_at, slope, intercept;
  int qform, sform;
  double quaternion[3], shift[3], rows[12];
};

// Where the fields are, in bytes.
struct Places {
  size_t dim, type, pixdim, slope, qform, sform, quaternion, rows;
};

template <class Real, class Size, class Code>
Values values_of(const NiftiFields& f, const Places& at) {
  const auto& [dim, type, pixdim, slope, qform, sform, quaternion, rows] = at;
  Values v{};
  for (size_t a = 0; a < 8; ++a) v.dim[a] = f.at<Size>(dim + a * sizeof(Size));
  v.type = f.at<int16_t>(type);
  for (size_t a = 0; a < 8; ++a) v.pixdim[a] = double(f.at<Real>(pixdim + a * sizeof(Real)));
  v.slope = double(f.at<Real>(slope)), v.intercept = double(f.at<Real>(slope + sizeof(Real)));
  v.qform = int(f.at<Code>(qform)), v.sform = int(f.at<Code>(sform));
  for (size_t a = 0; a < 3; ++a) {
    v.quaternion[a] = double(f.at<Real>(quaternion + a * sizeof(Real)));
    v.shift[a] = double(f.at<Real>(quaternion + (a + 3) * sizeof(Real)));
  }
  for (size_t a = 0; a < 12; ++a) v.rows[a] = double(f.at<Real>(rows + a * sizeof(Real)));
  return v;
}

std::optional<StoredType> type_of(int code) {
  using enum StoredType;
  constexpr std::pair<int, StoredType> kTypes[] = {{2, kU8},   {4, kI16},   {8, kI32},   {16, kF32},   {64, kF64},
                                                   {256, kI8}, {512, kU16}, {768, kU32}, {1024, kI64}, {1280, kU64}};
  for (const auto& [known, type] : kTypes)
    if (known == code) return type;
  return std::nullopt;
}

bool usable(const glm::dmat4& m) {
  const double volume = std::abs(glm::determinant(glm::dmat3(m)));
  return std::isfinite(volume) && volume > 0;
}

// Uses methods 3, 2 and 1 of nifti1.h: the sform, the qform, the spacing alone.
glm::dmat4 placement_of(const Values& v) {
  if (v.sform > 0) {
    glm::dmat4 m(1.0);
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 4; ++c) m[c][r] = v.rows[4 * r + c];
    if (usable(m)) return m;
  }
  const glm::dvec3 spacing(v.pixdim[1], v.pixdim[2], v.pixdim[3]);
  if (v.qform > 0) {
    double a = 0, b = v.quaternion[0], c = v.quaternion[1], d = v.quaternion[2];
    if (const double rest = 1 - (b * b + c * c + d * d); rest > 1e-7) {
      a = std::sqrt(rest);
    } else {  // half a turn, up to rounding
      const double length = std::sqrt(1 - rest);
      b /= length, c /= length, d /= length;
    }
    const double handed = v.pixdim[0] < 0 ? -1 : 1;
    const glm::dvec3 i(a * a + b * b - c * c - d * d, 2 * (b * c + a * d), 2 * (b * d - a * c));
    const glm::dvec3 j(2 * (b * c - a * d), a * a + c * c - b * b - d * d, 2 * (c * d + a * b));
    const glm::dvec3 k(2 * (b * d + a * c), 2 * (c * d - a * b), a * a + d * d - b * b - c * c);
    const glm::dmat4 m =
        placement(i * spacing.x, j * spacing.y, k * spacing.z * handed, {v.shift[0], v.shift[1], v.shift[2]});
    if (usable(m)) return m;
  }
  return placement(spacing);
}

VolumeFileHeader parse(std::string_view content, const std::string& path) {
  if (content.size() < kBytes1)
    refuse("{}: ends within its header: {} bytes of at least {}", path, content.size(), kBytes1);
  const int32_t size = NiftiFields(content, false).at<int32_t>(0),
                swapped_size = NiftiFields(content, true).at<int32_t>(0);
  const bool two = size == int32_t(kBytes2) || swapped_size == int32_t(kBytes2);
  const bool swapped = swapped_size == int32_t(kBytes1) || swapped_size == int32_t(kBytes2);
  if (!two && !swapped && size != int32_t(kBytes1))
    refuse("{}: is no NIfTI file: it begins with {} instead of {} or {}", path, size, kBytes1, kBytes2);
  if (two && content.size() < kBytes2)
    refuse("{}: ends within its header: {} bytes of {}", path, content.size(), kBytes2);
  const std::string_view magic = content.substr(two ? 4 : 344, 3);
  const bool single = magic == (two ? "n+2" : "n+1");
  if (!single && magic != (two ? "ni2" : "ni1"))
    refuse("{}: is no NIfTI file (an Analyze file?): its magic is {}", path, in_quotes(magic));
  const NiftiFields f(content, swapped);
  Values v = two ? values_of<double, int64_t, int32_t>(f, {16, 12, 104, 176, 344, 348, 352, 400})
                 : values_of<float, int16_t, int16_t>(f, {40, 70, 76, 112, 252, 254, 256, 280});
  v.data_at = two ? double(f.at<int64_t>(168)) : double(f.at<float>(108));

  VolumeFileHeader h;
  h.format = "nifti";
  h.big_endian = swapped;
  if (v.dim[0] < 3 || v.dim[0] > 7) refuse("{}: has {} axes; a volume has 3", path, v.dim[0]);
  for (int64_t a = 4; a <= v.dim[0]; ++a)
    if (v.dim[a] > 1)
      refuse("{}: has {} {}; supported is one (a series is a folder of numbered files)", path, v.dim[a],
             a == 4 ? "time steps" : "components a voxel");
  for (size_t a = 0; a < 3; ++a) h.size[a] = v.dim[a + 1];
  const auto stored = type_of(v.type);
  if (!stored)
    refuse("{}: its voxels' type has code {} ({}); {}", path, v.type,
           v.type == 128 || v.type == 2304  ? "colours"
           : v.type == 32 || v.type == 1792 ? "complex"
                                            : "unknown",
           kSupportedTypes);
  h.stored = *stored;
  if (v.slope != 0 && std::isfinite(v.slope) && std::isfinite(v.intercept)) h.scale = v.slope, h.offset = v.intercept;
  h.index_to_data = placement_of(v);
  if (v.sform > 0 || v.qform > 0) h.space = scene::Space::kRas;
  const int units = (two ? f.at<int32_t>(500) : f.at<int8_t>(123)) & 7;  // xyzt_units: lengths in the lowest bits
  h.unit = units == 1 ? "m" : units == 2 ? "mm" : units == 3 ? "um" : "";
  if (!(v.data_at >= 0 && v.data_at <= 1e15)) refuse("{}: its voxels begin at byte {}", path, v.data_at);
  h.data_at = uint64_t(v.data_at);
  h.data_path = path;
  if (!single) {
    std::string stem = path;
    const bool packed = stem.ends_with(".gz");
    if (packed) stem.resize(stem.size() - 3);
    const size_t dot = stem.rfind('.');
    h.data_path = stem.substr(0, dot) + ".img" + (packed ? ".gz" : "");
  } else {
    h.data_at = std::max<uint64_t>(h.data_at, two ? 544 : 352);  // 0 in the file means directly after the header
  }
  return h;
}

}  // namespace

Result<VolumeFileHeader> parse_nifti(std::string_view content, const std::string& path) {
  return or_error([&] { return parse(content, path); });
}

}  // namespace telesplat::data
