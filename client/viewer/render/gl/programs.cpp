#include "client/viewer/render/gl/programs.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

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

// The constants that both renderers share, as macros.
std::string constants() {
  std::string out;
  const auto add = [&](std::string_view name, const std::string& value) {
    out += fmt::format("#define {} {}\n", name, value);
  };
  const auto add_uint = [&](std::string_view name, uint32_t value) { add(name, fmt::format("{}u", value)); };
  // All digits, and a decimal point always: the shader's constant has the same bits.
  const auto add_float = [&](std::string_view name, float value) { add(name, fmt::format("{:.9e}", value)); };
  add("DEPTH_SHIFT", std::to_string(splat::kDepthCodeShift));
  add("FILL_SUPPORTS", std::to_string(splat::kFillSupports));
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

}  // namespace

Result<Programs> Programs::make() {
  const std::string shared = constants();
  std::string failed;
  // A failure leaves an empty program and its text; the first one is reported.
  const auto link = [&](const char* name, const std::vector<gl::ShaderSource>& stages) {
    auto made = gl::Program::link(name, stages);
    if (made) return std::move(*made);
    if (failed.empty()) failed = made.error().text;
    return gl::Program();
  };
  using Parts = std::vector<std::string_view>;
  const auto splats = [&](const char* name, const Parts& for_vertices, const Parts& for_fragments) {
    Parts vertex{kVersion, shared, kView, kKeys, kPoints}, fragment{kVersion, shared, kView, kKeys};
    vertex.insert(vertex.end(), for_vertices.begin(), for_vertices.end());
    fragment.insert(fragment.end(), for_fragments.begin(), for_fragments.end());
    return link(name, {{GL_VERTEX_SHADER, vertex}, {GL_FRAGMENT_SHADER, fragment}});
  };
  const auto flat = [&](const char* name, std::string_view metric) {
    return splats(name, {metric, kFlatVertex}, {metric, kFlatFragment});
  };
  const auto surfels = [&](const char* name, std::string_view vertex, std::string_view fragment) {
    return splats(name, {kContour, kSurfel, kConicOut, kConicVertex, vertex}, {kConicIn, kConicFragment, fragment});
  };
  const auto pass = [&](const char* name, const Parts& resolve) {
    const auto ending = [&](const Parts& end) {
      Parts parts{kVersion, shared, kView, kKeys};
      parts.insert(parts.end(), resolve.begin(), resolve.end());
      parts.insert(parts.end(), end.begin(), end.end());
      return link(name, {{GL_VERTEX_SHADER, {kVersion, kWholeFrame}}, {GL_FRAGMENT_SHADER, parts}});
    };
    return Programs::Pass{ending({kToPairs}), ending({kToOutput})};
  };

  Programs p;
  p.square = flat("square",
                  "#define DISTANCE2(d) max((d).x * (d).x, (d).y * (d).y)\n"
                  "#define CONTOUR_R2(size) (0.5 * (size) * (size))\n");
  p.disc = flat("disc",
                "#define DISTANCE2(d) dot(d, d)\n"
                "#define CONTOUR_R2(size) (0.25 * (size) * (size))\n");
  p.ellipse = surfels("ellipse", kEllipseVertex, kEllipseFragment);
  p.ewa_visibility = surfels("ewa visibility", kEwaVisibilityVertex, kEwaVisibilityFragment);
  p.ewa_sum = surfels("ewa sum", kEwaSumVertex, kEwaSumFragment);
  p.keys = pass("keys", {kResolve});
  p.ewa = pass("ewa", {kEwaResolve});
  p.fill = pass("fill", {kFinish, kFill});
  p.smooth = pass("smooth", {kFinish, kSmooth});
  p.antialias = pass("antialias", {kFinish, kAntialias});
  if (!failed.empty()) return Error{failed};
  return p;
}

}  // namespace telesplat::viewer
