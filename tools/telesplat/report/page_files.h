// The files of page/, embedded when the program is built (cmake/embed.cmake).
#pragma once

#include <string_view>

namespace telesplat::launcher::page_files {

extern const std::string_view dygraph_js, dygraph_css;  ///< of Debian's libjs-dygraphs
extern const std::string_view frame_html;               ///< the page, with {{MARKS}}
extern const std::string_view style_css;
extern const std::string_view base_js, tables_js, series_js, stages_js, shapes_js, sweep_js, walk_js, main_js;

}  // namespace telesplat::launcher::page_files
