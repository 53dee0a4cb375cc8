#include "services/data/vtk/files.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

namespace telesplat::data::vtk {
namespace {

constexpr size_t kNone = std::string_view::npos;

// Returns the end of the markup that begins at `at`, after its '>'; npos: it does not end.
size_t markup_end(std::string_view text, size_t at) {
  const auto behind = [&](std::string_view mark) {
    const size_t found = text.find(mark, at);
    return found == kNone ? kNone : found + mark.size();
  };
  const std::string_view start = text.substr(at, 9);
  if (start.starts_with("<!--")) return behind("-->");
  if (start.starts_with("<?")) return behind("?>");
  if (start == "<![CDATA[") return behind("]]>");
  for (char quote = 0; at < text.size(); ++at) {
    if (quote != 0)
      quote = text[at] == quote ? 0 : quote;
    else if (text[at] == '"' || text[at] == '\'')
      quote = text[at];
    else if (text[at] == '>')
      return at + 1;
  }
  return kNone;
}

bool is_tag(std::string_view markup) { return markup.size() > 1 && markup[1] != '!' && markup[1] != '?'; }

// Returns the file's tags; each text between them is replaced by its place: "offset length". Ends before appended data,
// at `appended`.
std::string skeleton_of(std::string_view content, size_t& appended) {
  std::string out;
  appended = kNone;
  for (size_t at = content.find('<'); at != kNone;) {
    if (content.substr(at).starts_with("<AppendedData")) {
      appended = at;
      return out + "</VTKFile>";
    }
    const size_t end = markup_end(content, at);
    if (end == kNone) break;
    if (const auto markup = content.substr(at, end - at); is_tag(markup)) out += markup;
    at = content.find('<', end);
    if (const auto text = trim(content.substr(end, at == kNone ? 0 : at - end)); !text.empty())
      out += fmt::format("{} {}", text.data() - content.data(), text.size());
  }
  return out;
}

}  // namespace

bool type_of(std::string_view text, StoredType& out) {
  constexpr const char* kNames[] = {"UInt8", "Int8",   "UInt16", "Int16",   "UInt32",
                                    "Int32", "UInt64", "Int64",  "Float32", "Float64"};
  const auto found = std::find(std::begin(kNames), std::end(kNames), text);
  out = StoredType(found - std::begin(kNames));
  return found != std::end(kNames);
}

pugi::xml_document root_tag(std::string_view content) {
  pugi::xml_document out;
  size_t at = 0;
  if (content.starts_with("\xef\xbb\xbf")) at = 3;
  for (;;) {
    while (at < content.size() && static_cast<unsigned char>(content[at]) <= ' ') ++at;
    if (at >= content.size() || content[at] != '<') return out;
    const size_t end = markup_end(content, at);
    if (end == kNone) return out;
    const std::string_view markup = content.substr(at, end - at);
    at = end;
    if (!is_tag(markup)) continue;
    if (!markup.starts_with("<VTKFile") || markup.size() > 4096) return out;
    const std::string closed = std::string(markup.substr(0, markup.size() - 1)) + "/>";
    if (!out.load_buffer(closed.data(), closed.size())) out.reset();
    return out;
  }
}

XmlFile::XmlFile(std::string_view content, const std::string& name) : content_(content), name_(name) {
  size_t appended;
  skeleton_ = skeleton_of(content, appended);
  const auto parsed =
      tree_.load_buffer_inplace(skeleton_.data(), skeleton_.size(), pugi::parse_default, pugi::encoding_utf8);
  if (!parsed || !root())
    refuse("{}: is cut off or no XML file of VTK's: {}", name,
           parsed ? "it has no VTKFile element" : parsed.description());
  if (appended != kNone) {
    const size_t end = std::min(markup_end(content, appended), content.size());
    pugi::xml_document tag;
    tag.load_string((std::string(content.substr(appended, end - appended)) + "</AppendedData>").c_str());
    appended_base64_ = std::string_view(tag.first_child().attribute("encoding").value()) == "base64";
    const size_t mark = content.find_first_not_of(" \t\r\n", end);
    if (mark != kNone && content[mark] == '_') appended_ = content.substr(mark + 1);
  }
  big_endian_ = std::string_view(root().attribute("byte_order").value()) == "BigEndian";
  header_bytes_ = std::string_view(root().attribute("header_type").value()) == "UInt64" ? 8 : 4;
  compressor_ = root().attribute("compressor").value();
}

std::string_view XmlFile::text(pugi::xml_node element) const {
  const std::string_view where = element.text().get();
  size_t begin = 0, size = 0;
  const auto first = std::from_chars(where.data(), where.data() + where.size(), begin);
  if (first.ptr == where.data() + where.size()) return {};
  std::from_chars(first.ptr + 1, where.data() + where.size(), size);
  return content_.substr(std::min(begin, content_.size()), size);
}

Array XmlFile::array(pugi::xml_node element, int64_t tuples) const {
  if (!element) refuse("{}: an array that its cells or points need is missing", name_);
  Array out;
  out.name = element.attribute("Name").value();
  const std::string what = fmt::format("{}: array {}", name_, out.name);
  if (!type_of(element.attribute("type").value(), out.type))
    refuse("{} is of type {}, not of numbers", what, element.attribute("type").value());
  out.components = std::clamp<size_t>(element.attribute("NumberOfComponents").as_uint(1), 1, 1 << 16);
  for (const auto key : element.children("InformationKey"))
    if (std::string_view(key.attribute("name").value()) == "UNITS_LABEL") out.unit = text(key);
  const std::string_view format = element.attribute("format").value();
  const size_t most = tuples < 0 ? ~size_t{0} : size_t(tuples) * out.components;
  const bool appended = format == "appended" || (format.empty() && element.attribute("offset"));
  if (appended || format == "binary") {
    std::string_view encoded = appended ? appended_ : text(element);
    const uint64_t offset = appended ? element.attribute("offset").as_ullong() : 0;
    if (offset > encoded.size()) refuse("{} begins at byte {} of {} appended ones", what, offset, encoded.size());
    encoded.remove_prefix(offset);
    const bool nothing = !appended && encoded.empty();  // some programs write arrays without values so
    if (!nothing) out = decode(std::move(out), encoded, !appended || appended_base64_, what);
  } else {
    TextScanner in(text(element));
    out.owned.reserve(std::min(most, text(element).size() / 2 + 1) * stored_bytes(out.type));
    parse_numbers(in, most, out);
    if (out.values < most && in.skip_space())
      refuse("{}: value {} is no number of type {}", what, out.values, name_of(out.type));
  }
  if (tuples >= 0 && out.values < most) refuse("{} has {} values, {} are needed", what, out.values, most);
  if (tuples >= 0) out.values = most;
  return out;
}

Array XmlFile::decode(Array out, std::string_view encoded, bool base64, const std::string& what) const {
  EncodedBytes in(encoded, base64);
  const auto packing = packing_of(compressor_);
  if (!packing) refuse("{}: is packed by {}, which is not known", name_, compressor_);
  auto bytes = *packing == Packing::kNone ? read_plain(in, header_bytes_, big_endian_, what)
                                          : unpack(in, *packing, header_bytes_, big_endian_, what);
  out.owned = std::move(bytes.owned);
  out.data = out.owned.empty() ? bytes.in_file.data() : out.owned.data();
  out.values = (out.owned.empty() ? bytes.in_file.size() : out.owned.size()) / stored_bytes(out.type);
  if (big_endian_) out.swap_bytes();
  return out;
}

}  // namespace telesplat::data::vtk
