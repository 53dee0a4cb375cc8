// One HTML page that contains its data, its style and its code.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace telesplat::launcher {

/// The files of page/, embedded when the program is built (cmake/embed.cmake).
namespace page_files {
extern const std::string_view dygraph_js, dygraph_css;  ///< from Debian's libjs-dygraphs
extern const std::string_view frame_html;               ///< the page, with {{MARKS}}
extern const std::string_view style_css;
extern const std::string_view base_js, tables_js, series_js, stages_js, shapes_js, sweep_js, walk_js, main_js;
}  // namespace page_files

/// Escapes `text` for HTML text, or an attribute in quotes. Invalid UTF-8 becomes U+FFFD.
std::string html_escaped(std::string_view text);

/// Writes JSON for a <script>: without '<', '>', '&' and the line ends that only JavaScript knows.
std::string script_json(const nlohmann::ordered_json& data);

/// Returns the page. title: the window's.
std::string page_html(const std::string& title, const nlohmann::ordered_json& data);

}  // namespace telesplat::launcher
