// The colouring of a mesh in the current epoch: carries out orders to change it, and asks the data server for the
// arrays that they need. No clocks.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/scene/colouring.h"
#include "common/wire/messages.h"
#include "services/master/control.h"

namespace telesplat::master {

class MeshColours {
 public:
  /// A data server said hello. One that says the same as the one before (it was restarted) changes nothing: a colouring
  /// chosen since then stays. True: the mesh looks different. problem: what is wrong with what it says; then it is
  /// taken for a mesh without arrays, or an array that was asked for did not come.
  bool adopt(const wire::Hello& data, std::string& problem);
  /// Adds to a welcome the colouring, for everyone, and the order for the data server.
  void describe(wire::Welcome& welcome) const;
  /// The colouring as text, for the run's record; empty: the file's own colours.
  std::string text() const { return now_ ? scene::to_text(*now_) : std::string(); }

  /// The colouring that is shown; nullopt: the file's own colours.
  const std::optional<scene::Colouring>& now() const { return now_; }

  /// For people: the array that is being fetched, or why the last one did not come; empty: neither.
  std::string waits_for() const;

  /// "colour": arguments "array" (as scene::parse_colour_by() takes it) and "map" (as colour::from_text() takes it),
  /// one of them at least. Another map or range begins an epoch; another array is asked for first, and its epoch begins
  /// when the data server has it. Error: no such array, no range, nothing to colour; then nothing changed.
  Result<Obeyed> obey(const wire::Control& command);

 private:
  struct Order {
    uint64_t number = 0;
    std::optional<scene::Colouring> colouring;
  };
  bool hear_answer(const std::string& answer, std::string& problem);
  Result<std::optional<scene::Colouring>> wanted(const wire::Control& command) const;

  bool is_mesh_ = false;
  std::string content_hash_, told_;  // as the data server sent them
  std::vector<scene::ArrayInfo> arrays_;
  colour::ColourMap map_;  // map for an array, unless another one is chosen with it
  std::optional<scene::Colouring> now_;
  std::optional<Order> order_;  // order that waits for its answer
  uint64_t orders_ = 0;
  std::string failure_;  // why the last order failed
};

}  // namespace telesplat::master
