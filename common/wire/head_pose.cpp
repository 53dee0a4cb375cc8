#include "common/wire/head_pose.h"

#include <fmt/format.h>

#include <cmath>
#include <msgpack/pack.hpp>
#include <msgpack/unpack.hpp>
#include <span>
#include <string_view>

namespace telesplat::wire {
namespace {

constexpr double kLongestTime_s = 1e12;
constexpr double kLengthTolerance = 0.05;

const msgpack::object* field(const msgpack::object& map, std::string_view name) {
  for (uint32_t i = 0; i < map.via.map.size; ++i) {
    const auto& key = map.via.map.ptr[i].key;
    if (key.type == msgpack::type::STR && std::string_view(key.via.str.ptr, key.via.str.size) == name)
      return &map.via.map.ptr[i].val;
  }
  return nullptr;
}

Status read_number(const msgpack::object& o, const char* name, double most, double& out) {
  if (o.type == msgpack::type::FLOAT64 || o.type == msgpack::type::FLOAT32)
    out = o.via.f64;
  else if (o.type == msgpack::type::POSITIVE_INTEGER)
    out = double(o.via.u64);
  else if (o.type == msgpack::type::NEGATIVE_INTEGER)
    out = double(o.via.i64);
  else
    return Error{fmt::format("field {} is not a number", name)};
  if (!(std::abs(out) <= most)) return Error{fmt::format("field {} has {}, limit {}", name, out, most)};
  return ok_status();
}

Status read_numbers(const msgpack::object& map, const char* name, double most, std::span<double> out) {
  const msgpack::object* list = field(map, name);
  if (!list) return Error{fmt::format("field {} is missing", name)};
  if (list->type != msgpack::type::ARRAY || list->via.array.size != out.size())
    return Error{fmt::format("field {} is not a list of {} numbers", name, out.size())};
  for (size_t i = 0; i < out.size(); ++i)
    if (const Status s = read_number(list->via.array.ptr[i], name, most, out[i]); !s) return s;
  return ok_status();
}

Result<HeadPose> read(const msgpack::object& map) {
  if (map.type != msgpack::type::MAP) return Error{"is not a map"};
  HeadPose out;
  double t = 0, p[3], q[4];
  if (const msgpack::object* time = field(map, "t")) {
    if (const Status s = read_number(*time, "t", kLongestTime_s, t); !s) return s.error();
    out.t_s = t;
  }
  if (const Status s = read_numbers(map, "p", kFarthestHead_m, p); !s) return s.error();
  if (const Status s = read_numbers(map, "q", 2, q); !s) return s.error();
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
  try {
    const msgpack::unpack_limit limit(64, 64, kMaxHeadPoseBytes, kMaxHeadPoseBytes, kMaxHeadPoseBytes, 8);
    size_t offset = 0;
    const msgpack::object_handle handle = msgpack::unpack(
        reinterpret_cast<const char*>(body.data()), body.size(), offset,
        [](msgpack::type::object_type, size_t, void*) { return true; }, nullptr, limit);
    if (offset != body.size()) return Error{fmt::format("{} bytes follow the map", body.size() - offset)};
    return read(handle.get());
  } catch (const std::exception& e) {  // msgpack's own errors: truncated, too deep, too large
    return Error{e.what()};
  }
}

}  // namespace telesplat::wire
