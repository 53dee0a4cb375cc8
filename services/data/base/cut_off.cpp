#include "services/data/base/cut_off.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdint>
#include <cstring>

namespace telesplat::data {
namespace {

constexpr int kPlaces = 1024;
constexpr size_t kMostName = 240;  // bytes; of a longer name only its end is kept
constexpr char kEllipsis[] = "...";

// A mapping that the signal handler reads while other threads map and unmap: `here` is set only while it is complete.
struct Place {
  std::atomic<bool> taken{false}, here{false};
  std::atomic<uintptr_t> begin{0}, end{0};
  char name[kMostName + sizeof kEllipsis] = {};
};
Place places[kPlaces];
std::atomic<int> exit_code{1};
std::atomic<bool> told{false};
static_assert(std::atomic<uintptr_t>::is_always_lock_free && std::atomic<bool>::is_always_lock_free);

void say(const char* text) {
  for (size_t left = std::strlen(text); left > 0;) {
    const ssize_t n = write(STDERR_FILENO, text, left);
    if (n <= 0) return;
    text += n, left -= size_t(n);
  }
}

[[noreturn]] void end_saying(const char* text, const char* rest) {
  while (told.exchange(true)) pause();  // another thread ends the process already
  say("telesplat: ");
  say(text);
  say(rest);
  _exit(exit_code);
}

void on_bus_error(int, siginfo_t* info, void*) {
  const auto at = reinterpret_cast<uintptr_t>(info->si_addr);
  for (const Place& p : places)
    if (p.here && at >= p.begin && at < p.end) end_saying(p.name, ": was cut off while it was read\n");
  signal(SIGBUS, SIG_DFL);  // the access that failed fails again, with the default action
}

}  // namespace

void end_at_cut_off_files(int code) {
  exit_code = code;
  struct sigaction action {};
  action.sa_sigaction = on_bus_error;
  action.sa_flags = SA_SIGINFO;
  sigaction(SIGBUS, &action, nullptr);
}

void end_at_damaged_file(const std::string& text) { end_saying(text.c_str(), "\n"); }

NamedMapping::NamedMapping(const void* data, size_t bytes, std::string_view name) {
  for (int i = 0; i < kPlaces && place_ < 0; ++i)
    if (!places[i].taken.exchange(true)) place_ = i;
  if (place_ < 0) return;
  Place& p = places[place_];
  const bool whole = name.size() <= kMostName;
  char* to = whole ? p.name : std::copy_n(kEllipsis, sizeof kEllipsis - 1, p.name);
  *std::copy_n(name.end() - ptrdiff_t(std::min(name.size(), kMostName)), std::min(name.size(), kMostName), to) = '\0';
  p.begin = reinterpret_cast<uintptr_t>(data);
  p.end = p.begin + bytes;
  p.here = true;
}

NamedMapping::~NamedMapping() {
  if (place_ < 0) return;
  places[place_].here = false;
  places[place_].taken = false;
}

}  // namespace telesplat::data
