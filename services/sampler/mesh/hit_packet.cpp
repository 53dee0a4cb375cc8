#include "services/sampler/mesh/hit_packet.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "services/sampler/mesh/hit_packet.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

#include <bit>
#include <cmath>
#include <glm/geometric.hpp>

#include "common/image/normal.h"

HWY_BEFORE_NAMESPACE();
namespace telesplat::sampler {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using F = hn::CappedTag<float, kPacket>;
using I = hn::RebindToSigned<F>;
using U = hn::RebindToUnsigned<F>;
using VF = hn::Vec<F>;
using VU = hn::Vec<U>;
constexpr F f;
constexpr I si;
constexpr U un;

struct V3 {
  VF x, y, z;
};
HWY_INLINE VF dot(const V3& a, const V3& b) { return hn::MulAdd(a.x, b.x, hn::MulAdd(a.y, b.y, hn::Mul(a.z, b.z))); }
HWY_INLINE VF to_float(VU v) { return hn::ConvertTo(f, hn::BitCast(si, v)); }
HWY_INLINE VU to_unsigned(VF v) { return hn::BitCast(un, hn::ConvertTo(si, v)); }

// image/normal.h: decode_normal32
HWY_INLINE V3 decode32(VU code) {
  const VF one = hn::Set(f, 1.0f), scale = hn::Set(f, 1.0f / 32767.0f);
  VF x = hn::Min(hn::Sub(hn::Mul(to_float(hn::And(code, hn::Set(un, 65535))), scale), one), one);
  VF y = hn::Min(hn::Sub(hn::Mul(to_float(hn::ShiftRight<16>(code)), scale), one), one);
  const VF z = hn::Sub(hn::Sub(one, hn::Abs(x)), hn::Abs(y));
  const VF fold = hn::Max(hn::Neg(z), hn::Zero(f));
  x = hn::Sub(x, hn::CopySign(fold, x));
  y = hn::Sub(y, hn::CopySign(fold, y));
  const V3 n{x, y, z};
  const VF inverse = hn::Div(one, hn::Sqrt(dot(n, n)));
  return {hn::Mul(x, inverse), hn::Mul(y, inverse), hn::Mul(z, inverse)};
}

// image/normal.h: encode_normal16
HWY_INLINE VU quantise(VF v) {
  const VF scaled =
      hn::Add(hn::Mul(hn::Add(hn::Mul(v, hn::Set(f, 0.5f)), hn::Set(f, 0.5f)), hn::Set(f, 254.0f)), hn::Set(f, 0.5f));
  return to_unsigned(hn::Min(hn::Max(scaled, hn::Zero(f)), hn::Set(f, 254.0f)));
}
HWY_INLINE VU encode16(const V3& n) {
  const VF one = hn::Set(f, 1.0f);
  const VF scale = hn::Div(one, hn::Add(hn::Add(hn::Abs(n.x), hn::Abs(n.y)), hn::Abs(n.z)));
  const VF x = hn::Mul(n.x, scale), y = hn::Mul(n.y, scale);
  const auto below = hn::Lt(n.z, hn::Zero(f));
  const VF fx = hn::CopySign(hn::Sub(one, hn::Abs(y)), x), fy = hn::CopySign(hn::Sub(one, hn::Abs(x)), y);
  const VU qx = quantise(hn::IfThenElse(below, fx, x)), qy = quantise(hn::IfThenElse(below, fy, y));
  // image/normal.h: canonical_normal16
  const VU most = hn::Set(un, 254);
  const auto at_border = [&](VU q) HWY_ATTR { return hn::Or(hn::Eq(q, hn::Zero(un)), hn::Eq(q, most)); };
  const auto upper = [&](VU q) HWY_ATTR { return hn::Max(q, hn::Sub(most, q)); };
  return hn::Or(hn::IfThenElse(at_border(qy), upper(qx), qx),
                hn::ShiftLeft<8>(hn::IfThenElse(at_border(qx), upper(qy), qy)));
}

// Returns the scalars' colours; scalars that are not a number have the last one.
HWY_INLINE VU look_up(VF scalar, const scene::ColourTable& table) {
  const VF entry = hn::MulAdd(hn::Sub(scalar, hn::Set(f, table.lo)), hn::Set(f, table.scale), hn::Set(f, table.offset));
  const VF last = hn::Set(f, float(scene::ColourTable::kEntries - 1));
  const VF within = hn::Min(hn::Max(entry, hn::Zero(f)), last);
  const VF none = hn::Set(f, float(scene::ColourTable::kEntries));
  const auto index = hn::ConvertTo(si, hn::IfThenElse(hn::IsNaN(scalar), none, within));
  return hn::GatherIndex(un, table.colours.data(), index);
}

void ShadeHits(const HitPacket& hits, uint32_t* HWY_RESTRICT colour, uint32_t* HWY_RESTRICT normal,
               const scene::ColourTable* scalars) {
  for (size_t lane = 0; lane < kPacket; lane += hn::Lanes(f)) {
    const VF w1 = hn::Load(f, hits.u + lane), w2 = hn::Load(f, hits.v + lane);
    const VF w0 = hn::Sub(hn::Sub(hn::Set(f, 1.0f), w1), w2);
    const auto blend = [&](VF a, VF b, VF c) { return hn::MulAdd(w2, c, hn::MulAdd(w1, b, hn::Mul(w0, a))); };

    // Normal: decode three corners, turn each to the viewer's side of the triangle, interpolate.
    const V3 g{hn::Load(f, hits.geometric_normal[0] + lane), hn::Load(f, hits.geometric_normal[1] + lane),
               hn::Load(f, hits.geometric_normal[2] + lane)};
    const V3 d{hn::Load(f, hits.direction[0] + lane), hn::Load(f, hits.direction[1] + lane),
               hn::Load(f, hits.direction[2] + lane)};
    const VF behind = dot(d, g), minus = hn::Set(f, -0.0f);
    const auto seen = [&](const V3& n) HWY_ATTR {  // n points away if the signs of n . g and d . g are equal
      const VF sign = hn::And(hn::Xor(hn::Xor(dot(n, g), behind), minus), minus);
      return V3{hn::Xor(n.x, sign), hn::Xor(n.y, sign), hn::Xor(n.z, sign)};
    };
    const V3 n0 = seen(decode32(hn::Load(un, hits.corner_normal[0] + lane)));
    const V3 n1 = seen(decode32(hn::Load(un, hits.corner_normal[1] + lane)));
    const V3 n2 = seen(decode32(hn::Load(un, hits.corner_normal[2] + lane)));
    V3 n{blend(n0.x, n1.x, n2.x), blend(n0.y, n1.y, n2.y), blend(n0.z, n1.z, n2.z)};

    // Corner normals along the triangle may cancel: then the triangle's own normal stands in.
    const auto cancelled = hn::Lt(dot(n, n), hn::Set(f, 1e-6f));
    const V3 own = seen(g);
    n = {hn::IfThenElse(cancelled, own.x, n.x), hn::IfThenElse(cancelled, own.y, n.y),
         hn::IfThenElse(cancelled, own.z, n.z)};
    const VF away =
        hn::Div(hn::Mul(hn::Max(dot(n, d), hn::Zero(f)), hn::Set(f, kTurn)), hn::Max(dot(d, d), hn::Set(f, 1e-30f)));
    n = {hn::NegMulAdd(away, d.x, n.x), hn::NegMulAdd(away, d.y, n.y), hn::NegMulAdd(away, d.z, n.z)};
    hn::Store(encode16(n), un, normal + lane);

    // Colour: looked up for a scalar, or per channel, rounded.
    const VU c0 = hn::Load(un, hits.corner_colour[0] + lane), c1 = hn::Load(un, hits.corner_colour[1] + lane),
             c2 = hn::Load(un, hits.corner_colour[2] + lane);
    if (scalars) {
      const VF scalar = blend(hn::BitCast(f, c0), hn::BitCast(f, c1), hn::BitCast(f, c2));
      hn::Store(look_up(scalar, *scalars), un, colour + lane);
      continue;
    }
    const VU mask = hn::Set(un, 255);
    const auto channel = [&](VU a, VU b, VU c) {
      const VF v = hn::Add(blend(to_float(hn::And(a, mask)), to_float(hn::And(b, mask)), to_float(hn::And(c, mask))),
                           hn::Set(f, 0.5f));
      return to_unsigned(hn::Min(hn::Max(v, hn::Zero(f)), hn::Set(f, 255.0f)));
    };
    const VU red = channel(hn::ShiftRight<16>(c0), hn::ShiftRight<16>(c1), hn::ShiftRight<16>(c2));
    const VU green = channel(hn::ShiftRight<8>(c0), hn::ShiftRight<8>(c1), hn::ShiftRight<8>(c2));
    hn::Store(hn::Or(hn::Or(hn::ShiftLeft<16>(red), hn::ShiftLeft<8>(green)), channel(c0, c1, c2)), un, colour + lane);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace telesplat::sampler
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace telesplat::sampler {

HWY_EXPORT(ShadeHits);

void shade_hits(const HitPacket& hits, uint32_t* colour, uint32_t* normal, const scene::ColourTable* scalars) {
  HWY_DYNAMIC_DISPATCH(ShadeHits)(hits, colour, normal, scalars);
}

namespace {
glm::vec3 rgb(uint32_t c) { return {c >> 16 & 255, c >> 8 & 255, c & 255}; }
}  // namespace

SurfacePoint surface_point(const geometry::MeshChunkView& chunk, uint32_t triangle, const glm::vec2& uv,
                           const glm::vec3& g, const glm::vec3& direction, const scene::ColourTable& colours) {
  const float weight[3] = {1 - uv.x - uv.y, uv.x, uv.y};
  SurfacePoint out{glm::vec3(0), glm::vec3(0)};
  float scalar = 0;
  const float behind = glm::dot(direction, g);
  const auto seen = [&](const glm::vec3& n) { return std::signbit(glm::dot(n, g)) == std::signbit(behind) ? -n : n; };
  for (int corner = 0; corner < 3; ++corner) {
    const uint32_t vertex = chunk.indices[3 * size_t{triangle} + corner], c = chunk.colours[vertex];
    out.colour += weight[corner] * rgb(c);
    if (chunk.scalars) scalar += weight[corner] * std::bit_cast<float>(c);
    out.normal += weight[corner] * seen(image::decode_normal32(chunk.normals[vertex]));
  }
  out.colour = chunk.scalars ? rgb(colours.at(scalar)) : glm::clamp(out.colour, 0.0f, 255.0f);
  if (glm::dot(out.normal, out.normal) < 1e-6f) out.normal = seen(g);
  out.normal -= kTurn * std::max(glm::dot(out.normal, direction), 0.0f) / glm::dot(direction, direction) * direction;
  out.normal = glm::normalize(out.normal);
  return out;
}

}  // namespace telesplat::sampler
#endif
