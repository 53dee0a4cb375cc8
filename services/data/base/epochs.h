// Keeps the scenes of the last epochs: users point at what a viewer showed them a moment ago.
#pragma once

#include <algorithm>
#include <deque>
#include <map>
#include <optional>
#include <string>

#include "common/geometry/clip.h"
#include "common/scene/clip_order.h"
#include "common/scene/colouring.h"
#include "common/scene/session.h"
#include "common/wire/messages.h"

namespace telesplat::data {

class Epochs {
 public:
  struct Scene {
    EpochId epoch;
    geometry::Clip clip;
    std::string colouring;  ///< as the session's fact states it
    std::map<std::string, double> parameters;
  };

  void keep(const wire::Welcome& session) {
    const scene::SessionView view(session);
    if (session.master != master_) scenes_.clear();  // another master counts its own epochs
    master_ = session.master;
    auto clip = geometry::clip_from_text(view.fact(scene::kClipFact));
    if (!clip) return;
    std::erase_if(scenes_, [&](const Scene& s) { return s.epoch == session.epoch; });
    scenes_.push_back({session.epoch, *std::move(clip), view.fact(scene::kColouringFact), session.parameters});
    if (scenes_.size() > kMost) scenes_.pop_front();
  }
  /// Null: the epoch is not known, or is over for too long.
  const Scene* find(EpochId epoch) const {
    const auto found = std::find_if(scenes_.begin(), scenes_.end(), [&](const Scene& s) { return s.epoch == epoch; });
    return found == scenes_.end() ? nullptr : &*found;
  }

 private:
  static constexpr size_t kMost = 32;
  InstanceId master_;
  std::deque<Scene> scenes_;  // newest last
};

}  // namespace telesplat::data
