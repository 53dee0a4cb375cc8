// Handles mapped files that change while this process uses them: one that another process cuts off, where reading the
// lost part raises SIGBUS, and one whose bytes turn out damaged. Both end this process.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace telesplat::data {

/// From now on SIGBUS in a mapped file ends this process with `exit_code`, after the line "telesplat: FILE: was cut off
/// while it was read" on standard error; other SIGBUS end it as before. May be called again, with another code.
void end_at_cut_off_files(int exit_code);

/// Ends this process with that exit code, 1 without it, after the line "telesplat: TEXT" on standard error. Any thread.
[[noreturn]] void end_at_damaged_file(const std::string& text);

/// Maps a memory range to its file's name as long as it lives. With more than 1024 mappings, further ones have no name.
/// Any thread.
class NamedMapping {
 public:
  NamedMapping(const void* data, size_t bytes, std::string_view name);
  ~NamedMapping();
  NamedMapping(const NamedMapping&) = delete;
  NamedMapping& operator=(const NamedMapping&) = delete;

 private:
  int place_ = -1;
};

}  // namespace telesplat::data
