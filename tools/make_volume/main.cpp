// make-volume: writes a made-up CT scan of a Christmas tree.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <mutex>

#include "common/core/clock.h"
#include "tools/make_volume/tree.h"

using namespace telesplat;

namespace {

// One line on stderr once two seconds have passed, then at most ten a second; over itself on a terminal.
class ProgressLine {
 public:
  void operator()(const char* what, double fraction) {
    const std::lock_guard lock(mutex_);
    const double now = monotonic_s();
    if (now - start_s_ < 2.0 || now - last_s_ < (terminal_ ? 0.1 : 2.0)) return;
    last_s_ = now;
    fmt::print(stderr, "{}make-volume: {} {:.0f} %{}", terminal_ ? "\r" : "", what, 100 * fraction,
               terminal_ ? "   " : "\n");
    shown_ = true;
  }
  ~ProgressLine() {
    if (shown_ && terminal_) fmt::print(stderr, "\n");
  }

 private:
  std::mutex mutex_;  // of threads that make
  bool terminal_ = isatty(STDERR_FILENO), shown_ = false;
  double start_s_ = monotonic_s(), last_s_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Writes a made-up CT scan of a potted Christmas tree with glass balls: a cube of 16-bit (or 8-bit) voxels.",
      "make-volume");
  int side = 512, bits = 16;
  uint64_t seed = 1;
  std::string output;
  app.add_option("--size", side, "voxels a side")
      ->check(CLI::Range(made_volume::kMinSide, made_volume::kMaxSide))
      ->capture_default_str();
  app.add_option("--bits", bits, "bits a voxel: 16 or 8")->check(CLI::IsMember({8, 16}))->capture_default_str();
  app.add_option("--seed", seed, "which tree; the same seed makes the same one")->capture_default_str();
  app.add_option("-o,--output", output, "the file to write: .nrrd, .mha or .raw")->required();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  ProgressLine line;
  Status written = ok_status();
  try {
    const auto scan = made_volume::make_tree(side, seed, [&](double f) { line("making", f); });
    written = made_volume::write_scan(scan, bits, output);
  } catch (const std::bad_alloc&) {
    written = Error{fmt::format("{0} x {0} x {0} voxels do not fit into this machine's memory", side)};
  }
  if (!written.ok()) {
    fmt::print(stderr, "make-volume: {}\n", written.error().text);
    return 1;
  }
  return 0;
}
