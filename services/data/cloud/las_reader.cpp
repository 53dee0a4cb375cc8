#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "common/core/utf8.h"
#include "common/parallel/in_parallel.h"
#include "services/data/base/refusal.h"
#include "services/data/base/stored_type.h"
#include "services/data/cloud/laz/laz.h"
#include "services/data/cloud/point_rows.h"
#include "services/data/cloud/readers.h"

namespace telesplat::data {
namespace {

constexpr int kMostFormat = 10;
// Bytes of a point without extra bytes; where GPS time, colours and infrared lie in it; 0: not there.
struct PointFormat {
  uint16_t bytes, gps_time, colours, infrared;
};
constexpr PointFormat kFormats[kMostFormat + 1] = {{20, 0, 0, 0},    {28, 20, 0, 0},  {26, 0, 20, 0},  {34, 20, 28, 0},
                                                   {57, 20, 0, 0},   {63, 20, 28, 0}, {30, 22, 0, 0},  {36, 22, 30, 0},
                                                   {38, 22, 30, 36}, {59, 22, 0, 0},  {67, 22, 30, 36}};

// Text of a field that ends at its first 0.
std::string text_of(std::string_view field) { return to_utf8(std::string(field.substr(0, field.find('\0')))); }

// A number among the extra bytes of a point.
struct ExtraNumber {
  size_t at = 0;
  StoredType type = StoredType::kU8;
  double scale = 1, offset = 0;
  std::optional<double> none;  // the value of points without one
};

class LasReader final : public Part {
 public:
  LasReader(std::string_view content, const std::string& name) : content_(content), name_(name) {
    read_header();
    read_records();
    name_columns();
  }

  std::shared_ptr<const SquareCloud> read(const ReadProgress& progress, const std::string& array, uint64_t most) {
    PointRows rows(name_, columns_, array);
    const uint64_t step = count_ > most ? (count_ + most - 1) / most : 1;
    rows.reserve(std::min<uint64_t>(count_ / step + 1, content_.size()));  // the file justifies a point a byte
    if (step > 1) rows.set_frame(box_);
    if (count_ > kMaxPoints) rows.add_note(fmt::format("only every {}th of its {} points is read", step, count_));
    const uint64_t withheld = packed_ ? add_chunks(progress, most, rows) : add_records(progress, step, rows);
    if (withheld > 0) rows.add_note(fmt::format("{} points are left out: the file marks them as withheld", withheld));
    if (withheld > 0 && rows.size() == 0) refuse("{}: all its {} points are marked as withheld", name_, count_);
    return rows.finish(fmt::format("{} 1.{} points (format {})", packed_ ? "LAZ" : "LAS", minor_, format_), 255,
                       reference_, true);
  }

  void decode_all() {
    if (!packed_) return;
    const LazPoints points = packed_points();
    for (size_t i = 0; i < points.chunks(); ++i) {
      const std::vector<char> chunk = points.decode(i, count_);
      records_.insert(records_.end(), chunk.begin(), chunk.end());
    }
  }
  const std::vector<std::string>& columns() const override { return columns_; }
  uint64_t add(PointRows& rows) const override {
    if (!packed_) return add(content_.substr(points_at_, count_ * point_bytes_), point_bytes_, rows);
    return add({records_.data(), records_.size()}, point_bytes_, rows);
  }

 private:
  // Adds every n-th record; stride: n times a record's bytes. Returns the number of points that are withheld.
  uint64_t add(std::string_view records, size_t stride, PointRows& rows) const {
    uint64_t withheld = 0;
    std::vector<double> row(columns_.size());
    for (size_t at = 0; at < records.size(); at += stride) {
      const std::string_view point = records.substr(at, point_bytes_);
      if (is_withheld(point)) {
        ++withheld;
        continue;
      }
      decode(point, row);
      rows.add(row);
    }
    return withheld;
  }

  void read_header() {
    if (!content_.starts_with("LASF")) refuse("{}: is no LAS file: it does not begin with LASF", name_);
    constexpr size_t kHeader = 227, kHeader14 = 375;
    if (content_.size() < kHeader)
      refuse("{}: is truncated: a LAS header has {} bytes, the file {}", name_, kHeader, content_.size());
    const int major = uint8_t(content_[24]);
    minor_ = uint8_t(content_[25]);
    if (major != 1 || minor_ > 4) refuse("{}: is LAS {}.{}; 1.0 to 1.4 are read", name_, major, minor_);
    const auto header = number<uint16_t>(content_, 94);
    points_at_ = number<uint32_t>(content_, 96);
    const int format = content_[104] & 0x3f;
    packed_ = is_packed_las(content_);
    if (format > kMostFormat) refuse("{}: points of format {}; 0 to {} are read", name_, format, kMostFormat);
    format_ = format;
    point_bytes_ = number<uint16_t>(content_, 105);
    if (point_bytes_ < kFormats[format_].bytes)
      refuse("{}: points of {} bytes; format {} has at least {}", name_, point_bytes_, format_,
             kFormats[format_].bytes);
    const bool large = minor_ == 4;
    if (header < (large ? kHeader14 : kHeader) || header > content_.size() || points_at_ < header ||
        points_at_ > content_.size())
      refuse("{}: is truncated or damaged: its header has {} bytes and points begin at byte {} of {}", name_, header,
             points_at_, content_.size());
    count_ = number<uint32_t>(content_, 107);
    if (large && number<uint64_t>(content_, 247) != 0) count_ = number<uint64_t>(content_, 247);
    if (const uint64_t there = (content_.size() - points_at_) / point_bytes_; count_ > there && !packed_)
      refuse("{}: is truncated: header claims {} points of {} bytes, {} are there", name_, count_, point_bytes_, there);
    for (size_t a = 0; a < 3; ++a)
      scale_[a] = number<double>(content_, 131 + 8 * a), offset_[a] = number<double>(content_, 155 + 8 * a);
    for (int a = 0; a < 3; ++a) {
      box_.hi[a] = number<double>(content_, 179 + 16 * size_t(a));
      box_.lo[a] = number<double>(content_, 187 + 16 * size_t(a));
    }
    records_at_ = header;
  }

