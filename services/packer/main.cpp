// telesplat-packer: gathers depth images, keeps the authoritative point model, publishes what viewers lack.
#include <CLI/CLI.hpp>

#include "services/packer/packer_service.h"

int main(int argc, char** argv) {
  using namespace telesplat;
  return net::guarded_main(
      [](int n, char** arguments) {
        CLI::App app{"telesplat-packer: eliminates redundant samples, keeps the point model, publishes patches"};
        packer::PackerServiceOptions options;
        options.service.name = "packer";
        packer::add_flags(app, options);
        net::parse_or_exit(app, n, arguments);
        return packer::run(options);
      },
      argc, argv);
}
