#include "services/data/volume/formats/dicom.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>
#include <iterator>

#include "services/data/volume/formats/header_text.h"
#include "services/data/volume/formats/inflater.h"

namespace telesplat::data {
namespace {

constexpr uint32_t kUndefined = 0xffffffff;
constexpr int kMostNesting = 16;
constexpr size_t kMostFrames = 65536;
constexpr size_t kMostInflated = size_t{2} << 30;

constexpr uint32_t kItem = 0xfffee000, kItemEnd = 0xfffee00d, kSequenceEnd = 0xfffee0dd;
constexpr uint32_t kPixels = 0x7fe00010, kFloatPixels = 0x7fe00008, kDoublePixels = 0x7fe00009;
constexpr uint32_t kPerFrame = 0x52009230;
constexpr std::string_view kDeflated = "1.2.840.10008.1.2.1.99";

// Sequences with values of a frame, or of all frames: functional groups (PS3.3 C.7.6.16) and detectors.
constexpr uint32_t kGroups[] = {0x52009229, kPerFrame,  0x00189114, 0x00189117, 0x00189118, 0x00189226, 0x00189329,
                                0x00209111, 0x00209113, 0x00209116, 0x00289110, 0x00289145, 0x00540022};

bool is_type(std::string_view vr) {
  constexpr std::string_view kAll =
      "AE AS AT CS DA DS DT FD FL IS LO LT OB OD OF OL OV OW PN SH SL SQ SS ST SV TM UC UI UL UN UR US UT UV ";
  return vr.find(' ') == vr.npos && kAll.find(std::string(vr) + ' ') != kAll.npos;
}

uint16_t little16(std::string_view content, size_t at) {
  return uint16_t(static_cast<unsigned char>(content[at]) | static_cast<unsigned char>(content[at + 1]) << 8);
}

bool has_preamble(std::string_view content) { return content.size() >= 132 && content.substr(128, 4) == "DICM"; }

struct Element {
  uint32_t tag = 0;
  std::array<char, 2> vr{};
  uint32_t length = 0;
};

class Parser {
 public:
  Parser(std::string_view content, const std::string& path) : content_(content), path_(path) { base_.path = path; }

  std::vector<DicomSlice> run() {
    if (!is_dicom(content_)) refuse("{}: is no DICOM file: no DICM at byte 128, and no elements before", path_);
    end_of_meta();
    if (base_.data.syntax == kDeflated) {
      inflated_ = need(inflate_dicom(content_, path_));
      content_ = inflated_, at_ = 0, base_.data.deflated = true;
    }
    choose_syntax();
    while (!done_ && at_ + 8 <= content_.size()) element(0, false);
    return slices();
  }

  // Returns the end of the meta group, which is always explicit and little-endian.
  size_t end_of_meta() {
    at_ = has_preamble(content_) ? 132 : 0;
    while (at_ + 2 <= content_.size() && u16(at_) == 2) element(0, false);
    return at_;
  }

 private:
  uint16_t u16(size_t at) const {
    const uint16_t little = little16(content_, at);
    return big_ ? uint16_t(little << 8 | little >> 8) : little;
  }
  uint32_t u32(size_t at) const {
    return big_ ? uint32_t(u16(at)) << 16 | u16(at + 2) : uint32_t(u16(at + 2)) << 16 | u16(at);
  }
  // Returns a double in the file's byte order; 0 if it is not finite.
  double real(size_t at) const {
    const uint64_t a = u32(at), b = u32(at + 4), bits = big_ ? a << 32 | b : b << 32 | a;
    double value;
    std::memcpy(&value, &bits, sizeof value);
    return std::isfinite(value) ? value : 0;
  }
  [[noreturn]] void cut() const {
    refuse("{}: is cut or damaged: an element at byte {} does not fit its {} bytes", path_, at_, content_.size());
  }

  // A file's own statement on types may be false: the first element itself shows whether it has one.
  void choose_syntax() {
    big_ = base_.data.big_endian = base_.data.syntax == "1.2.840.10008.1.2.2";
    explicit_ = base_.data.syntax != "1.2.840.10008.1.2";
    if (!big_ && at_ + 6 <= content_.size()) explicit_ = is_type(content_.substr(at_ + 4, 2));
  }

