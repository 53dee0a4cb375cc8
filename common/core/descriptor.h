// File descriptors of this process: files and locks on them (flock), sockets. A lock ends with its descriptor, so with
// its process too.
#pragma once

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <chrono>
#include <string>
#include <utility>

namespace telesplat {

class Descriptor {
 public:
  explicit Descriptor(int value = -1) : value_(value) {}
  ~Descriptor() { close(); }
  Descriptor(Descriptor&& other) noexcept : value_(std::exchange(other.value_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(value_, other.value_);
    return *this;
  }
  /// With O_CREAT, refuses a path that is a symbolic link.
  static Descriptor open_file(const std::string& path, int flags) {
    const int no_links = flags & O_CREAT ? O_NOFOLLOW : 0;
    return Descriptor(::open(path.c_str(), flags | no_links | O_CLOEXEC, 0644));
  }

  /// False: data that was written may not have reached the file.
  bool close() {
    const int value = std::exchange(value_, -1);
    return value < 0 || ::close(value) == 0;
  }
  int get() const { return value_; }
  bool valid() const { return value_ >= 0; }
  /// how: LOCK_SH or LOCK_EX, and LOCK_NB. False: another process holds it, or it cannot be locked.
  bool lock(int how) const { return valid() && flock(value_, how) == 0; }
  /// Locks it for this process alone; waits up to `patience` while another holds it. False: the other still does. True
  /// also if the file system has no locks.
  bool lock_within(std::chrono::milliseconds patience) const;

 private:
  int value_;
};

}  // namespace telesplat
