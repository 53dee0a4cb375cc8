// The one place that decides what a data set is. The launcher asks here, too.
#pragma once

#include <memory>

#include "common/core/result.h"
#include "common/scene/kind.h"
#include "services/data/base/progress.h"
#include "services/data/data_options.h"

namespace telesplat::data {

class Served;

/// What data sets there are, for help texts: "mesh file (PLY, ...) or ..., volume (...), the word julia".
std::string scene_help();

/// What the options' scene is, by the options and by the file's content. Error, naming scene or flag: there is no such
/// file; it is a folder that holds nothing we know; an option is set that scenes of its kind do not have. Whether a
/// file is sound only opening it tells.
Result<scene::Kind> kind_of(const DataOptions& options);

/// Opens the scene, as what kind_of() says. Errors (exit code 2 for a user) name the file, or the parameter of a Julia
/// set.
Result<std::unique_ptr<Served>> open(const DataOptions& options, const Progress& progress);

}  // namespace telesplat::data
