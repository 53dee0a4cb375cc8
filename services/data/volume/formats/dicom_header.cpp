#include "services/data/volume/formats/dicom_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "services/data/volume/formats/header_text.h"

namespace telesplat::data {
namespace {

constexpr uint32_t kUndefined = 0xffffffff;
constexpr int kMostNesting = 16;

constexpr uint32_t kItem = 0xfffee000, kItemEnd = 0xfffee00d, kSequenceEnd = 0xfffee0dd;
constexpr uint32_t kPixels = 0x7fe00010;

struct Element {
  uint32_t tag = 0;
  std::array<char, 2> vr{};
  uint32_t length = 0;
  bool sequence() const { return vr == std::array{'S', 'Q'}; }
};

class Parser {
 public:
  Parser(std::string_view content, const std::string& path) : content_(content), path_(path) { out_.path = path; }

  Result<DicomSlice> run() {
    if (content_.size() < 132 || content_.substr(128, 4) != "DICM")
      return Error{path_ + ": is no DICOM file: no DICM at byte 128"};
    at_ = 132;
    // The file's meta group is always explicit and little-endian; its end is where another group begins.
    while (at_ + 2 <= content_.size() && u16(at_) == 2)
      if (auto status = element(0); !status) return status.error();
    if (auto status = choose_syntax(); !status) return status.error();
    while (!done_ && at_ + 8 <= content_.size())
      if (auto status = element(0); !status) return status.error();
    return out_;
  }

 private:
  uint16_t u16(size_t at) const {
    const auto byte = [&](size_t i) { return unsigned(static_cast<unsigned char>(content_[at + i])); };
    return uint16_t(big_ ? byte(0) << 8 | byte(1) : byte(1) << 8 | byte(0));
  }
  uint32_t u32(size_t at) const {
    return big_ ? uint32_t(u16(at)) << 16 | u16(at + 2) : uint32_t(u16(at + 2)) << 16 | u16(at);
  }
  Error cut() const {
    return Error{fmt::format("{}: is cut or damaged: an element at byte {} does not fit its {} bytes", path_, at_,
                             content_.size())};
  }

  Status choose_syntax() {
    constexpr std::string_view kBase = "1.2.840.10008.1.2";
    if (syntax_ == kBase)
      explicit_ = false;
    else if (syntax_ == "1.2.840.10008.1.2.2")
      big_ = true;
    else if (syntax_ != "1.2.840.10008.1.2.1")
      return Error{fmt::format("{}: its transfer syntax is {}; supported are uncompressed ones ({}, {}.1, {}.2)", path_,
                               in_quotes(syntax_), kBase, kBase, kBase)};
    out_.big_endian = big_;
    return ok_status();
  }

  // Tag, type and length; leaves at_ at the value.
  Result<Element> begin_element() {
    if (content_.size() - at_ < 8) return cut();
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
      if (content_.size() - at_ < 12) return cut();
      e.length = u32(at_ + 8);
      at_ += 12;
    } else {
      e.length = u16(at_ + 6);
      at_ += 8;
    }
    return e;
  }

  Status element(int depth) {
    const auto begun = begin_element();
    if (!begun) return begun.error();
    const Element e = *begun;
    if (depth == 0 && e.tag == kPixels) return pixels(e);
    if (e.length == kUndefined) return sequence(depth, e.vr == std::array{'U', 'N'});
    if (e.length > content_.size() - at_) return cut();
    if (depth == 0 && !e.sequence()) keep(e.tag, content_.substr(at_, e.length));
    at_ += e.length;
    return ok_status();
  }

  // Skips a sequence of undefined length: items, until its end is marked.
  Status sequence(int depth, bool implicit_inside) {
    if (depth >= kMostNesting) return Error{fmt::format("{}: has elements nested deeper than {}", path_, kMostNesting)};
    const bool was_explicit = explicit_;
    if (implicit_inside) explicit_ = false;  // PS3.5 6.2.2 note 2
    const auto skipped = [&]() -> Status {
      for (;;) {
        const auto item = begin_element();
        if (!item) return item.error();
        if (item->tag == kSequenceEnd) return ok_status();
        if (item->tag != kItem) return cut();
        if (item->length != kUndefined) {
          if (item->length > content_.size() - at_) return cut();
          at_ += item->length;
          continue;
        }
        for (;;) {
          if (content_.size() - at_ < 8) return cut();
          if ((uint32_t(u16(at_)) << 16 | u16(at_ + 2)) == kItemEnd) break;
          if (auto status = element(depth + 1); !status) return status;
        }
        at_ += 8;
      }
    }();
    explicit_ = was_explicit;
    return skipped;
  }

