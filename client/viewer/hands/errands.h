// Carries out orders of people to a viewer: picks, reports the head's pose, moves it. One for a display, in its thread.
#pragma once

#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "client/viewer/hands/meaning.h"
#include "client/viewer/hands/measurements.h"
#include "common/wire/messages.h"

namespace telesplat::viewer {

// Orders of people to this viewer wait here between the worker and the display, and so do the answers.

/// Thread-safe.
class OrderDesk {
 public:
  static constexpr size_t kMost = 64;  ///< orders that wait; beyond it the oldest is dropped, without an answer

  struct Answer {
    uint64_t number = 0;
    bool ok = false;
    std::string text;
  };

  void put(const wire::Order& order) {
    const std::lock_guard lock(mutex_);
    orders_.push_back(order);
    if (orders_.size() > kMost) orders_.pop_front();
  }
  std::vector<wire::Order> take_orders() {
    const std::lock_guard lock(mutex_);
    std::vector<wire::Order> out(orders_.begin(), orders_.end());
    orders_.clear();
    return out;
  }
  void answer(Answer answer) {
    const std::lock_guard lock(mutex_);
    answers_.push_back(std::move(answer));
  }
  std::vector<Answer> take_answers() {
    const std::lock_guard lock(mutex_);
    return std::exchange(answers_, {});
  }

 private:
  std::mutex mutex_;
  std::deque<wire::Order> orders_;
  std::vector<Answer> answers_;
};

/// Things that the display lends for one frame.
struct FrameHands {
  geometry::Camera camera;  ///< the displayed frame's camera
  geometry::Pose head;      ///< the head that it was drawn for; a wall's screen looks elsewhere
  EpochId epoch;
  std::shared_ptr<const SceneTerms> terms;  ///< null: the session is not known yet
  /// Returns the content at a pixel. opacity: for volumes.
  std::function<std::optional<Pick>(double x_pix, double y_pix, double opacity)> pick;
  /// Puts the camera there. False: the head follows a trajectory.
  std::function<bool(const geometry::Pose&)> go;
  /// Changes a setting of this viewer (scene::settings()), or switches something over the picture ("axes", ...: on or
  /// off). Error: it cannot have this value, or no person sees this display.
  std::function<Status(const std::string& name, const std::string& value)> set;
  bool pictures = false;                 ///< servers drew the displayed pictures: they have no depth to pick from
  Measurements* measurements = nullptr;  ///< null: this display shows no measurements
};

/// Returns JSON. Error: what is wrong with the order, for the person.
///   pick   "at": "X,Y" or "X%,Y%", up to three separated by blanks, pixels of the display from its upper left corner;
///          "opacity" (0.25): for volumes. {"picks": [null or as to_json(ToldPlace), "colour", "depth_m", "spacing_m",
///          "pixel", "probe": arguments of the order that asks the data server], "epoch", "placement"}
///   where  {"position", "orientation" (w, x, y, z), "width", "height", "epoch"}
///   go     "pose": seven numbers, px,py,pz,qw,qx,qy,qz. {}
///   overlay  "name", "on": on or off. {}
///   an order of scene::settings() that a viewer keeps   "value". {}
///   measure  "do": "list", "add" ("at" and "opacity" as for pick: a row of places), "remove" ("number"), "clear",
///            "csv". Measurements::list(), or {"csv": Measurements::csv()}
Result<std::string> carry_out(const wire::Order& order, const FrameHands& hands);

inline constexpr double kPickOpacity = volume::kSolid;
inline constexpr size_t kMostPicks = 3;

}  // namespace telesplat::viewer