  // Reads the records between header and points, and behind the points.
  void read_records() {
    uint64_t at = records_at_;
    for (uint32_t n = number<uint32_t>(content_, 100); n > 0 && at + 54 <= points_at_; --n) {
      const auto bytes = number<uint16_t>(content_, at + 20);
      take_record(at, 54, bytes);
      at += 54 + bytes;
    }
    if (minor_ == 4) at = number<uint64_t>(content_, 235);
    for (uint32_t n = minor_ == 4 ? number<uint32_t>(content_, 243) : 0;
         n > 0 && at < content_.size() && content_.size() - at >= 60; --n) {
      const uint64_t bytes = std::min<uint64_t>(number<uint64_t>(content_, at + 20), content_.size());
      take_record(at, 60, bytes);
      at += 60 + bytes;
    }
    if (!reference_ && !keys_.empty()) reference_ = reference_of_keys(keys_, key_texts_);
  }

  void take_record(uint64_t at, size_t head, uint64_t bytes) {
    if (bytes > content_.size() - at - head) return;  // damaged: nothing that the points need
    const std::string user = text_of(content_.substr(at + 2, 16));
    const auto id = number<uint16_t>(content_, at + 18);
    const std::string_view body = content_.substr(at + head, bytes);
    if (user == kLazUser && id == kLazRecord) laz_record_ = body;
    if (user == "LASF_Spec" && id == 4) take_extra_bytes(body);
    if (user != "LASF_Projection") return;
    if (id == 2112)
      if (auto found = reference_of_wkt(body)) reference_ = std::move(found);
    if (id == 34735) {
      keys_.resize(std::min<size_t>(body.size() / 2, 4 * 1024));
      std::memcpy(keys_.data(), body.data(), 2 * keys_.size());
    }
    if (id == 34737) key_texts_ = body;
  }

  void take_extra_bytes(std::string_view body) {
    using enum StoredType;
    constexpr StoredType kTypes[] = {kU8, kI8, kU16, kI16, kU32, kI32, kU64, kI64, kF32, kF64};
    constexpr size_t kRecord = 192;
    size_t at = kFormats[format_].bytes;
    for (size_t r = 0; r + kRecord <= body.size(); r += kRecord) {
      const std::string_view record = body.substr(r, kRecord);
      const int type = uint8_t(record[2]), options = uint8_t(record[3]);
      if (type == 0) at += size_t(options);  // bytes without a meaning
      if (type == 0 || type > 30) continue;
      const StoredType stored = kTypes[(type - 1) % 10];
      const int numbers = 1 + (type - 1) / 10;
      for (int k = 0; k < numbers && extra_.size() < kMaxColumns / 2; ++k) {
        ExtraNumber extra{at + size_t(k) * stored_bytes(stored), stored, 1, 0, std::nullopt};
        if (extra.at + stored_bytes(stored) > point_bytes_) return;
        const size_t of = 8 * size_t(k);
        if (options & 8) extra.scale = number<double>(record, 112 + of);
        if (options & 16) extra.offset = number<double>(record, 136 + of);
        if (options & 1)
          extra.none = stored >= kF32 ? number<double>(record, 40 + of)
                       : stored == kI8 || stored == kI16 || stored == kI32 || stored == kI64
                           ? double(number<int64_t>(record, 40 + of))
                           : double(number<uint64_t>(record, 40 + of));
        const std::string called = text_of(record.substr(4, 32));
        extra_names_.push_back(numbers > 1 ? fmt::format("{}[{}]", called, k) : called);
        extra_.push_back(extra);
      }
      at += size_t(numbers) * stored_bytes(stored);
    }
  }

  void name_columns() {
    const PointFormat& format = kFormats[format_];
    std::vector<std::string>& out = columns_;
    out = {"x",
           "y",
           "z",
           "intensity",
           "return_number",
           "number_of_returns",
           "classification",
           "scan_angle",
           "user_data",
           "point_source_id"};
    if (format.gps_time) out.push_back("gps_time");
    if (format.colours) out.insert(out.end(), {"red", "green", "blue"});
    if (format.infrared) out.push_back("infrared");
    out.insert(out.end(), extra_names_.begin(), extra_names_.end());
  }

