#include "common/scene/kind.h"

#include <algorithm>
#include <iterator>

namespace telesplat::scene {
namespace {

struct Row {
  Kind kind;
  std::string_view name, described;
  Pipeline pipeline;
  Policy policy;
};

// Fewer and larger clusters are chosen from sooner. A Julia set along a walk at 2560x1600 had 54 fps, 237 ms, 28.5 dB
// and 0.9 % holes with 5 levels, 44 fps, 284 ms, 28.2 dB and 0.3 % with 6. The isosurface of a bonsai after a minute's
// orbit (telesplat-lab cache) was chosen from in 1.7 ms with 5 levels, 5.2 ms with 6, and splatted in 10.6 instead of
// 13.4 ms.
constexpr int kDepth = 5;

// A frame of a Julia set is dear: it is sampled coarser while the head moves. Where everything was kept, its pictures
// had 28.9 dB and 1.8 % holes along a walk at 2560x1600; with elimination 29.5 dB and 0.08 %.
constexpr Row kRows[] = {
    {Kind::kMesh, "mesh", "a mesh", Pipeline::kPoints, {kDepth, false, false, 20e6, 0.5}},
    {Kind::kJulia, "julia", "a Julia set", Pipeline::kPoints, {kDepth, false, true, 20e6, 0.4}},
    {Kind::kVolume, "volume", "a volume", Pipeline::kSlices, {kDepth, false, false, 20e6, 0.5}},
};
static_assert(std::size(kRows) == std::size(kKinds), "a row a kind");

const Row& row_of(Kind kind) {
  return *std::find_if(std::begin(kRows), std::end(kRows), [&](const Row& r) { return r.kind == kind; });
}

}  // namespace

Kinds Kinds::of(Pipeline pipeline) {
  Kinds out{};
  for (const Row& r : kRows)
    if (r.pipeline == pipeline) out.bits_ |= bit(r.kind);
  return out;
}

std::string_view name_of(Kind kind) { return row_of(kind).name; }
std::string_view described(Kind kind) { return row_of(kind).described; }
Pipeline pipeline_of(Kind kind) { return row_of(kind).pipeline; }
const Policy& policy_of(Kind kind) { return row_of(kind).policy; }

std::optional<Kind> kind_named(std::string_view name) {
  for (const Row& r : kRows)
    if (r.name == name) return r.kind;
  return std::nullopt;
}

}  // namespace telesplat::scene
