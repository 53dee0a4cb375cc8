// telesplat-master: session, discovery, view requests -> frames -> leases, metrics.
#include <CLI/CLI.hpp>

#include "services/master/master_service.h"

int main(int argc, char** argv) {
  using namespace telesplat;
  return net::guarded_main(
      [](int n, char** arguments) {
        CLI::App app{"telesplat-master: leads a Telesplat session; every other process connects to it"};
        master::MasterServiceOptions options;
        options.service.name = "master";
        options.service.bind = "tcp://127.0.0.1:7700";
        master::add_flags(app, options);
        net::parse_or_exit(app, n, arguments);
        return master::run(options);
      },
      argc, argv);
}
