// The viewer's flags on a CLI11 command line.
#include <CLI/CLI.hpp>

#include "client/viewer/viewer_options.h"

namespace telesplat::viewer {

void add_view_flags(CLI::App& app, ViewerOptions& o) {
  for (const auto& row : view_table(o)) {
    const auto take = [row](const std::string& text) {
      if (const Status s = options::set(row, text); !s) throw CLI::ValidationError(s.error().text);
    };
    if (std::holds_alternative<bool*>(row.value) && !row.on_off) {
      app.add_flag_callback(
          row.flag, [take] { take("true"); }, row.help);
      continue;
    }
    auto* option = app.add_option_function<std::string>(row.flag, take, row.help);
    option->default_str(row.default_text.empty() ? options::text_of(row) : row.default_text);
  }
}

}  // namespace telesplat::viewer
