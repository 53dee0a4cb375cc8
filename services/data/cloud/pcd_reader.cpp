#include <fmt/format.h>

#include <array>
#include <bit>
#include <cstring>

#include "services/data/base/refusal.h"
#include "services/data/base/stored_type.h"
#include "services/data/base/text_scanner.h"
#include "services/data/cloud/point_rows.h"
#include "services/data/cloud/readers.h"

namespace telesplat::data {
namespace {

constexpr size_t kMostPointBytes = 1 << 16;

// One number of each point.
struct PcdNumber {
  StoredType type = StoredType::kF32;
  size_t at = 0;        // among the bytes of a point
  size_t field_at = 0;  // likewise of its field, which may have several numbers,
  size_t field_bytes = 0;
  bool packed = false;  // three bytes of a colour
};

struct PcdField {
  std::string name;
  size_t bytes = 4, count = 1;
  char type = 'F';
};

// Unpacks LZF, as M. Lehmann's liblzf writes it. Refuses what does not become exactly `bytes`.
std::vector<char> unpack_lzf(std::string_view packed, size_t bytes, const std::string& name) {
  constexpr size_t kMostGrowth = 264 / 3 + 1;  // three bytes stand for up to 264
  const auto damaged = [&](size_t made) {
    refuse("{}: its compressed points are damaged: {} of {} bytes can be unpacked", name, made, bytes);
  };
  if (bytes / kMostGrowth > packed.size()) damaged(0);
  std::vector<char> out;
  out.reserve(bytes);
  size_t at = 0;
  const auto next = [&]() -> size_t {
    if (at == packed.size()) damaged(out.size());
    return uint8_t(packed[at++]);
  };
  while (at < packed.size()) {
    const size_t control = next();
    if (control < 32) {
      const size_t run = control + 1;
      if (run > packed.size() - at || run > bytes - out.size()) damaged(out.size());
      out.insert(out.end(), packed.begin() + std::ptrdiff_t(at), packed.begin() + std::ptrdiff_t(at + run));
      at += run;
      continue;
    }
    size_t run = control >> 5;
    if (run == 7) run += next();
    run += 2;
    const size_t back = ((control & 31) << 8 | next()) + 1;
    if (back > out.size() || run > bytes - out.size()) damaged(out.size());
    for (size_t i = 0; i < run; ++i) out.push_back(char(out[out.size() - back]));
  }
  if (out.size() != bytes) damaged(out.size());
  return out;
}

class PcdReader {
 public:
  PcdReader(std::string_view content, const std::string& name) : content_(content), name_(name), scan_(content) {}

  std::shared_ptr<const SquareCloud> read(const ReadProgress& progress, const std::string& array) {
    read_header();
    lay_out();
    PointRows rows(name_, columns_, array);
    if (viewpoint_ != glm::dvec3(0)) rows.begin_scan(viewpoint_);
    std::vector<double> row(numbers_.size());
    const std::string_view body = content_.substr(scan_.offset());
    std::vector<char> unpacked;
    if (encoding_ != "ascii") unpacked = check(body);
    const std::string_view bytes = unpacked.empty() ? body : std::string_view(unpacked.data(), unpacked.size());
    for (uint64_t i = 0; i < points_; ++i) {
      if ((i & 0xffff) == 0 && progress) progress(double(i) / double(points_));
      for (size_t n = 0; n < row.size(); ++n)
        row[n] = encoding_ == "ascii" ? text_number(numbers_[n], i) : number(bytes, numbers_[n], i);
      rows.add(row);
    }
    return rows.finish(fmt::format("PCD points ({})", encoding_), colours_of_bytes_ ? 255 : 1);
  }

 private:
  void read_header() {
    constexpr int kMostLines = 100;
    double width = -1, height = 1, points = -1;
    for (int line = 0;; ++line) {
      if (line == kMostLines || scan_.at_end()) refuse("{}: its PCD header has no line DATA", name_);
      if (!scan_.skip_blanks('#')) {
        scan_.next_line();
        continue;
      }
      const std::string key(scan_.word().substr(0, 20));
      std::vector<std::string_view> words;
      while (words.size() <= kMaxColumns && scan_.skip_blanks()) words.push_back(scan_.word());
      scan_.next_line();
      if (key == "FIELDS" || key == "COLUMNS") {
        fields_.clear();
        for (const std::string_view word : words) fields_.push_back({.name = std::string(word)});
        if (fields_.size() > kMaxColumns) refuse("{}: more than {} fields", name_, kMaxColumns);
      }
      const auto numbers = [&](auto&& take) {
        for (size_t i = 0; i < words.size(); ++i) {
          double value = -1;
          if (TextScanner(words[i]).number(value)) take(i, value);
        }
      };
      if (key == "WIDTH") numbers([&](size_t, double v) { width = v; });
      if (key == "HEIGHT") numbers([&](size_t, double v) { height = v; });
      if (key == "POINTS") numbers([&](size_t, double v) { points = v; });
      if (key == "VIEWPOINT")
        numbers([&](size_t i, double v) {
          if (i < 3) viewpoint_[int(i)] = v;
        });
      for (size_t i = 0; i < std::min(words.size(), fields_.size()); ++i) {
        double value = 0;
        if (key == "TYPE") fields_[i].type = words[i].empty() ? ' ' : words[i][0];
        if ((key != "SIZE" && key != "COUNT") || !TextScanner(words[i]).number(value)) continue;
        if (!(value >= (key == "SIZE") && value <= 1 << 20))
          refuse("{}: {} {:.20} of field {}", name_, key, words[i], fields_[i].name.substr(0, 40));
        (key == "SIZE" ? fields_[i].bytes : fields_[i].count) = size_t(value);
      }
      if (key != "DATA") continue;
      encoding_ = words.empty() ? "" : std::string(words[0].substr(0, 20));
      break;
    }
    if (points < 0) points = width * height;
    if (encoding_ != "ascii" && encoding_ != "binary" && encoding_ != "binary_compressed")
      refuse("{}: DATA {}: ascii, binary and binary_compressed are read", name_, encoding_);
    if (!(points >= 0 && points < 1e15)) refuse("{}: its header claims {} points", name_, points);
    points_ = uint64_t(points);
  }

