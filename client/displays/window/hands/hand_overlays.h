// Axes, scale bar, cursor and frame rate over the window, on request, stacked in its lower left corner.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "client/displays/window/hands/marks.h"

namespace telesplat::viewer {

class HandOverlays {
 public:
  /// Lines of text as a picture; scale: pixels a side of a letter's dot.
  using TextPanel = std::function<image::View(const std::vector<std::string>& lines, int scale)>;
  explicit HandOverlays(TextPanel panel) : panel_(std::move(panel)) {}

  /// "axes", "scale", "cursor", "fps", or "all" of them. Error: there is no such overlay.
  Status show(const std::string& name, bool on);
  void toggle_all();
  bool shows(const std::string& name) const { return shown_.contains(name); }
  /// "on" or "off" of each, by its name.
  std::map<std::string, std::string> values() const;
  bool any() const { return !shown_.empty(); }

  void on_terms(std::shared_ptr<const SceneTerms> terms) { terms_ = std::move(terms); }
  void on_pick(const std::optional<Pick>& pick);
  /// Frames that were displayed so far.
  void on_frame(double now_s, uint64_t frames);
  /// What lies over the picture from now on: nothing where nothing is shown. To be asked every frame; nullopt: as
  /// before. It is drawn at most 20 times a second.
  std::optional<image::View> update(double now_s, const geometry::Camera& camera, const geometry::Box& box_room);

 private:
  std::string state(const geometry::Camera& camera) const;
  image::View picture(const geometry::Camera& camera, const geometry::Box& box_room) const;

  TextPanel panel_;
  std::set<std::string> shown_;
  std::shared_ptr<const SceneTerms> terms_;
  std::optional<scene::ToldPlace> place_;
  double fps_ = 0, counted_s_ = 0, drawn_s_ = -1e9;
  uint64_t counted_ = 0;
  std::string drawn_;  // what the overlay on display shows; empty: there is none
};

}  // namespace telesplat::viewer
