// A window's bookmarks: kept beside the data set and read from there, by a thread of their own, because disks and locks
// take their time.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "common/notes/shelf.h"

namespace telesplat::viewer {

class Bookmarks {
 public:
  /// tell: lines for the person, from the thread.
  explicit Bookmarks(std::function<void(const std::string&)> tell);
  /// Finishes what was begun.
  ~Bookmarks();

  /// Keeps a view under a name that no other has: "view 3".
  void keep(const notes::Shelf& shelf, const geometry::Pose& pose);
  /// Looks for the bookmark after the one that was found last, round and round; take_found() has it when it is there.
  void next(const notes::Shelf& shelf);
  /// Once.
  std::optional<notes::Bookmark> take_found();

 private:
  struct Task {
    notes::Shelf shelf;
    std::optional<geometry::Pose> pose;  // nothing: the next one is looked for
  };
  void run();
  void keep_now(const Task& task);
  void find_now(const Task& task);
  void put(Task task);

  std::function<void(const std::string&)> tell_;
  std::string last_;  // the bookmark that was found last
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Task> tasks_;
  std::optional<notes::Bookmark> found_;
  bool stop_ = false;
  std::thread thread_;  // last: it uses the others
};

}  // namespace telesplat::viewer
