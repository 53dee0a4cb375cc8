// make-terrain: writes a coloured, made-up caldera landscape as PLY.
#include <fmt/format.h>

#include <atomic>
#include <csignal>

#include "common/core/version.h"
#include "common/options/complain.h"
#include "common/options/parser.h"
#include "tools/common/progress_line.h"
#include "tools/make_terrain/terrain.h"

using namespace telesplat;

namespace {

constexpr const char* kAbout =
    "Writes a caldera landscape with a lake as a binary PLY file: metres, z up, coloured by height and slope.";

struct Options {
  uint64_t triangles = 2'000'000, seed = 1;
  std::string output;
};

options::Table table(Options& o) {
  return {{.flag = "--triangles",
           .value = &o.triangles,
           .help = "number of triangles",
           .limits = options::Range{double(terrain::kMinTriangles), double(terrain::kMaxTriangles)}},
          {.flag = "--seed", .value = &o.seed, .help = "which land; the same seed makes the same one"},
          {.flag = "-o,--output", .value = &o.output, .help = "the file to write", .required = true}};
}

std::atomic<bool> stopped = false;

Status make(const Options& o) {
  tools::ProgressLine line(2);
  const uint64_t bytes = terrain::ply_bytes(terrain::Grid(o.triangles));
  if (bytes > 1'000'000'000)
    line.line(fmt::format("make-terrain: {} will have {:.2f} GB", o.output, double(bytes) * 1e-9));
  if (const Status room = terrain::check_room(o.output, bytes); !room) return room;
  const auto progress = [&](const char* what) {
    return [&line, what](double f) { return line.show(what, f), !stopped; };
  };
  const terrain::Terrain land(o.triangles, o.seed, progress("make-terrain: making the relief"));
  return terrain::write_ply(land, o.output, progress("make-terrain: writing"));
}

}  // namespace

int main(int argc, char** argv) {
  Options o;
  options::Parser parser(kAbout);
  parser.add(table(o));
  parser.version(version());
  parser.parse_or_exit("make-terrain", {argv + 1, argv + argc});
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, [](int) { stopped = true; });
  const Status made = make(o);
  return made.ok() ? 0 : complain(made.error(), 1, "make-terrain");
}
