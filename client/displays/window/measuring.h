// Picks in a window, and the measured places: marks over the picture, and their file.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "client/displays/window/hands/hand_overlays.h"
#include "client/displays/window/overlay.h"
#include "client/displays/window/window.h"
#include "client/viewer/hands/measurements.h"

namespace telesplat::viewer {

/// Used by one thread. The constructor's arguments must live longer.
class Measuring {
 public:
  using Tell = std::function<void(const std::string& line)>;
  Measuring(const Window& window, Interaction& interaction, HandOverlays& hands, Overlays& overlays, Tell tell)
      : window_(window), interaction_(interaction), hands_(hands), overlays_(overlays), tell_(std::move(tell)) {}

  Measurements& places() { return places_; }
  /// DisplaySurface::points_at() and on_pick(). terms: null: the session is not known yet.
  std::optional<glm::dvec2> points_at();
  void on_pick(const std::optional<Pick>& pick, EpochId epoch, const SceneTerms* terms);
  /// Removes all places: another data set is shown.
  void clear();
  /// Shows marks of the places for this camera. seen: marks can be drawn.
  void show_marks(const geometry::Camera& camera, bool seen);
  void save(const std::string& folder) const;

 private:
  const Window& window_;
  Interaction& interaction_;
  HandOverlays& hands_;
  Overlays& overlays_;
  Tell tell_;
  Measurements places_;
  std::string marks_shown_;  // state of the marks in their overlay; empty: no mark
  bool tells_pick_ = false;  // the person wants the pick, not the cursor's overlay
  bool centres_ = false;     // after a double click
  double pointed_s_ = -1e9;
};

}  // namespace telesplat::viewer
