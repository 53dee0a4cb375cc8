// telesplat-display: telesplat-viewer with windows and headsets.
#include <cstdio>
#include <string_view>

#include "client/displays/window/open_window.h"
#include "client/displays/xr/xr_surface.h"
#include "common/net/service_main.h"

namespace {

// `telesplat-display check`: tells the launcher if windows can be opened here; prints why not.
int check() {
  const auto can = telesplat::viewer::check_display();
  if (!can) std::printf("%s\n", can.error().text.c_str());
  return can ? 0 : 2;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace telesplat;
  if (argc == 2 && std::string_view(argv[1]) == "check") return net::guarded_main(check);
  return viewer::viewer_main(argc, argv, {.window = viewer::open_window, .headset = viewer::open_headset});
}
