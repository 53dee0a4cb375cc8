#include "services/packer/ports.h"

#include <fmt/format.h>

#include <charconv>

namespace telesplat::packer {

Result<std::string> bind_of(const std::string& bind, int n) {
  const size_t colon = bind.rfind(':');
  if (n == 0 || !bind.starts_with("tcp://") || colon == bind.npos) return bind;
  const char *begin = bind.data() + colon + 1, *end = bind.data() + bind.size();
  int port = 0;
  const auto read = std::from_chars(begin, end, port);
  if (read.ec != std::errc() || read.ptr != end || port == 0) return bind;  // a free one, or for bind() to refuse
  if (port + n > 65535) return Error{fmt::format("{}: its {} ports end at 65535", bind, n + 1)};
  return fmt::format("{}:{}", bind.substr(0, colon), port + n);
}

}  // namespace telesplat::packer