  // Reads tag, type and length; leaves at_ at the value.
  Element begin_element() {
    if (content_.size() - at_ < 8) cut();
    Element e;
    e.tag = uint32_t(u16(at_)) << 16 | u16(at_ + 2);
    if (e.tag >> 16 == 0xfffe || !explicit_) {  // items have no type in any syntax
      e.length = u32(at_ + 4);
      at_ += 8;
      return e;
    }
    e.vr = {content_[at_ + 4], content_[at_ + 5]};
    constexpr std::string_view kLong[] = {"OB", "OD", "OF", "OL", "OV", "OW", "SQ", "SV", "UC", "UN", "UR", "UT", "UV"};
    if (std::find(std::begin(kLong), std::end(kLong), std::string_view(e.vr.data(), 2)) != std::end(kLong)) {
      if (content_.size() - at_ < 12) cut();
      e.length = u32(at_ + 8);
      at_ += 12;
    } else {
      e.length = u16(at_ + 6);
      at_ += 8;
    }
    return e;
  }

  // inside: within functional groups, whose values are kept.
  void element(int depth, bool inside) {
    const Element e = begin_element();
    if (depth == 0 && (e.tag == kPixels || e.tag == kFloatPixels || e.tag == kDoublePixels)) return pixels(e);
    const bool group =
        (depth == 0 || inside) && std::find(std::begin(kGroups), std::end(kGroups), e.tag) != std::end(kGroups);
    if (e.length != kUndefined && e.length > content_.size() - at_) cut();
    if (group || e.length == kUndefined) return sequence(e, depth, group);
    if (depth == 0 || inside) keep(e.tag, content_.substr(at_, e.length));
    at_ += e.length;
  }

  // Goes through the items of a sequence.
  void sequence(const Element& e, int depth, bool group) {
    if (depth >= kMostNesting) refuse("{}: has elements nested deeper than {}", path_, kMostNesting);
    const bool was_explicit = explicit_;
    if (e.vr == std::array{'U', 'N'}) explicit_ = false;  // PS3.5 6.2.2 note 2
    const size_t end = e.length == kUndefined ? content_.size() : at_ + e.length;
    while (e.length == kUndefined || at_ < end) {
      const auto begun = begin_element();
      if (begun.tag == kSequenceEnd) break;
      if (begun.tag != kItem) cut();
      if (e.tag == kPerFrame && depth == 0) {
        if (frames_.size() == kMostFrames) refuse("{}: has more than {} frames", path_, kMostFrames);
        frames_.push_back(base_);
        into_ = &frames_.back();
      }
      item(begun.length, depth, group);
    }
    if (depth == 0) into_ = &base_;
    explicit_ = was_explicit;
  }

  void item(uint32_t length, int depth, bool group) {
    if (length != kUndefined && length > content_.size() - at_) cut();
    const size_t end = length == kUndefined ? content_.size() : at_ + length;
    if (length != kUndefined && !group) at_ = end;
    while (length == kUndefined || at_ < end) {
      if (content_.size() - at_ < 8) cut();
      if (length == kUndefined && (uint32_t(u16(at_)) << 16 | u16(at_ + 2)) == kItemEnd) {
        at_ += 8;
        break;
      }
      element(depth + 1, group);
    }
  }

  void pixels(const Element& e) {
    constexpr std::string_view kBase = "1.2.840.10008.1.2";
    const std::string_view syntax = base_.data.syntax;
    const bool plain = syntax.empty() || syntax == kBase || syntax == "1.2.840.10008.1.2.1" || syntax == kDeflated ||
                       syntax == "1.2.840.10008.1.2.2";
    base_.data.compressed = e.length == kUndefined;
    base_.pixels.is_float = e.tag != kPixels;
    if (!base_.data.compressed && !plain && syntax.starts_with(kBase))
      refuse("{}: its transfer syntax is {}, a compressed one, but its pixels are not in fragments", path_,
             in_quotes(syntax));
    if (!base_.data.compressed && e.length > content_.size() - at_)
      refuse("{}: is cut: claims {} bytes of pixels, has {}", path_, e.length, content_.size() - at_);
    base_.data.at = at_, base_.data.bytes = base_.data.compressed ? content_.size() - at_ : e.length;
    done_ = true;
  }