  LazPoints packed_points() const {
    return LazPoints(content_, name_, laz_record_, {format_, point_bytes_, points_at_, count_});
  }

  uint64_t add_records(const ReadProgress& progress, uint64_t step, PointRows& rows) const {
    const uint64_t together = step << 16;
    uint64_t withheld = 0;
    for (uint64_t first = 0; first < count_; first += together) {
      if (progress) progress(double(first) / double(count_));
      const uint64_t bytes = std::min(together, count_ - first) * point_bytes_;
      withheld += add(content_.substr(points_at_ + first * point_bytes_, bytes), step * point_bytes_, rows);
    }
    return withheld;
  }

  // Adds every n-th one where there are more than `most`; of very many only the first ones of each chunk are decoded.
  uint64_t add_chunks(const ReadProgress& progress, uint64_t most, PointRows& rows) const {
    constexpr size_t kTogether = 32;
    constexpr uint64_t kMostDecoded = 1 << 24;  // in a few seconds on two cores
    const LazPoints points = packed_points();
    const size_t chunks = points.chunks();
    const uint64_t decoded_in_all = most < kMostDecoded ? std::min(count_, kMostDecoded) : count_;
    const uint64_t of_chunk = decoded_in_all < count_ ? decoded_in_all / chunks + 1 : count_;
    const uint64_t step = (decoded_in_all + most - 1) / most;
    uint64_t withheld = 0;
    for (size_t first = 0; first < chunks; first += kTogether) {
      if (progress) progress(double(first) / double(chunks));
      std::array<std::vector<char>, kTogether> decoded;
      in_parallel(size_t{0}, std::min(kTogether, chunks - first),
                  [&](size_t i) { decoded[i] = points.decode(first + i, of_chunk); });
      for (const std::vector<char>& records : decoded)
        withheld += add({records.data(), records.size()}, step * point_bytes_, rows);
    }
    return withheld;
  }

  bool is_withheld(std::string_view point) const { return format_ < 6 ? point[15] & 0x80 : point[15] & 4; }

  void decode(std::string_view point, std::vector<double>& row) const {
    const PointFormat& format = kFormats[format_];
    double* out = row.data();
    for (size_t a = 0; a < 3; ++a) *out++ = number<int32_t>(point, 4 * a) * scale_[a] + offset_[a];
    *out++ = number<uint16_t>(point, 12);
    const auto byte = [&](size_t at) { return uint8_t(point[at]); };
    if (format_ < 6) {
      *out++ = byte(14) & 7, *out++ = byte(14) >> 3 & 7, *out++ = byte(15) & 31;
      *out++ = int8_t(byte(16)), *out++ = byte(17), *out++ = number<uint16_t>(point, 18);
    } else {
      *out++ = byte(14) & 15, *out++ = byte(14) >> 4, *out++ = byte(16);
      *out++ = 0.006 * number<int16_t>(point, 18), *out++ = byte(17), *out++ = number<uint16_t>(point, 20);
    }
    if (format.gps_time) *out++ = number<double>(point, format.gps_time);
    for (size_t k = 0; k < 3 && format.colours; ++k) *out++ = number<uint16_t>(point, format.colours + 2 * k);
    if (format.infrared) *out++ = number<uint16_t>(point, format.infrared);
    for (const ExtraNumber& extra : extra_) {
      const double raw =
          with_type(extra.type, [&](auto zero) { return double(number<decltype(zero)>(point, extra.at)); });
      *out++ = raw == extra.none ? std::numeric_limits<double>::quiet_NaN() : raw * extra.scale + extra.offset;
    }
  }

  std::string_view content_;
  const std::string& name_;
  int minor_ = 0, format_ = 0;
  bool packed_ = false;
  size_t points_at_ = 0, point_bytes_ = 0, records_at_ = 0;
  uint64_t count_ = 0;
  double scale_[3] = {}, offset_[3] = {};
  geometry::DBox box_;
  std::vector<ExtraNumber> extra_;
  std::vector<std::string> extra_names_, columns_;
  std::vector<char> records_;  // those of all points, if they were compressed
  std::optional<Reference> reference_;
  std::vector<uint16_t> keys_;  // the numbers of GeoTIFF, and their texts
  std::string_view key_texts_, laz_record_;
};

}  // namespace

std::unique_ptr<const Part> decode_las(std::string_view content, const std::string& name) {
  auto part = std::make_unique<LasReader>(content, name);
  part->decode_all();
  return part;
}

bool is_packed_las(std::string_view content) {
  constexpr size_t kFormat = 104;  // the points' format; its highest bits: compressed
  return content.starts_with("LASF") && content.size() > kFormat && (content[kFormat] & 0xc0) != 0;
}

ReadCloud read_las(std::string_view content, const std::string& name, const ReadProgress& progress,
                   const std::string& array, uint64_t most_points) {
  return or_error([&] { return LasReader(content, name).read(progress, array, most_points); });
}

}  // namespace telesplat::data
