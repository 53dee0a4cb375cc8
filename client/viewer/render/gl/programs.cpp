#include "client/viewer/render/gl/programs.h"

#include <epoxy/gl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "client/viewer/render/gl/shaders/common.h"
#include "client/viewer/render/gl/shaders/contour.h"
#include "client/viewer/render/gl/shaders/ellipse.h"
#include "client/viewer/render/gl/shaders/ewa.h"
#include "client/viewer/render/gl/shaders/finish.h"
#include "client/viewer/render/gl/shaders/flat.h"
#include "client/viewer/render/gl/shaders/resolve.h"
#include "client/viewer/render/gl/shaders/surfel.h"
#include "common/splat/finish.h"
#include "common/splat/surfel/splat.h"

namespace telesplat::viewer {
namespace {

using namespace shaders;

// Returns the constants that both renderers share, as macros.
std::string constants() {
  std::string out;
  const auto add = [&](std::string_view name, const std::string& value) {
    out += fmt::format("#define {} {}\n", name, value);
  };
  const auto add_uint = [&](std::string_view name, uint32_t value) { add(name, fmt::format("{}u", value)); };
  // Writes all digits, and always a decimal point: so the shader's constant has the same bits.
  const auto add_float = [&](std::string_view name, float value) { add(name, fmt::format("{:.9e}", value)); };
  add("DEPTH_SHIFT", std::to_string(splat::kDepthCodeShift));
  add_uint("FILL_SUPPORTS", splat::kFillSupports);
  add_uint("PIN_HOLE_SUPPORTS", splat::kPinHoleSupports);
  add_uint("BETWEEN_SUPPORTS", splat::kBetweenSupports);
  add_uint("FLAT_SUPPORTS", splat::kFlatSupports);
  add_uint("FLAT", splat::kFlat);
  add("COVERAGE_NEAR", fmt::format("{}u", fmt::join(splat::kCoverageWeights.near, "u, ")));
  add("COVERAGE_FAR", fmt::format("{}u", fmt::join(splat::kCoverageWeights.far, "u, ")));
  add_uint("EDGE", splat::kEdge);
  add("MAX_SPLAT_SIDE", std::to_string(splat::kMaxSplatSide));
  add_uint("MAX_CENTRE_CODE", splat::kMaxCentreCode);
  add_uint("MAX_DEPTH_CODE", splat::kMaxDepthCode);
  add_uint("MAX_BIAS", splat::kMaxBias);
  add_float("MIN_SAMPLED_COSINE", splat::kMinSampledCosine);
  add_float("STEEPEST", splat::kSteepest);
  add_float("MAX_RADIUS_OVER_DEPTH", splat::kMaxRadiusOverDepth);
  add_float("OPAQUE_VARIANCE", splat::kOpaqueVariance);
  add_float("BIAS_PER_RADIUS", splat::kBiasPerRadius);
  add_float("LEAST_BIAS", splat::kLeastBias);
  add_float("MOST_BIAS", splat::kMostBias);
  add_float("FILTER_VARIANCE", splat::kFilterVariance);
  add_float("SUPPORT_GROWTH", splat::kSupportGrowth);
  add_float("SUPPORT_DROP", splat::kSupportDrop);
  add_float("EPSILON_PER_RADIUS", splat::kEpsilonPerRadius);
  add_float("LEAST_EPSILON", splat::kLeastEpsilon);
  add_float("MOST_EPSILON", splat::kMostEpsilon);
  return out;
}

using Parts = std::vector<std::string_view>;

Parts joined(Parts parts, const Parts& more) {
  parts.insert(parts.end(), more.begin(), more.end());
  return parts;
}

// The shaders of one kernel, without the parts that all shaders share. A row of the table below.
struct KernelShaders {
  splat::Kernel kernel;
  Parts vertex, fragment;          // for KernelPrograms::splat
  Parts sum_vertex, sum_fragment;  // for KernelPrograms::sum
  Parts resolve;                   // for KernelPrograms::resolve
};

// distance2: the body of KernelTraits::flat_distance2 for an offset d.
KernelShaders flat(splat::Kernel kernel, std::string_view distance2) {
  return {kernel, {distance2, kFlatVertex}, {distance2, kFlatFragment}, {}, {}, {}};
}
Parts surfel_vertex(std::string_view main) { return {kContour, kSurfel, kConicOut, kConicVertex, main}; }
Parts surfel_fragment(std::string_view main) { return {kConicIn, kConicFragment, main}; }

std::vector<KernelShaders> kernel_shaders() {
  return {
      flat(splat::Kernel::kSquare, "#define DISTANCE2(d) max((d).x * (d).x, (d).y * (d).y)\n"),
      flat(splat::Kernel::kDisc, "#define DISTANCE2(d) dot(d, d)\n"),
      {splat::Kernel::kEllipse, surfel_vertex(kEllipseVertex), surfel_fragment(kEllipseFragment), {}, {}, {}},
      {splat::Kernel::kEwa,
       surfel_vertex(kEwaVisibilityVertex),
       surfel_fragment(kEwaVisibilityFragment),
       surfel_vertex(kEwaSumVertex),
       surfel_fragment(kEwaSumFragment),
       {kEwaResolve}},
  };
}

// Links programs. A failure leaves an empty program and its text; the first failure is reported.
class Linker {
 public:
  // Links a program of splats: points that cover squares of pixels.
  gl::Program splats(const std::string& name, const Parts& vertex, const Parts& fragment) {
    return link(name, joined({kVersion, shared_, kView, kKeys, kPoints}, vertex),
                joined({kVersion, shared_, kView, kKeys}, fragment));
  }
  FramePass pass(const std::string& name, const Parts& resolve) {
    return {ending(name, resolve, kToPairs), ending(name, resolve, kToOutput)};
  }
  KernelPrograms kernel(const KernelShaders& shaders) {
    const splat::KernelTraits& traits = splat::traits_of(shaders.kernel);
    const std::string name(traits.name), contour = contour_of(traits);
    if (traits.passes == splat::Passes::kKeys)
      return {splats(name, joined({contour}, shaders.vertex), joined({contour}, shaders.fragment)), {}, {}};
    return {splats(name + " visibility", shaders.vertex, shaders.fragment),
            splats(name + " sum", shaders.sum_vertex, shaders.sum_fragment), pass(name, shaders.resolve)};
  }
  const std::string& failed() const { return failed_; }

