// telesplat-viewer: shows a session's points from wherever the head is, and records what it showed.
#include <CLI/CLI.hpp>

#include "client/viewer/viewer_service.h"

int main(int argc, char** argv) {
  using namespace telesplat;
  return net::guarded_main(
      [](int n, char** arguments) {
        CLI::App app{"telesplat-viewer: headless viewer; caches points, splats them at display rate, records frames"};
        viewer::ViewerOptions options;
        options.service.name = "viewer-" + std::to_string(getpid());
        viewer::add_flags(app, options);
        net::parse_or_exit(app, n, arguments);
        return viewer::run(options);
      },
      argc, argv);
}
