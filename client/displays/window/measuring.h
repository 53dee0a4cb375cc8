// What a person points at in a window, and the places that were measured: marks over the picture, and their file.
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

/// One thread. What it is made of must live longer.
class Measuring {
 public:
  using Tell = std::function<void(const std::string& line)>;
  Measuring(const Window& window, Interaction& interaction, HandOverlays& hands, Overlays& overlays, Tell tell)
      : window_(window), interaction_(interaction), hands_(hands), overlays_(overlays), tell_(std::move(tell)) {}

  Measurements& places() { return places_; }
  /// DisplaySurface::points_at() and on_pick(). terms: null: nothing is shown yet.
  std::optional<glm::dvec2> points_at();
  void on_pick(const std::optional<Pick>& pick, EpochId epoch, const SceneTerms* terms);
  /// Takes places away: another data set is shown.
  void clear();
  /// Marks of the places as this camera sees them. seen: they can be drawn.
  void show_marks(const geometry::Camera& camera, bool seen);
  void save(const std::string& folder) const;

 private:
  const Window& window_;
  Interaction& interaction_;
  HandOverlays& hands_;
  Overlays& overlays_;
  Tell tell_;
  Measurements places_;
  std::string marks_shown_;  // the state that the overlay of their marks shows; empty: no mark
  bool tells_pick_ = false;  // the person asked for it, not the cursor's overlay
  bool centres_ = false;     // a double click
  double pointed_s_ = -1e9;
};

}  // namespace telesplat::viewer
