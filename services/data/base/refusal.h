// Readers give up in the midst of a file by throwing a Refusal; their public functions turn it into an Error.
#pragma once

#include <fmt/format.h>

#include <string>
#include <type_traits>
#include <utility>

#include "common/core/result.h"

namespace telesplat::data {

/// Reason why a file is not read. or_error() catches it within the library that throws it.
struct Refusal {
  std::string text;
};

template <class... Given>
[[noreturn]] void refuse(fmt::format_string<Given...> format, Given&&... given) {
  throw Refusal{fmt::format(format, std::forward<Given>(given)...)};
}

/// Returns a result's value. Throws its error as a Refusal.
template <class T>
T need(Result<T> result) {
  if (!result) throw Refusal{result.error().text};
  return *std::move(result);
}
inline void need(const Status& status) {
  if (!status) throw Refusal{status.error().text};
}

/// Returns the result of read() (a Status if it returns void), or the Error that it refuses with.
template <class Read>
auto or_error(Read&& read) {
  using Value = decltype(read());
  using Made =
      std::conditional_t<std::is_void_v<Value>, Status, Result<std::conditional_t<std::is_void_v<Value>, Unit, Value>>>;
  try {
    if constexpr (std::is_void_v<Value>) {
      read();
      return Made(Unit{});
    } else {
      return Made(read());
    }
  } catch (const Refusal& refusal) {
    return Made(Error{refusal.text});
  }
}

}  // namespace telesplat::data
