#include "common/wire/encoder.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <msgpack/pack.hpp>

#include "common/core/utf8.h"
#include "common/wire/short_camera.h"
#include "common/wire/varint.h"

static_assert(std::endian::native == std::endian::little, "bulk fields are little-endian and copied as they are");

namespace telesplat::wire {
namespace {

struct Appender {
  std::string& out;
  void write(const char* data, size_t size) { out.append(data, size); }
};

/// msgpack's writer into a string.
class Packer : Appender, public msgpack::packer<Appender> {
 public:
  explicit Packer(std::string& out) : Appender{out}, msgpack::packer<Appender>(static_cast<Appender&>(*this)) {}
};

// Converts text that is not UTF-8 for receivers. to_utf8(text) may be three times as long: it is cut at a character, to
// the smallest of the limits that `text` itself is within.
std::string presentable(std::string_view text) {
  std::string out = to_utf8(text);
  for (const size_t limit : {kMaxString, kMaxFact, kMaxControlBytes}) {
    if (text.size() > limit) continue;
    size_t end = std::min(out.size(), limit);
    while (end < out.size() && end > 0 && (static_cast<unsigned char>(out[end]) & 0xc0) == 0x80) --end;
    out.resize(end);
    break;
  }
  return out;
}

}  // namespace

void Encoder::begin_map(uint32_t entries) { Packer(out_).pack_map(entries); }
void Encoder::begin_array(uint32_t entries) { Packer(out_).pack_array(entries); }

void Encoder::put_version(uint64_t version) {
  put_text("v");
  put(version);
}

void Encoder::numbers(std::span<const double> values) {
  begin_array(static_cast<uint32_t>(values.size()));
  for (const double v : values) put(v);
}

// Names and paths of a machine may be any bytes, but receivers take only UTF-8.
void Encoder::put_text(std::string_view text) {
  if (!valid_utf8(text)) return put_text(presentable(text));
  Packer packer(out_);
  packer.pack_str(static_cast<uint32_t>(text.size()));
  packer.pack_str_body(text.data(), static_cast<uint32_t>(text.size()));
}

void Encoder::put(bool v) { v ? Packer(out_).pack_true() : Packer(out_).pack_false(); }
void Encoder::put(uint64_t v) { Packer(out_).pack_uint64(v); }

// Writes the shortest form that is exactly this number: msgpack's writers turn whole numbers into integers.
void Encoder::put(double v) {
  const bool single =
      std::abs(v) <= std::numeric_limits<float>::max() && static_cast<double>(static_cast<float>(v)) == v;
  single ? Packer(out_).pack_float(static_cast<float>(v)) : Packer(out_).pack_double(v);
}

void Encoder::put(const std::vector<std::string>& v) {
  begin_array(static_cast<uint32_t>(v.size()));
  for (const std::string& text : v) put_text(text);
}

void Encoder::put(const std::map<std::string, std::string>& v) {
  begin_map(static_cast<uint32_t>(v.size()));
  for (const auto& [key, text] : v) put_text(key), put_text(text);
}

void Encoder::put(const std::map<std::string, double>& v) {
  begin_map(static_cast<uint32_t>(v.size()));
  for (const auto& [key, number] : v) put_text(key), put(number);
}

void Encoder::put(Bytes v) {
  Packer packer(out_);
  packer.pack_bin(static_cast<uint32_t>(v.size()));
  packer.pack_bin_body(reinterpret_cast<const char*>(v.data()), static_cast<uint32_t>(v.size()));
}

void Encoder::put(const geometry::Box& b) { numbers({b.lo.x, b.lo.y, b.lo.z, b.hi.x, b.hi.y, b.hi.z}); }

void Encoder::put(const geometry::Rect& r) { numbers({double(r.x), double(r.y), double(r.width), double(r.height)}); }

void Encoder::put(const geometry::Pose& pose) {
  const auto& p = pose.position_room;
  const auto& q = pose.orientation;
  numbers({p.x, p.y, p.z, q.w, q.x, q.y, q.z});
}

void Encoder::put(const geometry::Camera& c) {
  if (const auto bytes = brief_ ? short_form(c) : std::nullopt) return put(std::as_bytes(std::span(*bytes)));
  const auto& p = c.pose.position_room;
  const auto& q = c.pose.orientation;
  numbers({p.x, p.y, p.z, q.w, q.x, q.y, q.z, c.left, c.right, c.bottom, c.top, c.near_m, double(c.width),
           double(c.height)});
}

// Writes whole microseconds since the known moment before: most differences take three bytes, an unknown moment one;
// in a brief message two bytes and one.
void Encoder::put(const Moments& m) {
  std::string brief;
  if (!brief_) begin_array(std::size(kMoments));
  int64_t before = 0;
  for (const double Moments::*moment : kMoments) {
    const double us = std::round(1e6 * (m.*moment));
    if (us == 0 || !(std::abs(us) <= kMostMoment_us)) {
      brief_ ? put_varint(brief, 0) : static_cast<void>(Packer(out_).pack_nil());
      continue;
    }
    const auto now = static_cast<int64_t>(us);
    const bool duration = moment == &Moments::fetch_s;
    const int64_t sent = duration ? now : now - before;
    brief_ ? put_varint(brief, fold(sent) + 1) : static_cast<void>(Packer(out_).pack_int64(sent));
    if (!duration) before = now;
  }
  if (brief_) put(std::as_bytes(std::span(brief)));
}

void Encoder::put(const std::vector<geometry::ChunkInfo>& chunks) {
  begin_array(static_cast<uint32_t>(chunks.size()));
  for (const auto& c : chunks)
    numbers({double(c.id.value), double(c.triangles), double(c.bytes), c.box_room.lo.x, c.box_room.lo.y,
             c.box_room.lo.z, c.box_room.hi.x, c.box_room.hi.y, c.box_room.hi.z, c.spacing_m, double(c.first_child),
             double(c.children)});
}

void Encoder::put(const volume::ShearFrame& s) {
  begin_array(kShearNumbers + kLayerNumbers * static_cast<uint32_t>(s.layers.size()));
  for (const double v : {double(s.axis), double(s.direction), s.eye.x, s.eye.y, s.eye.z, s.u0, s.du, s.v0, s.dv,
                         double(s.width), double(s.height)})
    put(v);
  for (const auto& l : s.layers)
    for (const double v : {double(l.begin), double(l.end), l.plane}) put(v);
}

}  // namespace telesplat::wire
