// Changes that a person made to the picture, so that they can be undone and redone.
#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <utility>

namespace telesplat::viewer {

/// A change that was made.
struct Deed {
  std::string what;  ///< for people: "first view"
  std::function<void()> undo, redo;
  /// A later deed of the same subject within kOne_s joins this one: a slider that is dragged. Empty: deeds do not join.
  std::string subject;
};

/// Deeds in their order, the newest kMost. Used by one thread.
class UndoStack {
 public:
  static constexpr size_t kMost = 200;
  static constexpr double kOne_s = 1;

  /// Adds a deed that was done already. Deeds that were undone before cannot be redone any more.
  void did(double now_s, Deed deed) {
    deeds_.resize(done_);
    const bool goes_on = !deeds_.empty() && !deed.subject.empty() && deeds_.back().subject == deed.subject &&
                         now_s - newest_s_ <= kOne_s;
    newest_s_ = now_s;
    if (goes_on) {
      deeds_.back().redo = std::move(deed.redo);
      return;
    }
    deeds_.push_back(std::move(deed));
    if (deeds_.size() > kMost) deeds_.pop_front();
    done_ = deeds_.size();
  }

  bool can_undo() const { return done_ > 0; }
  bool can_redo() const { return done_ < deeds_.size(); }
  /// Undoes the newest deed, or redoes the one that was undone last. Returns a line about it.
  std::string undo() {
    if (!can_undo()) return "there is nothing to undo";
    const Deed deed = deeds_[--done_];
    newest_s_ = -1e9;
    deed.undo();
    return "undone: " + deed.what;
  }
  std::string redo() {
    if (!can_redo()) return "there is nothing to do again";
    const Deed deed = deeds_[done_++];
    newest_s_ = -1e9;
    deed.redo();
    return "done again: " + deed.what;
  }

 private:
  std::deque<Deed> deeds_;
  size_t done_ = 0;  // number of deeds in force; those after them are undone
  double newest_s_ = -1e9;
};

}  // namespace telesplat::viewer
