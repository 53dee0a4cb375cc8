// make-terrain: writes a coloured, made-up caldera landscape as PLY.
#include <fmt/format.h>

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

Status make(const Options& o) {
  tools::ProgressLine line(2);
  try {
    const auto land =
        terrain::make_terrain(o.triangles, o.seed, [&](double f) { line.show("make-terrain: making", f); });
    return terrain::write_ply(land, o.output, [&](double f) { line.show("make-terrain: writing", f); });
  } catch (const std::bad_alloc&) {
    return Error{fmt::format("{} triangles do not fit into this machine's memory", o.triangles)};
  }
}

}  // namespace

int main(int argc, char** argv) {
  Options o;
  options::Parser parser(kAbout);
  parser.add(table(o));
  parser.version(version());
  parser.parse_or_exit("make-terrain", {argv + 1, argv + argc});
  const Status made = make(o);
  return made.ok() ? 0 : complain(made.error(), 1, "make-terrain");
}
