// Overlays that the person switches on: axes, scale bar, cursor and frame rate, stacked in the window's lower left
// corner; and small pictures that mark places.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "client/viewer/hands/measurements.h"
#include "common/geometry/camera.h"
#include "common/image/file.h"

namespace telesplat::viewer {

/// Draws the data's axes x, y and z as the camera sees them, red, green and blue (with letters, for people who cannot
/// tell these apart); axes that point to the eye are drawn last. 0xAARRGGBB, `side` pixels.
image::View axes_picture(const geometry::Camera& camera, const SceneTerms& terms, int side);

/// A bar of a round length in the data's units, with its length on the screen at `depth_m`: at most `width` pixels.
/// Nothing: the depth is not valid.
struct ScaleBar {
  double length = 0;  ///< in units of the data: 1, 2 or 5 times a power of ten
  double pixels = 0;
  std::string text;  ///< "20 mm"
};
std::optional<ScaleBar> scale_bar(const geometry::Camera& camera, const SceneTerms& terms, double depth_m, int width);
/// Draws the bar with its text. scale: a dot of a letter has scale x scale pixels.
image::View scale_picture(const ScaleBar& bar, int scale);

/// A line of `thickness` pixels: those whose centres lie within half of it get the colour.
void draw_line(image::View& view, glm::dvec2 a, glm::dvec2 b, double thickness, uint32_t colour);

/// Describes the content under the cursor, several lines; without a pick, one line that says so.
std::vector<std::string> cursor_lines(const std::optional<scene::ToldPlace>& place, const SceneTerms& terms);

/// Depth of the middle of a box along the camera's axis, metres.
double middle_depth_m(const geometry::Camera& camera, const geometry::Box& box_room);

/// Draws marks of the places: the part of the camera's picture that they cover, on a transparent ground (0xAARRGGBB);
/// x, y: place of its upper left pixel. Empty: no mark is seen. scale: a dot of a letter has scale x scale pixels.
struct MarksPicture {
  image::View view;
  int x = 0, y = 0;
};
MarksPicture draw_marks(const Measurements& measurements, const geometry::Camera& camera, int scale);

class HandOverlays {
 public:
  /// Draws lines of text; a dot of a letter has scale x scale pixels.
  using TextPanel = std::function<image::View(const std::vector<std::string>& lines, int scale)>;
  explicit HandOverlays(TextPanel panel) : panel_(std::move(panel)) {}

  /// name: "axes", "scale", "cursor", "fps", or "all". Error: there is no such overlay.
  Status show(const std::string& name, bool on);
  void toggle_all();
  bool shows(const std::string& name) const { return shown_.contains(name); }
  /// "on" or "off" for each overlay, by its name.
  std::map<std::string, std::string> values() const;
  bool any() const { return !shown_.empty(); }

  void on_terms(std::shared_ptr<const SceneTerms> terms) { terms_ = std::move(terms); }
  /// Null: not known yet.
  const SceneTerms* terms() const { return terms_.get(); }
  void on_pick(const std::optional<Pick>& pick);
  /// frames: number of displayed frames so far.
  void on_frame(double now_s, uint64_t frames);
  /// Returns the new picture of all shown overlays, empty if no overlay is shown. Call it for every frame; nullopt: the
  /// picture stays. It is drawn at most 20 times a second.
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
  std::string drawn_;  // state() of the overlay on display; empty: there is no overlay
};

}  // namespace telesplat::viewer
