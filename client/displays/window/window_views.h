// Cameras of a window: the first view of the scene, views along its axes, and the head's.
#pragma once

#include <array>

#include "client/displays/window/input/interaction.h"
#include "client/displays/window/legend.h"
#include "client/displays/window/window.h"
#include "client/viewer/display/display_surface.h"
#include "client/viewer/hands/meaning.h"
#include "client/viewer/viewer_options.h"
#include "common/scene/session.h"

namespace telesplat::viewer {

/// Returns a camera whose field of view `fov_deg` spans the longer side of the image: a window that is made narrow does
/// not become a tunnel.
geometry::Camera window_camera(const geometry::Pose& pose, double fov_deg, int width, int height, double near_m);

/// Used by one thread. The constructor's arguments must live longer.
class WindowViews {
 public:
  /// options: display may change; call refit() then.
  WindowViews(const ViewerOptions& options, const Window& window, const WindowLegend& legend, Interaction& interaction)
      : options_(options), window_(window), legend_(legend), interaction_(interaction) {}

  void on_scene(const ShownScene& scene) {
    scene_ = scene;
    refit();
  }
  /// True if another data set replaces the one before. It begins with its own first view; the camera's owner stays.
  bool on_session(const scene::SessionView& facts);
  /// Its box is empty until the scene is known.
  const ShownScene& scene() const { return scene_; }
  bool has_scene() const { return !scene_.box_room.empty(); }
  void refit() { fitted_ = {}; }
  /// Fits the first view to the window; the camera follows it until the person takes it.
  void fit();
  /// Looks along an axis of the data, from its positive or its negative end. terms: null: not known yet.
  void look_from(const Side& side, const SceneTerms* terms);
  /// A screen's picture has the window's pixels.
  geometry::Camera camera_of(const geometry::Pose& head) const;

 private:
  // Frustum of the window's free part; its middle lies at a tangent from the view's axis.
  struct FreePart {
    geometry::Camera frustum;
    double middle_x;
  };
  FreePart free_part() const;
  geometry::Camera whole(const geometry::Pose& pose) const;

  const ViewerOptions& options_;
  const Window& window_;
  const WindowLegend& legend_;
  Interaction& interaction_;
  ShownScene scene_;
  std::string scene_name_;          // with its file and place; empty: there was no scene
  std::array<double, 4> fitted_{};  // values for which the first view was made; zeros: none yet
};

}  // namespace telesplat::viewer
