// telesplat-sampler: leases tiles, samples them from the data, pushes depth images to the packer. Scales as replicas.
#include <CLI/CLI.hpp>

#include "services/sampler/sampler_service.h"

int main(int argc, char** argv) {
  using namespace telesplat;
  return net::guarded_main(
      [](int n, char** arguments) {
        CLI::App app{"telesplat-sampler: samples tiles of requested views; run as many as there are machines"};
        sampler::SamplerServiceOptions options;
        options.service.name = "sampler-" + std::to_string(getpid());
        sampler::add_flags(app, options);
        net::parse_or_exit(app, n, arguments);
        return sampler::run(options);
      },
      argc, argv);
}
