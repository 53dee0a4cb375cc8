// telesplat-data: owns a data set and serves its blocks to samplers.
#include "common/net/service_main.h"
#include "services/data/data_service.h"

int main(int argc, char** argv) {
  using namespace telesplat;
  data::DataServiceOptions options;
  options.service.name = net::unique_name("data");
  return net::service_main(argc, argv, "telesplat-data: reads a data set and serves its blocks to samplers", options,
                           data::table, data::run);
}