  // Finds the numbers of a point.
  void lay_out() {
    for (const PcdField& field : fields_) {
      const bool whole = field.type == 'U' || field.type == 'I',
                 size_fits = field.bytes == 1 || field.bytes == 2 || field.bytes == 4 || field.bytes == 8;
      const bool padding = field.name == "_", real = field.type == 'F' && (field.bytes == 4 || field.bytes == 8);
      if (!padding && !real && !(whole && size_fits))
        refuse("{}: field {} has type {} of {} bytes", name_, field.name.substr(0, 40), field.type, field.bytes);
      const Column meaning = column_named(field.name);
      for (size_t k = 0; k < field.count && !padding; ++k) {
        if (numbers_.size() == kMaxColumns) refuse("{}: more than {} numbers a point", name_, kMaxColumns);
        columns_.push_back(field.count > 1 ? fmt::format("{}[{}]", field.name, k) : field.name);
        const StoredType type = real ? (field.bytes == 4 ? StoredType::kF32 : StoredType::kF64)
                                     : whole_type(field.bytes, field.type == 'I');
        const bool packed = meaning == Column::kPacked && field.count == 1 && field.bytes == 4;
        numbers_.push_back({type, point_bytes_ + k * field.bytes, point_bytes_, field.bytes * field.count, packed});
        words_before_.push_back(words_ + k);
      }
      colours_of_bytes_ |= meaning == Column::kRed && whole;
      point_bytes_ += field.bytes * field.count, words_ += field.count;
    }
    if (point_bytes_ == 0 || point_bytes_ > kMostPointBytes)
      refuse("{}: its points have {} bytes; 1 to {} are read", name_, point_bytes_, kMostPointBytes);
  }

  // Returns unpacked points, if they are compressed; checks their number.
  std::vector<char> check(std::string_view body) const {
    if (points_ > kMaxPoints) refuse("{}: {} points, the limit is {}", name_, points_, kMaxPoints);
    const uint64_t needed = points_ * point_bytes_;
    if (encoding_ == "binary") {
      if (needed > body.size())
        refuse("{}: is truncated: header claims {} points of {} bytes, but only {} bytes follow it", name_, points_,
               point_bytes_, body.size());
      return {};
    }
    uint32_t sizes[2] = {};  // packed, unpacked
    if (body.size() >= sizeof sizes) std::memcpy(sizes, body.data(), sizeof sizes);
    if (body.size() < sizeof sizes || sizes[0] > body.size() - sizeof sizes)
      refuse("{}: is truncated: {} bytes of compressed points are claimed, {} follow the header", name_, sizes[0],
             body.size());
    if (sizes[1] != needed)
      refuse("{}: compressed points of {} bytes, {} points of {} bytes are claimed", name_, sizes[1], points_,
             point_bytes_);
    return unpack_lzf(body.substr(sizeof sizes, sizes[0]), sizes[1], name_);
  }

  double number(std::string_view bytes, const PcdNumber& n, uint64_t point) const {
    // Compressed points are sorted by field.
    const size_t at = encoding_ == "binary" ? point * point_bytes_ + n.at
                                            : points_ * n.field_at + point * n.field_bytes + (n.at - n.field_at);
    return with_type(n.packed ? StoredType::kU32 : n.type, [&](auto zero) {
      std::memcpy(&zero, bytes.data() + at, sizeof zero);
      return double(zero);
    });
  }

  // Reads the next number of a text; goes on to the next line behind a point's last.
  double text_number(const PcdNumber& n, uint64_t point) {
    const auto index = size_t(&n - numbers_.data());
    double out = 0;
    for (size_t skipped = index == 0 ? words_before_[0] : words_before_[index] - words_before_[index - 1] - 1;
         skipped > 0; --skipped)
      if (scan_.skip_blanks()) scan_.word();
    if (index == 0) scan_.skip_space();
    if (!scan_.skip_blanks() || !scan_.number(out))
      refuse("{}: is truncated or damaged: point {} of {} cannot be read", name_, point, points_);
    if (index + 1 == numbers_.size()) scan_.next_line();
    if (!n.packed || n.type != StoredType::kF32) return out;
    return std::bit_cast<uint32_t>(float(out));
  }

  std::string_view content_;
  const std::string& name_;
  TextScanner scan_;
  std::vector<PcdField> fields_;
  std::vector<PcdNumber> numbers_;
  std::vector<std::string> columns_;  // a name a number
  std::vector<size_t> words_before_;  // in a line of text, of each number
  size_t point_bytes_ = 0, words_ = 0;
  bool colours_of_bytes_ = false;
  uint64_t points_ = 0;
  std::string encoding_;
  glm::dvec3 viewpoint_{0};
};

}  // namespace

ReadCloud read_pcd(std::string_view content, const std::string& name, const ReadProgress& progress,
                   const std::string& array) {
  return or_error([&] { return PcdReader(content, name).read(progress, array); });
}

}  // namespace telesplat::data
