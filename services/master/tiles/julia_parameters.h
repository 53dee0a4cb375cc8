// The parameters of a scene that travels as points in the current epoch, what may change them, and the animation that
// does (T7.3): what differs between meshes, which have none, and Julia sets. No clocks: times come in.
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
  /// `timeline`: what animates the scene from its first view on; empty: what the data server's fact "animate" says, if
  /// anything.
  explicit JuliaParameters(julia::Timeline timeline = {}) : wished_(std::move(timeline)) {}

  /// A data server said hello. One that says the same as the one before (it was restarted) changes nothing: values set
  /// or animated since then stay. True: values() are others than before. problem: what is wrong with what it says; then
  /// nothing can be set.
  bool adopt(const wire::Hello& data, std::string& problem);

  const std::string& kind() const { return kind_; }
  /// A Julia set: only these have parameters, and their frames are leased by rows.
  bool is_julia() const { return scene::kind_named(kind_) == scene::Kind::kJulia; }
  const std::map<std::string, double>& values() const { return values_; }

  /// Sets parameters by name. Error: the scene has none, no such parameter, one that is fixed or animated, no number,
  /// limits; then nothing changed. Names parameter, value and limit.
  Status set(const std::map<std::string, std::string>& arguments);
  /// Begins the animation `text`, instead of the one that runs; "off" ends it, values stay as they are. Error: cannot
  /// be read, does not fit the scene; then nothing changed.
  Status animate(const std::string& text);

  /// Pauses the animation, goes on with it, or pauses it some steps of kStep_s farther on or back. Error: there is
  /// none; then nothing changed. True: the values are others than before.
  Result<bool> play(const PlayOrder& order);
  static constexpr double kStep_s = 0.1;

  bool animated() const { return !timeline_.empty(); }
  /// It is animated and not paused.
  bool playing() const { return animated() && !paused_; }
  std::string animation() const {
    return !animated() ? "off" : paused_ ? timeline_.text() + " (paused)" : timeline_.text();
  }
  /// Takes the animation's values at now_s; its clock begins with the first call. True: they are others than before.
  bool step(double now_s);

 private:
  Status begin(julia::Timeline timeline);
  bool take(double elapsed_s);
  std::map<std::string, double> with(const julia::Parameters& parameters) const;

  julia::Timeline wished_;
  std::string kind_;
  std::string content_hash_;
  std::map<std::string, double> told_, values_;  // by the data server; now
  std::optional<julia::Parameters> julia_;       // of values_; none: nothing can be set
  julia::Timeline timeline_;
  std::optional<double> begun_s_;      // of the clock; none: it goes on with the next step()
  double from_s_ = 0, elapsed_s_ = 0;  // of the timeline: at begun_s_, and at the last step
  bool paused_ = false;
};

}  // namespace telesplat::master
