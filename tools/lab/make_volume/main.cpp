// make-volume: writes a made-up CT scan of a Christmas tree.
#include <fmt/format.h>

#include "common/core/version.h"
#include "common/options/complain.h"
#include "common/options/parser.h"
#include "tools/common/progress_line.h"
#include "tools/lab/make_volume/tree.h"

using namespace telesplat;

namespace {

constexpr const char* kAbout =
    "Writes a made-up CT scan of a potted Christmas tree with glass balls: a cube of 16-bit (or 8-bit) voxels.";

struct Options {
  int side = 512, bits = 16;
  uint64_t seed = 1;
  std::string output;
};

options::Table table(Options& o) {
  const auto eight_or_sixteen = [](const std::string& v) {
    return v == "8" || v == "16" ? std::string() : std::string("is neither 8 nor 16");
  };
  return {
      {.flag = "--size",
       .value = &o.side,
       .help = "voxels a side",
       .limits = options::Range{double(made_volume::kMinSide), double(made_volume::kMaxSide)}},
      {.flag = "--bits", .value = &o.bits, .help = "bits a voxel: 16 or 8", .limits = options::Check(eight_or_sixteen)},
      {.flag = "--seed", .value = &o.seed, .help = "which tree; the same seed makes the same one"},
      {.flag = "-o,--output", .value = &o.output, .help = "the file to write: .nrrd, .mha or .raw", .required = true}};
}

Status make(const Options& o) {
  tools::ProgressLine line(2);
  try {
    const auto scan = made_volume::make_tree(o.side, o.seed, [&](double f) { line.show("make-volume: making", f); });
    return made_volume::write_scan(scan, o.bits, o.output);
  } catch (const std::bad_alloc&) {
    return Error{fmt::format("{0} x {0} x {0} voxels do not fit into this machine's memory", o.side)};
  }
}

}  // namespace

int main(int argc, char** argv) {
  Options o;
  options::Parser parser(kAbout);
  parser.add(table(o));
  parser.version(version());
  parser.parse_or_exit("make-volume", {argv + 1, argv + argc});
  const Status made = make(o);
  return made.ok() ? 0 : complain(made.error(), 1, "make-volume");
}
