#include "common/core/check.h"

#include <cstdio>
#include <cstdlib>

namespace telesplat {

void check_failed(const char* condition, const char* file, int line) {
  std::fprintf(stderr, "telesplat: internal error: CHECK(%s) failed at %s:%d\n", condition, file, line);
  std::abort();
}

}  // namespace telesplat
