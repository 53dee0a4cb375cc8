// telesplat-packer: gathers depth images, keeps the authoritative point model, publishes what viewers lack.
#include "common/net/service_main.h"
#include "services/packer/packer_service.h"

int main(int argc, char** argv) {
  using namespace telesplat;
  return net::service_main(argc, argv,
                           "telesplat-packer: eliminates redundant samples, keeps the point model, publishes patches",
                           packer::PackerOptions{}, packer::table, packer::run);
}
