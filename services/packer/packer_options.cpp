#include "services/packer/packer_options.h"

#include <fmt/format.h>

#include <charconv>

namespace telesplat::packer {

options::Table table(PackerOptions& o) {
  using options::Range;
  const auto points = scene::Kinds::of(scene::Pipeline::kPoints);
  return options::joined(net::service_table(o.service, net::Ends::kBoth),
                         {{.flag = "--advertise-to-viewers",
                           .value = &o.advertise_to_viewers,
                           .help = "host that viewers are told to connect to, where it is another than samplers are "
                                   "told; default: as --advertise",
                           .limits = options::Check(net::complain_about_host),
                           .reach = options::Reach::kHere},
                          {.flag = "--threads",
                           .value = &o.threads,
                           .help = "threads for reference depth maps; 0: one a core",
                           .limits = Range{0, 1024},
                           .fits = points},
                          {.flag = "--record-depth",
                           .value = &o.record_depth,
                           .help = "folder to keep sampled depth images in",
                           .fits = points},
                          {.flag = "--log-limit-mb",
                           .value = &o.log_limit_mb,
                           .help = "memory for the events that late joiners get",
                           .limits = Range{1, 1e6},
                           .fits = points},
                          {.flag = "--answer-window-mb",
                           .value = &o.answer_window_mb,
                           .help = "of these events, under way to a viewer at most",
                           .limits = Range{0.1, 1024},
                           .fits = points}});
}

Result<std::string> bind_of(const std::string& bind, int n) {
  const size_t colon = bind.rfind(':');
  if (n == 0 || !bind.starts_with("tcp://") || colon == bind.npos) return bind;
  const char *begin = bind.data() + colon + 1, *end = bind.data() + bind.size();
  int port = 0;
  const auto read = std::from_chars(begin, end, port);
  if (read.ec != std::errc() || read.ptr != end || port == 0) return bind;  // a free port, or one that bind() refuses
  if (port + n > 65535) return Error{fmt::format("{}: its {} ports end at 65535", bind, n + 1)};
  return fmt::format("{}:{}", bind.substr(0, colon), port + n);
}

}  // namespace telesplat::packer
