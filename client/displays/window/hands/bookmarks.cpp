#include "client/displays/window/hands/bookmarks.h"

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

std::string now_text() { return fmt::format("{:%FT%TZ}", fmt::gmtime(std::time(nullptr))); }

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

void Bookmarks::put(std::function<void()> task) {
  {
    const std::lock_guard lock(mutex_);
    if (tasks_.size() < kMostTasks) tasks_.push_back(std::move(task));
  }
  wake_.notify_one();
}

// how: changes the book, and returns a line for the person.
void Bookmarks::change(const notes::Shelf& shelf, std::function<Result<std::string>(notes::Book&)> how) {
  put([this, shelf, how = std::move(how)] {
    std::string done, path;
    const Status changed = notes::change_book(
        shelf,
        [&](notes::Book& book) -> Status {
          auto said = how(book);
          if (!said) return said.error();
          done = *std::move(said);
          return ok_status();
        },
        &path);
    tell_(changed ? fmt::format("{} in {}", done, path) : changed.error().text);
    read(shelf);
  });
}

void Bookmarks::keep(const notes::Shelf& shelf, const geometry::Pose& pose, const std::string& name) {
  change(shelf, [pose, name](notes::Book& book) -> Result<std::string> {
    const std::string called = name.empty() ? free_name(book) : name;
    if (const Status s = book.keep({called, pose, now_text()}); !s) return s.error();
    return fmt::format("bookmark \"{}\"", called);
  });
}

void Bookmarks::remove(const notes::Shelf& shelf, const std::string& name) {
  change(shelf, [name](notes::Book& book) -> Result<std::string> {
    if (const Status s = book.remove_bookmark(name); !s) return s.error();
    return fmt::format("bookmark \"{}\" is no more", name);
  });
}

void Bookmarks::add(const notes::Shelf& shelf, const notes::Note& note) {
  change(shelf, [note](notes::Book& book) -> Result<std::string> {
    notes::Note dated = note;
    dated.made_at = now_text();
    const auto number = book.add(std::move(dated));
    if (!number) return number.error();
    return fmt::format("note {}", *number);
  });
}

void Bookmarks::remove_note(const notes::Shelf& shelf, uint64_t number) {
  change(shelf, [number](notes::Book& book) -> Result<std::string> {
    if (const Status s = book.remove_note(number); !s) return s.error();
    return fmt::format("note {} is no more", number);
  });
}

void Bookmarks::next(const notes::Shelf& shelf) { find(shelf, {}); }

void Bookmarks::find(const notes::Shelf& shelf, const std::string& name) {
  put([this, shelf, name] { find_now(shelf, name); });
}

void Bookmarks::look(const notes::Shelf& shelf) {
  put([this, shelf] { read(shelf); });
}

void Bookmarks::read(const notes::Shelf& shelf) {
  auto book = notes::read_book(shelf);
  const std::lock_guard lock(mutex_);
  book_ = book ? std::make_shared<const notes::Book>(*std::move(book)) : nullptr;
}

std::shared_ptr<const notes::Book> Bookmarks::book() const {
  const std::lock_guard lock(mutex_);
  return book_;
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
    const auto task = std::move(tasks_.front());
    tasks_.pop_front();
    lock.unlock();
    if (const Status s = guarded("bookmarks", task); !s) tell_("bookmarks: " + s.error().text);
    lock.lock();
  }
}

// name: empty: the bookmark after the last one.
void Bookmarks::find_now(const notes::Shelf& shelf, const std::string& name) {
  const auto book = notes::read_book(shelf);
  if (!book) return tell_(book.error().text);
  if (book->bookmarks.empty()) return tell_("there are no bookmarks; B keeps one");
  const notes::Bookmark* found = book->find(name);
  if (!found && !name.empty()) return tell_(fmt::format("there is no bookmark \"{}\"", name));
  if (!found) {
    const notes::Bookmark* last = book->find(last_);
    found = &book->bookmarks[last ? size_t(last - book->bookmarks.data() + 1) % book->bookmarks.size() : 0];
  }
  last_ = found->name;
  tell_(fmt::format("bookmark \"{}\"", last_));
  const std::lock_guard lock(mutex_);
  found_ = *found;
}

}  // namespace telesplat::viewer
