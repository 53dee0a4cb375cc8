#include "services/packer/packer_options.h"

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

}  // namespace telesplat::packer
