// Settings of a display that a person can change while it shows: scene::settings() that a viewer keeps, as texts.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>

#include "client/viewer/coupling/request_options.h"
#include "client/viewer/display/eyes/stereo_options.h"
#include "client/viewer/input/look.h"
#include "client/viewer/viewer_options.h"
#include "common/core/result.h"

namespace telesplat::viewer {

struct ViewSettings {
  Look look;
  bool transparent = false;  ///< the background cannot be chosen
  SamplingWish sampling;
  StereoOptions stereo;
  bool quad_buffers = false;  ///< the window has a buffer for each eye
  bool legend = true;
  bool pictures = false;  ///< views come as pictures: settings that cannot change these are refused
};

/// Sets the setting of this order to a value, written as for its flag. Error: what is wrong, or that no setting has
/// this order; then nothing changes.
Status change(ViewSettings& settings, const std::string& order, const std::string& value);
/// Returns the values of all settings, by their orders.
std::map<std::string, std::string> values_of(const ViewSettings& settings);

/// The settings that the person at a window chose. Used by one thread.
class ChosenSettings {
 public:
  /// display: follows the choices, and must live longer.
  ChosenSettings(const ViewerOptions& options, DisplayOptions& display);

  /// look: the person's look. pictures: views come as pictures.
  ViewSettings get(const Look& look, bool pictures) const;
  /// True if these are other eyes' pictures than the present ones.
  bool changes_eyes(const ViewSettings& settings) const;
  /// Takes over all but the look.
  void set(const ViewSettings& settings);
  /// Takes over the session's least sampling, unless the person chose one.
  void follow(const wire::SessionSettings& session);
  /// DisplaySurface::take_sampling() and take_stereo().
  std::optional<SamplingWish> take_sampling() { return std::exchange(sampling_wish_, std::nullopt); }
  std::optional<StereoOptions> take_stereo() { return std::exchange(stereo_wish_, std::nullopt); }

 private:
  DisplayOptions& display_;
  SamplingWish sampling_;
  bool sampling_chosen_;  // the person chose its least sampling
  bool quad_buffers_;     // the window has quad buffers
  std::optional<SamplingWish> sampling_wish_;
  std::optional<StereoOptions> stereo_wish_;
};

/// Reads "on" or "off".
Result<bool> read_switch(const std::string& value);

}  // namespace telesplat::viewer
