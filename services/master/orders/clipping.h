// What is cut away of the session's scene: what people ordered, and the planes in the room that this comes to. No
// clocks.
#pragma once

#include <string>

#include "common/scene/clip_order.h"
#include "common/wire/messages.h"
#include "services/master/control.h"

namespace telesplat::master {

class Clipping {
 public:
  /// order: from the beginning, as scene::parse_clip() takes it; empty: nothing is cut away.
  explicit Clipping(std::string order) : order_(std::move(order)) {}

  /// A data server said hello. An order that was given for another data set is dropped. True: something else is cut
  /// away than before. problem: why the order cannot be followed; then nothing is cut away.
  bool adopt(const wire::Hello& data, std::string& problem);
  /// "clip", argument "clip". Begins an epoch. Error: what is wrong with it; then nothing changed.
  Result<Obeyed> obey(const wire::Control& command);
  /// Fills in what everyone is told: the planes, and for people the order.
  void describe(wire::Welcome& welcome) const;
  /// The planes, for the run's record; empty: nothing is cut away.
  std::string text() const { return geometry::to_text(clip_); }
  const std::string& order() const { return order_; }

 private:
  std::string order_;
  bool known_ = false;          // a data server was here
  std::string placement_text_;  // that it told
  scene::Placement placement_;
  geometry::Clip clip_;
};

}  // namespace telesplat::master
