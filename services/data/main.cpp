// telesplat-data: owns a data set and serves its blocks to samplers.
#include <CLI/CLI.hpp>

#include "services/data/data_service.h"

int main(int argc, char** argv) {
  using namespace telesplat;
  return net::guarded_main(
      [](int n, char** arguments) {
        CLI::App app{"telesplat-data: reads a data set and serves its blocks to samplers"};
        data::DataServiceOptions options;
        options.service.name = "data";
        data::add_flags(app, options);
        net::parse_or_exit(app, n, arguments);
        return data::run(options);
      },
      argc, argv);
}
