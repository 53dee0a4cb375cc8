// make-terrain: writes a coloured, made-up caldera landscape as PLY.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>

#include "common/core/clock.h"
#include "tools/make_terrain/terrain.h"

using namespace telesplat;

namespace {

// One line on stderr once two seconds have passed, then at most ten a second; over itself on a terminal.
class ProgressLine {
 public:
  void operator()(const char* what, double fraction) {
    const double now = monotonic_s();
    if (now - start_s_ < 2.0 || now - last_s_ < (terminal_ ? 0.1 : 2.0)) return;
    last_s_ = now;
    fmt::print(stderr, "{}make-terrain: {} {:.0f} %{}", terminal_ ? "\r" : "", what, 100 * fraction,
               terminal_ ? "   " : "\n");
    shown_ = true;
  }
  ~ProgressLine() {
    if (shown_ && terminal_) fmt::print(stderr, "\n");
  }

 private:
  bool terminal_ = isatty(STDERR_FILENO), shown_ = false;
  double start_s_ = monotonic_s(), last_s_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Writes a caldera landscape with a lake as a binary PLY file: metres, z up, coloured by height and slope.",
      "make-terrain");
  uint64_t triangles = 2'000'000, seed = 1;
  std::string output;
  app.add_option("--triangles", triangles, "number of triangles")
      ->check(CLI::Range(terrain::kMinTriangles, terrain::kMaxTriangles))
      ->capture_default_str();
  app.add_option("--seed", seed, "which land; the same seed makes the same one")->capture_default_str();
  app.add_option("-o,--output", output, "the file to write")->required();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  ProgressLine line;
  Status written = ok_status();
  try {
    const auto land = terrain::make_terrain(triangles, seed, [&](double f) { line("making", f); });
    written = terrain::write_ply(land, output, [&](double f) { line("writing", f); });
  } catch (const std::bad_alloc&) {
    written = Error{fmt::format("{} triangles do not fit into this machine's memory", triangles)};
  }
  if (!written.ok()) {
    fmt::print(stderr, "make-terrain: {}\n", written.error().text);
    return 1;
  }
  return 0;
}
