#include "common/wire/head_pose.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <msgpack/pack.hpp>

#include "common/wire/decoder.h"

namespace telesplat::wire {
namespace {

constexpr double kLongestTime_s = 1e12;
constexpr double kLengthTolerance = 0.05;

// Reads the fields of a map that any tracking program may have written.
Result<HeadPose> read(const msgpack::object& map) {
  Decoder decoder(map);
  HeadPose out;
  double t = 0;
  std::array<double, 3> p{};
  std::array<double, 4> q{};
  if (decoder.has("t")) {
    decoder("t", t);
    out.t_s = t;
  }
  decoder("p", p);
  decoder("q", q);
  if (decoder.error()) return *decoder.error();
  if (!(std::abs(t) <= kLongestTime_s)) return Error{fmt::format("field t has {}, limit {}", t, kLongestTime_s)};
  for (const double v : p)
    if (!(std::abs(v) <= kFarthestHead_m)) return Error{fmt::format("field p has {}, limit {}", v, kFarthestHead_m)};
  const glm::dquat orientation(q[0], q[1], q[2], q[3]);
  if (!(std::abs(glm::length(orientation) - 1) <= kLengthTolerance))
    return Error{fmt::format("field q has the length {:.3f} instead of 1", glm::length(orientation))};
  out.pose = {{p[0], p[1], p[2]}, glm::normalize(orientation)};
  return out;
}

}  // namespace

std::string encode_head_pose(const HeadPose& head) {
  struct Appender {
    std::string out;
    void write(const char* data, size_t size) { out.append(data, size); }
  } bytes;
  msgpack::packer<Appender> packer(bytes);
  const auto name = [&](const char* text) {
    packer.pack_str(1);
    packer.pack_str_body(text, 1);
  };
  packer.pack_map(head.t_s ? 3 : 2);
  if (head.t_s) name("t"), packer.pack_double(*head.t_s);
  const auto& p = head.pose.position_room;
  const auto& q = head.pose.orientation;
  name("p"), packer.pack_array(3);
  for (const double v : {p.x, p.y, p.z}) packer.pack_double(v);
  name("q"), packer.pack_array(4);
  for (const double v : {q.w, q.x, q.y, q.z}) packer.pack_double(v);
  return bytes.out;
}

Result<HeadPose> decode_head_pose(Bytes body) {
  if (body.size() > kMaxHeadPoseBytes)
    return Error{fmt::format("has {} bytes, limit {}", body.size(), kMaxHeadPoseBytes)};
  Result<HeadPose> out = Error{};
  const auto bad = read_any(body, kMaxHeadPoseBytes, [&](const msgpack::object& map) {
    out = read(map);
    return std::optional<Error>();
  });
  return bad ? *bad : out;
}

}  // namespace telesplat::wire
