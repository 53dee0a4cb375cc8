// Makes the legend of an epoch: of the array that colours a mesh, or of a volume's transfer function.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "common/image/legend.h"
#include "common/scene/colouring.h"
#include "common/volume/session.h"

namespace telesplat::scene {

image::Legend legend_of(const Colouring& colouring);
/// Colour over value, opacity as its height; over the range that the function and the data have in common.
image::Legend legend_of(const volume::Session& session);

/// From an epoch's facts and parameters, as a welcome or the record has them; nothing if they describe no legend, or
/// cannot be read.
std::optional<image::Legend> legend_of(const std::map<std::string, std::string>& facts,
                                       const std::map<std::string, double>& parameters);

}  // namespace telesplat::scene
