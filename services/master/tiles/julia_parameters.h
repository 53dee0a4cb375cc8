// The parameters of a scene that travels as points, in the current epoch: checks and applies changes, and plays their
// animation (T7.3). Julia sets have parameters, meshes do not. No clocks: times come in.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "common/julia/parameters.h"
#include "common/julia/timeline.h"
#include "common/scene/kind.h"
#include "common/wire/messages.h"
#include "services/master/control.h"

namespace telesplat::master {

class JuliaParameters {
 public:
  /// timeline: animates the scene from its first view on; empty: the animation in the data server's fact "animate", if
  /// there is one.
  explicit JuliaParameters(julia::Timeline timeline = {}) : wished_(std::move(timeline)) {}

  /// A data server said hello. One that says the same as the one before (it was restarted) changes nothing: values set
  /// or animated since then stay. True: values() changed. problem: what is wrong with what it says; then nothing can be
  /// set.
  bool adopt(const wire::Hello& data, std::string& problem);

  const std::string& kind() const { return kind_; }
  /// True for a Julia set: only these have parameters, and their frames are leased by rows.
  bool is_julia() const { return scene::kind_named(kind_) == scene::Kind::kJulia; }
  const std::map<std::string, double>& values() const { return values_; }

  /// Sets parameters by name. Error: the scene lacks the parameter, it is fixed or animated, the value is not a number
  /// or not within limits; then nothing changed. Names parameter, value and limit.
  Status set(const std::map<std::string, std::string>& arguments);
  /// Begins the animation `text`, instead of the one that runs; "off" ends it, values stay as they are. Error: it
  /// cannot be read or does not fit the scene; then nothing changed.
  Status animate(const std::string& text);

  /// Pauses the animation, goes on with it, or pauses it some steps of kStep_s farther on or back. Error: nothing
  /// is animated. True: the values changed.
  Result<bool> play(const PlayOrder& order);
  static constexpr double kStep_s = 0.1;

  bool animated() const { return !timeline_.empty(); }
  /// True if the scene is animated and not paused.
  bool playing() const { return animated() && !paused_; }
  std::string animation() const {
    return !animated() ? "off" : paused_ ? timeline_.text() + " (paused)" : timeline_.text();
  }
  /// Takes the animation's values at now_s; its clock begins with the first call. True: they changed.
  bool step(double now_s);

 private:
  Status begin(julia::Timeline timeline);
  bool take(double elapsed_s);
  std::map<std::string, double> with(const julia::Parameters& parameters) const;

  julia::Timeline wished_;
  std::string kind_;
  std::string content_hash_;
  std::map<std::string, double> told_, values_;  // as the data server sent them; as they are now
  std::optional<julia::Parameters> julia_;       // values_ as parameters; nullopt: nothing can be set
  julia::Timeline timeline_;
  std::optional<double> begun_s_;      // begin of the clock; nullopt: the next step() begins it
  double from_s_ = 0, elapsed_s_ = 0;  // times on the timeline at begun_s_, and at the last step
  bool paused_ = false;
};

}  // namespace telesplat::master
