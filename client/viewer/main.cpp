// telesplat-viewer: shows a session's points from wherever the head is, and records what it showed.
#include "client/viewer/viewer_service.h"
#include "common/net/service_main.h"

int main(int argc, char** argv) {
  using namespace telesplat;
  viewer::ViewerOptions options;
  options.service.name = net::unique_name("viewer");
  return net::service_main(
      argc, argv,
      "telesplat-viewer: caches points, splats them at display rate, headless or in a window, records frames", options,
      viewer::table, viewer::run);
}
