// A window's bookmarks and notes: kept beside the data set and read from there, by a thread of their own, because disks
// and locks take their time.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "client/notes/shelf.h"

namespace telesplat::viewer {

class Bookmarks {
 public:
  /// tell: lines for the person, from the thread.
  explicit Bookmarks(std::function<void(const std::string&)> tell);
  /// Finishes what was begun.
  ~Bookmarks();

  /// Keeps a view; without a name under one that no other has: "view 3".
  void keep(const notes::Shelf& shelf, const geometry::Pose& pose, const std::string& name = {});
  /// Looks for the bookmark after the one that was found last, round and round; take_found() has it when it is there.
  void next(const notes::Shelf& shelf);
  /// The same with the one of this name.
  void find(const notes::Shelf& shelf, const std::string& name);
  void remove(const notes::Shelf& shelf, const std::string& name);
  /// Its time is filled in.
  void add(const notes::Shelf& shelf, const notes::Note& note);
  void remove_note(const notes::Shelf& shelf, uint64_t number);
  /// Reads what is there, for book().
  void look(const notes::Shelf& shelf);

  /// Once.
  std::optional<notes::Bookmark> take_found();
  /// As it was read last; null: it was not, or cannot be.
  std::shared_ptr<const notes::Book> book() const;

 private:
  void run();
  void find_now(const notes::Shelf& shelf, const std::string& name);
  void change(const notes::Shelf& shelf, std::function<Result<std::string>(notes::Book&)> how);
  void read(const notes::Shelf& shelf);
  void put(std::function<void()> task);

  std::function<void(const std::string&)> tell_;
  std::string last_;  // the bookmark that was found last
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::function<void()>> tasks_;
  std::optional<notes::Bookmark> found_;
  std::shared_ptr<const notes::Book> book_;
  bool stop_ = false;
  std::thread thread_;  // last: it uses the others
};

}  // namespace telesplat::viewer