  // Returns a slice for each frame; also one for a file without pixels.
  std::vector<DicomSlice> slices() {
    const size_t count = base_.data.bytes > 0 ? size_t(base_.frames) : 1;
    if (count > kMostFrames) refuse("{}: has {} frames, limit {}", path_, count, kMostFrames);
    const bool described = frames_.size() >= count && count > 0;
    if (!frames_.empty() && !described)
      refuse("{}: has {} frames, and places {} of them", path_, count, frames_.size());
    const uint64_t bytes = base_.pixels.bytes();
    if (count > 1 && (bytes == 0 || count > base_.data.bytes / (base_.data.compressed ? 1 : bytes)))
      refuse("{}: claims {} frames of {} x {} pixels ({} bytes each), has {} bytes of them", path_, count,
             base_.pixels.columns, base_.pixels.rows, bytes, base_.data.bytes);
    if (!described) place_frames(count);
    frames_.resize(count);
    for (size_t f = 0; f < count; ++f) {
      DicomSlice& s = frames_[f];
      s.frame = int(f), s.frames = int(count);
      s.data.compressed = base_.data.compressed, s.pixels.is_float = base_.pixels.is_float;
      s.data.at = base_.data.at, s.data.bytes = base_.data.bytes;
      if (count > 1 && !s.data.compressed) s.data.at += f * bytes, s.data.bytes = bytes;
    }
    return std::move(frames_);
  }

  // Places frames without own positions: at offsets along the normal if given (a dose), else one behind the other.
  void place_frames(size_t count) {
    frames_.assign(count, base_);
    if (count == 1) return;
    const double spacing = std::abs(base_.plane.slice_spacing);
    const bool offsets = offsets_.size() >= count;
    const glm::dvec3 normal = base_.plane.normal();
    for (size_t f = 0; f < count; ++f) {
      auto& position = frames_[f].plane.position;
      if (!offsets) frames_[f].plane.stacked = true;
      if (position && offsets)
        *position += normal * (offsets_[f] - offsets_[0]);
      else if (position && spacing > 0)
        *position += normal * (double(f) * spacing);
      else
        position.reset();
    }
  }

  void keep(uint32_t tag, std::string_view value) {
    const size_t at = size_t(value.data() - content_.data());
    if (value.size() >= 2) keep_word(tag, u16(at));
    if (value.size() == 8 && tag == 0x00189087) into_->times[4] = real(at);
    if (value.size() == 8 && tag == 0x00209153) into_->times[1] = real(at);
    if (value.size() == 8 && tag == 0x00189082) into_->times[3] = real(at);
    if (value.size() == 4 && tag == 0x00209128) into_->times[0] = u32(at);
    while (!value.empty() && (value.back() == '\0' || value.back() == ' ')) value.remove_suffix(1);
    keep_text(tag, trim(value));
  }

  static std::optional<std::vector<double>> decimals(std::string_view text) {
    std::string plain(text);
    std::replace(plain.begin(), plain.end(), '\\', ' ');
    return numbers(plain);
  }
  // Reads decimal strings, separated by backslashes. Changes nothing if they are fewer than `to`.
  static bool decimals(std::string_view text, auto&... to) {
    const auto all = decimals(text.substr(0, 400));
    if (!all || all->size() < sizeof...(to)) return false;
    if (!std::all_of(all->begin(), all->end(), [](double v) { return std::abs(v) < 1e12; })) return false;
    size_t i = 0;
    ((to = (*all)[i++]), ...);
    return true;
  }

  void keep_text(uint32_t tag, std::string_view text) {
    DicomSlice& out = *into_;
    const std::pair<uint32_t, std::string*> texts[] = {
        {0x00020010, &out.data.syntax}, {0x00080008, &out.image_type},         {0x00089007, &out.image_type},
        {0x00080018, &out.uid},         {0x00080060, &out.modality},           {0x0008103e, &out.series_text},
        {0x0020000e, &out.series},      {0x00280004, &out.pixels.photometric},
    };
    for (const auto& [t, to] : texts)
      if (t == tag) *to = std::string(text.substr(0, 64));
    const std::pair<uint32_t, double*> reals[] = {
        {0x00080032, &out.times[5]},     {0x00180050, &out.plane.thickness},
        {0x00180081, &out.times[3]},     {0x00180088, &out.plane.slice_spacing},
        {0x00181060, &out.times[1]},     {0x00200011, &out.series_number},
        {0x00200012, &out.times[2]},     {0x00200013, &out.instance},
        {0x00200100, &out.times[0]},     {0x00281052, &out.pixels.intercept},
        {0x00281053, &out.pixels.slope}, {0x3004000e, &out.pixels.slope},
    };
    for (const auto& [t, to] : reals)
      if (t == tag) decimals(text, *to);
    keep_places(tag, text, out.plane);
  }

