// The scene file that a tune leaves: the choice, and why, as comments.
#pragma once

#include <string>
#include <vector>

#include "tools/telesplat/tune/choice.h"
#include "tools/telesplat/tune/subject.h"

namespace telesplat::launcher {

/// A configuration that was checked by runs.
struct Checked {
  TuneSettings settings;
  Prediction predicted;
  Measured measured;
};

/// Terminal and file have the same: a row a configuration, predicted and measured.
std::string table_text(const std::vector<Checked>& all, const std::string& indent);

/// TOML that `telesplat run` takes. all[0]: the defaults. costs: as they were measured.
std::string scene_text(const TuneSubject& subject, const TuneCosts& costs, const std::vector<Checked>& all,
                       const Choice& choice);

}  // namespace telesplat::launcher
