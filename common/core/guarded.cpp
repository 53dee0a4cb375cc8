#include "common/core/guarded.h"

namespace telesplat {

std::string current_problem() noexcept {
  try {
    throw;
  } catch (const std::exception& e) {
    return e.what();
  } catch (...) {
    return "an unknown exception";
  }
}

}  // namespace telesplat