  Status pixels(const Element& e) {
    if (e.length == kUndefined) return Error{path_ + ": its pixels are compressed; supported are uncompressed ones"};
    if (e.length > content_.size() - at_)
      return Error{
          fmt::format("{}: is cut: claims {} bytes of pixels, has {}", path_, e.length, content_.size() - at_)};
    out_.data_at = at_, out_.data_bytes = e.length;
    done_ = true;
    return ok_status();
  }

  void keep(uint32_t tag, std::string_view value) {
    if (value.size() >= 2) keep_word(tag, u16(size_t(value.data() - content_.data())));
    while (!value.empty() && (value.back() == '\0' || value.back() == ' ')) value.remove_suffix(1);
    keep_text(tag, trim(value));
  }

  // Decimal strings, separated by backslashes. Nothing changes if they are not as many numbers.
  static bool decimals(std::string_view text, auto&... to) {
    std::string plain(text.substr(0, 400));
    std::replace(plain.begin(), plain.end(), '\\', ' ');
    const auto all = numbers(plain);
    if (!all || all->size() < sizeof...(to)) return false;
    size_t i = 0;
    ((to = (*all)[i++]), ...);
    return true;
  }

  void keep_text(uint32_t tag, std::string_view text) {
    glm::dvec3 a, b;
    double frames = 1;
    switch (tag) {
      case 0x00020010:
        syntax_ = std::string(text.substr(0, 64));
        break;
      case 0x00080060:
        out_.modality = std::string(text.substr(0, 16));
        break;
      case 0x0008103e:
        out_.series_text = std::string(text.substr(0, 64));
        break;
      case 0x00200011:
        decimals(text, out_.series_number);
        break;
      case 0x0020000e:
        out_.series = std::string(text.substr(0, 64));
        break;
      case 0x00200013:
        decimals(text, out_.instance);
        break;
      case 0x00180050:
        decimals(text, out_.thickness);
        break;
      case 0x00180088:
        decimals(text, out_.slice_spacing);
        break;
      case 0x00200032:
        if (decimals(text, a.x, a.y, a.z)) out_.position = a;
        break;
      case 0x00200037:
        if (decimals(text, a.x, a.y, a.z, b.x, b.y, b.z)) out_.along_row = a, out_.along_column = b;
        break;
      case 0x00280008:
        if (decimals(text, frames) && frames >= 1 && frames < 1e6) out_.frames = int(frames);
        break;
      case 0x00280030:
        decimals(text, out_.spacing.y, out_.spacing.x);
        break;  // between rows comes first
      case 0x00281052:
        decimals(text, out_.intercept);
        break;
      case 0x00281053:
        decimals(text, out_.slope);
        break;
      default:
        break;
    }
  }

  void keep_word(uint32_t tag, int word) {
    switch (tag) {
      case 0x00280002:
        out_.components = word;
        break;
      case 0x00280010:
        out_.rows = word;
        break;
      case 0x00280011:
        out_.columns = word;
        break;
      case 0x00280100:
        out_.bits_allocated = word;
        break;
      case 0x00280101:
        out_.bits_stored = word;
        break;
      case 0x00280103:
        out_.is_signed = word == 1;
        break;
      default:
        break;
    }
  }

  std::string_view content_;
  const std::string& path_;
  size_t at_ = 0;
  bool explicit_ = true, big_ = false, done_ = false;
  std::string syntax_;
  DicomSlice out_;
};

}  // namespace

Result<DicomSlice> parse_dicom(std::string_view content, const std::string& path) {
  return Parser(content, path).run();
}

}  // namespace telesplat::data
