// telesplat-packer: gathers depth images, keeps the authoritative point model, publishes what viewers lack.
#include "common/net/service_main.h"
#include "services/packer/packer_service.h"

int main(int argc, char** argv) {
  using namespace telesplat;
  packer::PackerServiceOptions options;
  options.service.name = "packer";
  return net::service_main(argc, argv,
                           "telesplat-packer: eliminates redundant samples, keeps the point model, publishes patches",
                           options, packer::add_flags, packer::run);
}
