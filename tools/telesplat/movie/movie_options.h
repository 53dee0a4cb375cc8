// What is asked of a movie: flags of `telesplat run` and `view`, and of `telesplat movie`.
#pragma once

#include <string>
#include <utility>

#include "common/core/result.h"
#include "common/options/table.h"

namespace telesplat::launcher {

struct MovieOptions {
  std::string file;   ///< what to make (movie_target.h); empty: nothing
  double fps = 30;    ///< frames a second of the movie
  std::string size;   ///< "WxH"; empty: the display's
  int pictures = 12;  ///< of a contact sheet
  int threads = 0;    ///< to draw with; 0: one a core
};

/// --movie and what begins with it: of a command that runs something.
options::Table movie_rows(MovieOptions& options);
/// The flags of `telesplat movie` beside the run and the file.
options::Table movie_table(MovieOptions& options);

/// The size asked for; {0, 0}: the display's. Error: names the flag. flag: "--size".
Result<std::pair<int, int>> movie_size(const MovieOptions& options, const char* flag);

}  // namespace telesplat::launcher
