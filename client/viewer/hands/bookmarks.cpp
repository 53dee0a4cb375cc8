#include "client/viewer/hands/bookmarks.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <ctime>
#include <utility>

#include "common/core/guarded.h"

namespace telesplat::viewer {
namespace {

constexpr size_t kMostTasks = 16;

std::string free_name(const notes::Book& book) {
  for (size_t n = book.bookmarks.size() + 1;; ++n)
    if (std::string name = fmt::format("view {}", n); !book.find(name)) return name;
}

}  // namespace

Bookmarks::Bookmarks(std::function<void(const std::string&)> tell)
    : tell_(std::move(tell)), thread_([this] { run(); }) {}

Bookmarks::~Bookmarks() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void Bookmarks::keep(const notes::Shelf& shelf, const geometry::Pose& pose) { put({shelf, pose}); }

void Bookmarks::next(const notes::Shelf& shelf) { put({shelf, std::nullopt}); }

void Bookmarks::put(Task task) {
  {
    const std::lock_guard lock(mutex_);
    if (tasks_.size() < kMostTasks) tasks_.push_back(std::move(task));
  }
  wake_.notify_one();
}

std::optional<notes::Bookmark> Bookmarks::take_found() {
  const std::lock_guard lock(mutex_);
  return std::exchange(found_, std::nullopt);
}

void Bookmarks::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    wake_.wait(lock, [this] { return stop_ || !tasks_.empty(); });
    if (tasks_.empty()) return;
    const Task task = std::move(tasks_.front());
    tasks_.pop_front();
    lock.unlock();
    if (const Status s = guarded("bookmarks", [&] { task.pose ? keep_now(task) : find_now(task); }); !s)
      tell_("bookmarks: " + s.error().text);
    lock.lock();
  }
}

void Bookmarks::keep_now(const Task& task) {
  std::string name, path;
  const Status kept = notes::change_book(
      task.shelf,
      [&](notes::Book& book) {
        name = free_name(book);
        return book.keep({name, *task.pose, fmt::format("{:%FT%TZ}", fmt::gmtime(std::time(nullptr)))});
      },
      &path);
  tell_(kept ? fmt::format("bookmark \"{}\" in {}", name, path) : kept.error().text);
}

void Bookmarks::find_now(const Task& task) {
  const auto book = notes::read_book(task.shelf);
  if (!book) return tell_(book.error().text);
  if (book->bookmarks.empty()) return tell_("there are no bookmarks; B keeps one");
  const notes::Bookmark* last = book->find(last_);
  const size_t at = last ? size_t(last - book->bookmarks.data() + 1) % book->bookmarks.size() : 0;
  last_ = book->bookmarks[at].name;
  tell_(fmt::format("bookmark \"{}\"", last_));
  const std::lock_guard lock(mutex_);
  found_ = book->bookmarks[at];
}

}  // namespace telesplat::viewer
