// telesplat-sampler: leases tiles, samples them from the data, pushes depth images to the packer. Scales as replicas.
#include "common/net/service_main.h"
#include "services/sampler/sampler_service.h"

int main(int argc, char** argv) {
  using namespace telesplat;
  return net::service_main(argc, argv,
                           "telesplat-sampler: samples tiles of requested views; run as many as there are machines",
                           sampler::SamplerOptions{}, sampler::table, sampler::run);
}
