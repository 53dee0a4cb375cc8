// The panel's list of measurements.
#pragma once

#include <functional>

#include "client/viewer/hands/measurements.h"

namespace telesplat::viewer {

/// Builds the section, between Dear ImGui's frames. save: writes the table to a file.
void show_measurements(Measurements& measurements, const std::function<void()>& save);

}  // namespace telesplat::viewer
