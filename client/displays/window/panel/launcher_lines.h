// What the launcher says to the viewer that it started: lines on standard input.
#pragma once

#include <string>
#include <vector>

namespace telesplat::viewer {

/// Lines from a file descriptor, read without waiting. The launcher sends
///   progress TEXT   what goes on, for people: "reading a.ply 43 %, 12 s left"; without TEXT: nothing
///   problem TEXT    why a data set could not be opened
/// One thread.
class LauncherLines {
 public:
  static constexpr size_t kLongest = 4096;  ///< bytes of a line; what is longer is cut

  /// Reads from `fd`, which becomes non-blocking; negative: nobody says anything.
  explicit LauncherLines(int fd);
  /// Whole lines that came since the last call.
  std::vector<std::string> read();
  bool open() const { return fd_ >= 0; }

 private:
  int fd_;
  std::string part_;
};

}  // namespace telesplat::viewer
