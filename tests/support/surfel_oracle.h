// The contour in double precision, by the thesis's matrices (T4.4.1, eq. 4.2-4.7).
#pragma once

#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat2x2.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "common/geometry/camera.h"
#include "common/splat/surfel/splat.h"

namespace telesplat::testing {

/// A sample: its place, its surface's direction, and the view that took it. Room space, metres.
struct Sample {
  glm::dvec3 position, normal, to_eye;  ///< the last two of unit length
  double radius_m = 0;
};

/// Two unit vectors that span the plane across n.
inline std::array<glm::dvec3, 2> basis_across(const glm::dvec3& n) {
  const glm::dvec3 helper = std::abs(n.x) < 0.7 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
  const glm::dvec3 a = glm::normalize(glm::cross(helper, n));
  return {a, glm::cross(n, a)};
}

/// Coordinates of the tangent plane -> coordinates of the input screen, M_i of eq. 4.4 for a sampling view far away
/// (row vectors: (s, t, 1) M_i). The input screen's axes lie across and along the slope; the one along it shrinks by
/// the cosine of the slope, or, `limited`, by no more than the splatter's limit.
inline glm::dmat3 input_mapping(const Sample& sample, const std::array<glm::dvec3, 2>& tangent, bool limited) {
  const glm::dvec3 along = sample.to_eye - glm::dot(sample.to_eye, sample.normal) * sample.normal;
  const double sine = glm::length(along), cosine = std::abs(glm::dot(sample.to_eye, sample.normal));
  const glm::dvec3 d = sine > 1e-9 ? along / sine : tangent[0], across = glm::cross(sample.normal, d);
  const double shrink = limited && cosine < splat::kMinSampledCosine
                            ? 1.0 / std::sqrt(1.0 + sine * sine / std::pow(double(splat::kMinSampledCosine), 2))
                            : cosine;
  // Columns of GLM's matrices are rows here: input = transpose(m) * (s, t, 1).
  const auto row = [&](const glm::dvec3& t) { return glm::dvec3(shrink * glm::dot(t, d), glm::dot(t, across), 0); };
  return {row(tangent[0]), row(tangent[1]), glm::dvec3(0, 0, 1)};
}

struct CentralConic {
  glm::dvec2 centre;  ///< pixels
  glm::dmat2 q;       ///< (x - centre)^T q (x - centre) = 1
};

/// Eq. 4.3 to 4.7 with a circle of sample.radius_m on the input screen.
inline CentralConic contour_by_matrices(const geometry::Camera& camera, const Sample& sample, bool limited) {
  const auto tangent = basis_across(sample.normal);
  // Rows as GLM's columns: M here is the transpose of the thesis's, so Q' = transpose(M) Q M.
  const glm::dmat3 m_in = input_mapping(sample, tangent, limited);
  const auto to_pixel = camera.room_to_pixel();
  const auto output = [&](const glm::dvec3& p, double one) {
    const glm::dvec4 h(p, one);
    return glm::dvec3(glm::dot(to_pixel.x, h), glm::dot(to_pixel.y, h), glm::dot(to_pixel.w, h));
  };
  const glm::dmat3 m_out(output(tangent[0], 0), output(tangent[1], 0), output(sample.position, 1));
  const double r2 = sample.radius_m * sample.radius_m;
  const glm::dmat3 q_h(1 / r2, 0, 0, 0, 1 / r2, 0, 0, 0, -1);
  const glm::dmat3 back = m_in * glm::inverse(m_out);
  const glm::dmat3 q = glm::transpose(back) * q_h * back;
  const double a = q[0][0], b = q[0][1], c = q[1][1], d = q[0][2], e = q[1][2], f = -q[2][2];
  const double det = a * c - b * b;
  const glm::dvec2 centre((b * e - c * d) / det, (b * d - a * e) / det);
  return {centre, glm::dmat2(a, b, b, c) / (f - d * centre.x - e * centre.y)};
}

/// Returns a point of the footprint's rim, room space: the sampling view saw this point of the tangent plane at `angle`
/// on its circle.
inline glm::dvec3 rim_point(const Sample& sample, double angle, bool limited) {
  const auto tangent = basis_across(sample.normal);
  const glm::dmat2 m(input_mapping(sample, tangent, limited));
  const glm::dvec2 st = glm::inverse(m) * (sample.radius_m * glm::dvec2(std::cos(angle), std::sin(angle)));
  return sample.position + st.x * tangent[0] + st.y * tangent[1];
}

inline glm::dvec2 project(const geometry::Camera& camera, const glm::dvec3& p) {
  const auto t = camera.room_to_pixel();
  const glm::dvec4 h(p, 1);
  return glm::dvec2(glm::dot(t.x, h), glm::dot(t.y, h)) / glm::dot(t.w, h);
}

}  // namespace telesplat::testing
