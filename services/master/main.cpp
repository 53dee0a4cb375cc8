// telesplat-master: session, discovery, view requests -> frames -> leases, metrics.
#include "common/net/service_main.h"
#include "services/master/master_service.h"

int main(int argc, char** argv) {
  using namespace telesplat;
  master::MasterServiceOptions options;
  options.service.name = "master";
  options.service.bind = "tcp://127.0.0.1:7700";
  return net::service_main(argc, argv,
                           "telesplat-master: leads a Telesplat session; every other process connects to it", options,
                           master::table, master::run);
}
