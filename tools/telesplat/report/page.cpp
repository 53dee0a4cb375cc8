#include "tools/telesplat/report/page.h"

#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "common/core/check.h"
#include "common/core/utf8.h"

namespace telesplat::launcher {
namespace {

using namespace page_files;

std::string code() {
  std::string out;
  for (const auto part : {dygraph_js, base_js, tables_js, series_js, stages_js, shapes_js, sweep_js, walk_js, main_js})
    (out += "<script>\n") += std::string(part) + "\n</script>\n";
  return out;
}

}  // namespace

std::string html_escaped(std::string_view text) {
  constexpr std::string_view kSigns = "&<>\"'";
  constexpr const char* kNames[] = {"&amp;", "&lt;", "&gt;", "&quot;", "&#39;"};
  std::string out;
  for (const char c : to_utf8(text)) {
    const size_t sign = kSigns.find(c);
    out += sign == kSigns.npos ? std::string(1, c) : kNames[sign];
  }
  return out;
}

std::string script_json(const nlohmann::ordered_json& data) {
  const std::string text = data.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  std::string out;
  out.reserve(text.size());
  for (size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '<')
      out += "\\u003c";
    else if (c == '>')
      out += "\\u003e";
    else if (c == '&')
      out += "\\u0026";
    else if (const auto rest = std::string_view(text).substr(i, 3); rest == "\u2028" || rest == "\u2029") {
      out += rest == "\u2028" ? "\\u2028" : "\\u2029";
      i += 2;
    } else {
      out += c;
    }
  }
  return out;
}

std::string page_html(const std::string& title, const nlohmann::ordered_json& data) {
  // Each mark stands in the frame once; inserted text is not searched for marks.
  std::string out;
  std::string_view rest = frame_html;
  for (const auto& [mark, text] : std::vector<std::pair<std::string_view, std::string>>{
           {"{{TITLE}}", html_escaped(title)},
           {"{{STYLE}}", std::string(dygraph_css) + "\n" + std::string(style_css)},
           {"{{DATA}}", script_json(data)},
           {"{{CODE}}", code()}}) {
    const size_t at = rest.find(mark);
    CHECK(at != rest.npos);
    (out += rest.substr(0, at)) += text;
    rest.remove_prefix(at + mark.size());
  }
  return out += rest;
}

}  // namespace telesplat::launcher
