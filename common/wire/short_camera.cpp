#include "common/wire/short_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "common/wire/varint.h"

namespace telesplat::wire {
namespace {

// Bits of the first byte; the lowest two say which component of the orientation is left out.
constexpr unsigned kEvenX = 4, kEvenY = 8, kUsualNear = 16, kFlags = 31;
constexpr double kNear_m = 0.02f;
constexpr double kMostSteps = 1 << 30;  // 2 km
constexpr unsigned kMostBytes = 5;      // bytes of a number

// The orientation is stored as three components: it has unit length, so the fourth is the root of the rest, and
// positive. All steps but the root are exact in f64, and roots are rounded alike on all machines.
struct Steps {
  unsigned flags = 0;
  std::array<int64_t, 3> position{}, turn{};
  int64_t right = 0, left = 0, top = 0, bottom = 0;
  double near_m = kNear_m;
  int width = 0, height = 0;
};

std::array<double, 4> components(const glm::dquat& q) { return {q.w, q.x, q.y, q.z}; }

glm::dquat turned(const Steps& s) {
  std::array<double, 4> q{};
  double rest = 1;
  for (size_t i = 0, from = 0; i < 4; ++i) {
    if (i == (s.flags & 3)) continue;
    q[i] = std::ldexp(static_cast<double>(s.turn[from++]), -kTurnBits);
    rest -= q[i] * q[i];
  }
  q[s.flags & 3] = std::sqrt(std::max(rest, 0.0));
  return {q[0], q[1], q[2], q[3]};
}

double placed(int64_t steps) { return std::ldexp(static_cast<double>(steps), -kPlaceBits); }

geometry::Camera camera_of(const Steps& s) {
  return {{{placed(s.position[0]), placed(s.position[1]), placed(s.position[2])}, turned(s)},
          placed(s.left),
          placed(s.right),
          placed(s.bottom),
          placed(s.top),
          s.near_m,
          s.width,
          s.height};
}

int64_t steps_of(double v, int bits) { return std::llround(std::ldexp(v, bits)); }

// Precondition: within_reach().
Steps nearest(const geometry::Camera& c, unsigned left_out) {
  Steps s{.flags = left_out};
  const auto& p = c.pose.position_room;
  s.position = {steps_of(p.x, kPlaceBits), steps_of(p.y, kPlaceBits), steps_of(p.z, kPlaceBits)};
  const std::array<double, 4> q = components(c.pose.orientation);
  for (size_t i = 0, to = 0; i < 4; ++i)
    if (i != left_out) s.turn[to++] = steps_of(q[i], kTurnBits);
  s.right = steps_of(c.right, kPlaceBits), s.left = steps_of(c.left, kPlaceBits);
  s.top = steps_of(c.top, kPlaceBits), s.bottom = steps_of(c.bottom, kPlaceBits);
  s.near_m = static_cast<double>(static_cast<float>(c.near_m));
  s.width = c.width, s.height = c.height;
  if (s.left == -s.right) s.flags |= kEvenX;
  if (s.bottom == -s.top) s.flags |= kEvenY;
  if (s.near_m == kNear_m) s.flags |= kUsualNear;
  return s;
}

bool within_reach(const geometry::Camera& c) {
  const auto& p = c.pose.position_room;
  for (const double v : {p.x, p.y, p.z, c.left, c.right, c.bottom, c.top})
    if (!(std::abs(std::ldexp(v, kPlaceBits)) < kMostSteps)) return false;
  return geometry::validate(c).ok();
}

std::optional<Steps> exact_steps(const geometry::Camera& c) {
  if (!within_reach(c)) return std::nullopt;
  for (unsigned left_out = 0; left_out < 4; ++left_out)
    if (const Steps s = nearest(c, left_out); camera_of(s) == c) return s;
  return std::nullopt;
}

}  // namespace

geometry::Camera shortened(const geometry::Camera& camera) {
  if (!within_reach(camera) || exact_steps(camera)) return camera;
  geometry::Camera unit = camera;
  glm::dquat& q = unit.pose.orientation;
  q = glm::normalize(q);
  const std::array<double, 4> all = components(q);
  const auto largest =
      std::max_element(all.begin(), all.end(), [](double a, double b) { return std::abs(a) < std::abs(b); });
  if (*largest < 0) q = -q;
  const geometry::Camera out = camera_of(nearest(unit, static_cast<unsigned>(largest - all.begin())));
  return geometry::validate(out) ? out : camera;
}

std::optional<std::string> short_form(const geometry::Camera& camera) {
  const std::optional<Steps> s = exact_steps(camera);
  if (!s) return std::nullopt;
  std::string out(1, static_cast<char>(s->flags));
  for (const int64_t v : s->position) put_varint(out, fold(v));
  for (const int64_t v : s->turn) put_varint(out, fold(v));
  put_varint(out, fold(s->right));
  if (!(s->flags & kEvenX)) put_varint(out, fold(s->left));
  put_varint(out, fold(s->top));
  if (!(s->flags & kEvenY)) put_varint(out, fold(s->bottom));
  if (!(s->flags & kUsualNear)) {
    const auto near_m = std::bit_cast<std::array<char, 4>>(static_cast<float>(s->near_m));
    out.append(near_m.data(), near_m.size());
  }
  put_varint(out, static_cast<uint64_t>(s->width));
  put_varint(out, static_cast<uint64_t>(s->height));
  return out;
}

Result<geometry::Camera> read_short_form(Bytes bytes) {
  VarintSource in(bytes);
  const auto signed_number = [&] { return unfold(in.number(kMostBytes)); };
  Steps s{.flags = in.byte()};
  if (s.flags > kFlags) return Error{fmt::format("has flags {} of a short camera, limit {}", s.flags, kFlags)};
  for (int64_t& v : s.position) v = signed_number();
  int64_t squares = 0;
  for (int64_t& v : s.turn) {
    v = signed_number();
    if (std::abs(v) > int64_t{1} << kTurnBits)
      return Error{fmt::format("has {} as a component of its orientation, limit {}", v, 1 << kTurnBits)};
    squares += v * v;
  }
  if (squares > int64_t{1} << 2 * kTurnBits)
    return Error{
        fmt::format("has an orientation whose squares are {}, limit {}", squares, int64_t{1} << 2 * kTurnBits)};
  s.right = signed_number();
  s.left = s.flags & kEvenX ? -s.right : signed_number();
  s.top = signed_number();
  s.bottom = s.flags & kEvenY ? -s.top : signed_number();
  if (!(s.flags & kUsualNear)) {
    std::array<uint8_t, 4> near_m{};
    for (uint8_t& byte : near_m) byte = in.byte();
    s.near_m = static_cast<double>(std::bit_cast<float>(near_m));
  }
  const uint64_t width = in.number(kMostBytes), height = in.number(kMostBytes);
  if (in.failed()) return Error{fmt::format("of {} bytes is no short camera", bytes.size())};
  if (in.left() != 0) return Error{fmt::format("has {} bytes after a short camera", in.left())};
  if (width < 1 || width > geometry::kMaxImageSide || height < 1 || height > geometry::kMaxImageSide)
    return Error{fmt::format("has size {}x{}, limit {}", width, height, geometry::kMaxImageSide)};
  s.width = static_cast<int>(width), s.height = static_cast<int>(height);
  const geometry::Camera camera = camera_of(s);
  if (const Status valid = geometry::validate(camera); !valid) return Error{": " + valid.error().text};
  return camera;
}

}  // namespace telesplat::wire
