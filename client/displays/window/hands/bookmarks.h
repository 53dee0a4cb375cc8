// A window's bookmarks and notes: kept beside the data set and read from there, by a thread of their own, because disks
// and locks take time.
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
  /// tell: gets lines for the person, called from the thread.
  explicit Bookmarks(std::function<void(const std::string&)> tell);
  /// Finishes what was begun.
  ~Bookmarks();

  /// Keeps a view; without a name it gets a new one: "view 3".
  void keep(const notes::Shelf& shelf, const geometry::Pose& pose, const std::string& name = {});
  /// Looks for the bookmark after the one found last, in a circle; take_found() then returns it.
  void next(const notes::Shelf& shelf);
  /// Looks for the bookmark of this name.
  void find(const notes::Shelf& shelf, const std::string& name);
  void remove(const notes::Shelf& shelf, const std::string& name);
  /// Fills in the note's time.
  void add(const notes::Shelf& shelf, const notes::Note& note);
  void remove_note(const notes::Shelf& shelf, uint64_t number);
  /// Reads the book, for book().
  void look(const notes::Shelf& shelf);

  /// Returns the bookmark once.
  std::optional<notes::Bookmark> take_found();
  /// The book as read last; null: it was not read, or cannot be.
  std::shared_ptr<const notes::Book> book() const;

 private:
  void run();
  void find_now(const notes::Shelf& shelf, const std::string& name);
  void change(const notes::Shelf& shelf, std::function<Result<std::string>(notes::Book&)> how);
  void read(const notes::Shelf& shelf);
  void put(std::function<void()> task);

  std::function<void(const std::string&)> tell_;
  std::string last_;  // name of the bookmark found last
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::function<void()>> tasks_;
  std::optional<notes::Bookmark> found_;
  std::shared_ptr<const notes::Book> book_;
  bool stop_ = false;
  std::thread thread_;  // last: it uses the others
};

}  // namespace telesplat::viewer
