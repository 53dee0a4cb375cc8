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

// A frame of a Julia set is expensive: it is sampled coarser while the head moves. With all samples kept, pictures had
// 28.9 dB and 1.8 % holes along a walk at 2560x1600; with elimination 29.5 dB and 0.08 %.
constexpr Row kRows[] = {
    {Kind::kMesh, "mesh", "a mesh", Pipeline::kPoints, {false, 0.5}},
    {Kind::kJulia, "julia", "a Julia set", Pipeline::kPoints, {true, 0.4}},
    {Kind::kVolume, "volume", "a volume", Pipeline::kSlices, {false, 0.5}},
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
