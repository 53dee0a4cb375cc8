#include "client/displays/window/panel/gui/measurements_view.h"

#include <fmt/format.h>
#include <imgui.h>

#include "client/displays/window/panel/gui/widgets.h"

namespace telesplat::viewer {
namespace {

void wrapped(const std::string& line) {
  ImGui::PushTextWrapPos(0);
  text(line);
  ImGui::PopTextWrapPos();
}

// True: it is to be taken away.
bool show_place(const Measurements& measurements, const Measurements::Row& row, size_t index) {
  const Measurements::Place& place = row[index];
  const bool gone = small_button(fmt::format("remove {}", place.number).c_str());
  ImGui::SameLine();
  wrapped(scene::place_text(measurements.placement(), place.told.data));
  if (place.told.error)
    text(fmt::format("within {:.2g} {}", *place.told.error, measurements.placement().unit));
  else
    wrapped(place.asked.empty() ? "an estimate: " + place.told.estimate : "asking the data server");
  if (const std::string value = scene::value_text(place.told); !value.empty()) wrapped(value);
  if (const std::string between = measurements.between(row, index); !between.empty()) wrapped(between);
  return gone;
}

}  // namespace

void show_measurements(Measurements& measurements, const std::function<void()>& save) {
  if (!section("Measurements", false)) return;
  if (measurements.empty()) return text("key X measures the place under the cursor");
  uint64_t gone = 0;
  for (const auto& row : measurements.rows()) {
    for (size_t i = 0; i < row.size(); ++i)
      if (show_place(measurements, row, i)) gone = row[i].number;
    ImGui::Separator();
  }
  if (button("new row")) measurements.begin_row();
  hint("the next place is not joined to the last one");
  ImGui::SameLine();
  if (button("save as CSV")) save();
  ImGui::SameLine();
  if (button("remove all")) measurements.clear();
  if (gone > 0)
    if (const Status s = measurements.remove(gone); !s) return;
}

}  // namespace telesplat::viewer