 private:
  static std::string contour_of(const splat::KernelTraits& traits) {
    return fmt::format("#define CONTOUR_R2(size) ({:.9e} * (size) * (size))\n", traits.flat_contour_r2);
  }
  gl::Program ending(const std::string& name, const Parts& resolve, std::string_view end) {
    return link(name, {kVersion, kWholeFrame}, joined(joined({kVersion, shared_, kView, kKeys}, resolve), {end}));
  }
  gl::Program link(const std::string& name, const Parts& vertex, const Parts& fragment) {
    auto made = gl::Program::link(name, {{GL_VERTEX_SHADER, vertex}, {GL_FRAGMENT_SHADER, fragment}});
    if (made) return std::move(*made);
    if (failed_.empty()) failed_ = made.error().text;
    return gl::Program();
  }

  const std::string shared_ = constants();
  std::string failed_;
};

}  // namespace

Result<Programs> Programs::make() {
  Linker linker;
  Programs p;
  for (const KernelShaders& shaders : kernel_shaders())
    p.kernels[static_cast<size_t>(shaders.kernel)] = linker.kernel(shaders);
  p.keys = linker.pass("keys", {kResolve});
  p.fill_pin_holes = linker.pass("fill", {kFinish, kPinHoles, kFill});
  p.fill_all = linker.pass("fill all", {kFinish, kAllGaps, kFill});
  p.smooth = linker.pass("smooth", {kFinish, kSmooth});
  p.antialias = linker.pass("antialias", {kFinish, kAntialias});
  if (!linker.failed().empty()) return Error{linker.failed()};
  return p;
}

}  // namespace telesplat::viewer
