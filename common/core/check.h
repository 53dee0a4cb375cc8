// CHECK: a programmer's mistake ends the process with a line that says where. Nothing from outside can reach one.
#pragma once

namespace telesplat {
[[noreturn]] void check_failed(const char* condition, const char* file, int line);
}  // namespace telesplat

#define CHECK(condition) \
  ((condition) ? static_cast<void>(0) : ::telesplat::check_failed(#condition, __FILE__, __LINE__))