  void keep_places(uint32_t tag, std::string_view text, DicomPlane& out) {
    glm::dvec3 a, b;
    double frames = 1;
    switch (tag) {
      case 0x00200032:
        if (decimals(text, a.x, a.y, a.z)) out.position = a;
        break;
      case 0x00200037:
        if (decimals(text, a.x, a.y, a.z, b.x, b.y, b.z) && glm::length(glm::cross(a, b)) > 0.9)
          out.along_row = glm::normalize(a), out.along_column = glm::normalize(b);
        break;
      case 0x00280008:
        if (decimals(text, frames) && frames >= 1 && frames < 1e9) into_->frames = int(frames);
        break;
      case 0x00181164:
      case 0x00280030:
        decimals(text, out.spacing.y, out.spacing.x);
        break;  // the spacing between rows comes first
      case 0x3004000c:
        if (auto all = decimals(text)) offsets_ = std::move(*all);
        break;
      default:
        break;
    }
  }

  void keep_word(uint32_t tag, int word) {
    DicomPixels& out = into_->pixels;
    const std::pair<uint32_t, int*> words[] = {{0x00280002, &out.components},
                                               {0x00280010, &out.rows},
                                               {0x00280011, &out.columns},
                                               {0x00280100, &out.bits_allocated},
                                               {0x00280101, &out.bits_stored}};
    for (const auto& [t, to] : words)
      if (t == tag) *to = word;
    if (tag == 0x00280102) out.high_bit = word;
    if (tag == 0x00280103) out.is_signed = word == 1;
    if (tag == 0x00280120) out.padding = word;
    if (tag == 0x00280121) out.padding_limit = word;
  }

  std::string_view content_;
  std::string inflated_;
  const std::string& path_;
  size_t at_ = 0;
  bool explicit_ = true, big_ = false, done_ = false;
  DicomSlice base_;
  std::vector<DicomSlice> frames_;
  DicomSlice* into_ = &base_;  // the slice whose values are being read
  std::vector<double> offsets_;
};

}  // namespace

bool is_dicom(std::string_view content) {
  if (has_preamble(content)) return true;
  // Without a preamble: three elements with ascending tags, from groups that come before pixels.
  uint32_t last = 0;
  for (size_t at = 0, elements = 0; elements < 3; ++elements) {
    if (content.size() - at < 12) return false;
    const uint32_t tag = uint32_t(little16(content, at)) << 16 | little16(content, at + 2);
    const bool typed = is_type(content.substr(at + 4, 2));
    const size_t length = typed ? little16(content, at + 6) : little16(content, at + 4);
    if (tag <= last || tag < 0x00020000 || tag > 0x0028ffff || length % 2 > 0 || length > 1024) return false;
    if (!typed && little16(content, at + 6) != 0) return false;
    last = tag;
    const bool with_long_length = typed && content.substr(at + 4, 2) == "OB";
    at += with_long_length ? 12 + size_t{little16(content, at + 8)} : 8 + length;
    if (at > content.size()) return false;
  }
  return true;
}

Result<std::vector<DicomSlice>> parse_dicom(std::string_view content, const std::string& path) {
  return or_error([&] { return Parser(content, path).run(); });
}

Result<std::string> inflate_dicom(std::string_view content, const std::string& path) {
  return or_error([&] {
    content.remove_prefix(Parser(content, path).end_of_meta());
    std::string out;
    Inflater inflater(content, path, true);
    for (size_t had = 0, n = 1; n > 0 && had < kMostInflated; had += n) {
      out.resize(had + std::clamp<size_t>(had, 1 << 16, 1 << 24));
      n = inflater.read(out.data() + had, out.size() - had);
      out.resize(had + n);
    }
    if (!inflater.ended()) refuse("{}: its deflated elements are cut or more than {} bytes", path, kMostInflated);
    return out;
  });
}

}  // namespace telesplat::data
