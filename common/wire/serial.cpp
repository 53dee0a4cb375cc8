#include "common/wire/serial.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <msgpack.hpp>
#include <optional>

static_assert(std::endian::native == std::endian::little, "bulk fields are little-endian and copied as they are");

namespace telesplat::wire {
namespace {

using Packer = msgpack::packer<msgpack::sbuffer>;

constexpr uint32_t kShearNumbers = 11;  // of a shear frame before its layers

// ---- encoding -------------------------------------------------------------------------------------------------------------

template <class T>
void pack_bin(Packer& p, std::span<const T> values) {
  p.pack_bin(static_cast<uint32_t>(values.size_bytes()));
  p.pack_bin_body(reinterpret_cast<const char*>(values.data()), static_cast<uint32_t>(values.size_bytes()));
}

class Encoder {
 public:
  explicit Encoder(Packer& packer) : p_(packer) {}

  template <class T>
  void operator()(const char* name, const T& value, size_t /*limit*/ = 0) {
    p_.pack(name);
    put(value);
  }

 private:
  void put(bool v) { p_.pack(v); }
  void put(uint64_t v) { p_.pack(v); }
  void put(double v) { p_.pack(v); }
  void put(const std::string& v) { p_.pack(v); }
  void put(const std::vector<std::string>& v) { p_.pack(v); }
  template <class V>
  void put(const std::map<std::string, V>& v) {
    p_.pack(v);
  }
  template <class Tag>
  void put(Id<Tag> v) {
    p_.pack(v.value);
  }
  void put(Bytes v) { pack_bin(p_, v); }
  void put(const std::vector<uint32_t>& v) { pack_bin(p_, std::span(v)); }
  void put(const std::vector<double>& v) { pack_bin(p_, std::span(v)); }
  void put(const geometry::Box& b) { numbers({b.lo.x, b.lo.y, b.lo.z, b.hi.x, b.hi.y, b.hi.z}); }
  void put(const geometry::Rect& r) { numbers({double(r.x), double(r.y), double(r.width), double(r.height)}); }
  void put(const geometry::Camera& c) {
    const auto& p = c.pose.position_room;
    const auto& q = c.pose.orientation;
    numbers({p.x, p.y, p.z, q.w, q.x, q.y, q.z, c.left, c.right, c.bottom, c.top, c.near_m, double(c.width),
             double(c.height)});
  }
  void put(const std::vector<geometry::ChunkInfo>& chunks) {
    p_.pack_array(static_cast<uint32_t>(chunks.size()));
    for (const auto& c : chunks)
      numbers({double(c.id.value), double(c.triangles), double(c.bytes), c.box_room.lo.x, c.box_room.lo.y,
               c.box_room.lo.z, c.box_room.hi.x, c.box_room.hi.y, c.box_room.hi.z});
  }
  void put(const Lease& lease);
  void put(const SliceLease& lease);
  void put(const volume::ShearFrame& s) {
    p_.pack_array(kShearNumbers + 3 * static_cast<uint32_t>(s.layers.size()));
    for (const double v : {double(s.axis), double(s.direction), s.eye.x, s.eye.y, s.eye.z, s.u0, s.du, s.v0, s.dv,
                           double(s.width), double(s.height)})
      p_.pack(v);
    for (const auto& l : s.layers)
      for (const double v : {double(l.begin), double(l.end), l.plane}) p_.pack(v);
  }
  template <class M>
  void put(const std::vector<M>& structs);
  void numbers(std::initializer_list<double> values) {
    p_.pack_array(static_cast<uint32_t>(values.size()));
    for (double v : values) p_.pack(v);
  }

  Packer& p_;
};

struct FieldCounter {
  uint32_t count = 0;
  template <class T>
  void operator()(const char*, const T&, size_t = 0) {
    ++count;
  }
};

template <class M>
void pack_map(Packer& p, const M& m, bool with_version) {
  FieldCounter counter;
  M::fields(counter, m);
  p.pack_map(counter.count + (with_version ? 1 : 0));
  if (with_version) {
    p.pack("v");
    p.pack(kProtocolVersion);
  }
  Encoder encoder(p);
  M::fields(encoder, m);
}

void Encoder::put(const Lease& lease) { pack_map(p_, lease, false); }
void Encoder::put(const SliceLease& lease) { pack_map(p_, lease, false); }
template <class M>
void Encoder::put(const std::vector<M>& structs) {
  p_.pack_array(static_cast<uint32_t>(structs.size()));
  for (const M& m : structs) pack_map(p_, m, false);
}

// ---- decoding -------------------------------------------------------------------------------------------------------------

const msgpack::object* find(const msgpack::object& map, std::string_view name) {
  for (uint32_t i = 0; i < map.via.map.size; ++i) {
    const auto& key = map.via.map.ptr[i].key;
    if (key.type == msgpack::type::STR && std::string_view(key.via.str.ptr, key.via.str.size) == name)
      return &map.via.map.ptr[i].val;
  }
  return nullptr;
}

class Decoder {
 public:
  explicit Decoder(const msgpack::object& map) : map_(map) {}
  std::optional<Error> error;

  template <class T>
  void operator()(const char* name, T& value, size_t limit = 0) {
    if (error) return;
    const msgpack::object* o = find(map_, name);
    if (!o) {
      error = Error{fmt::format("field {} is missing", name)};
      return;
    }
    name_ = name;
    limit_ = limit;
    get(*o, value);
  }

 private:
  void fail(std::string_view why) {
    if (!error) error = Error{fmt::format("field {} {}", name_, why)};
  }
  bool within(size_t size, size_t limit) {
    if (size <= limit) return true;
    fail(fmt::format("has {} entries or bytes, limit {}", size, limit));
    return false;
  }

  void get(const msgpack::object& o, bool& v) {
    if (o.type != msgpack::type::BOOLEAN) return fail("is not a boolean");
    v = o.via.boolean;
  }
  void get(const msgpack::object& o, uint64_t& v) {
    if (o.type != msgpack::type::POSITIVE_INTEGER) return fail("is not an unsigned integer");
    v = o.via.u64;
  }
  void get(const msgpack::object& o, double& v) {
    if (o.type == msgpack::type::FLOAT64 || o.type == msgpack::type::FLOAT32)
      v = o.via.f64;
    else if (o.type == msgpack::type::POSITIVE_INTEGER)
      v = static_cast<double>(o.via.u64);
    else if (o.type == msgpack::type::NEGATIVE_INTEGER)
      v = static_cast<double>(o.via.i64);
    else
      return fail("is not a number");
    if (!std::isfinite(v)) fail("is not finite");
  }
  void get(const msgpack::object& o, std::string& v) {
    if (o.type != msgpack::type::STR) return fail("is not a string");
    if (within(o.via.str.size, limit_ ? limit_ : kMaxString)) v.assign(o.via.str.ptr, o.via.str.size);
  }
  template <class Tag>
  void get(const msgpack::object& o, Id<Tag>& v) {
    get(o, v.value);
  }
  void get(const msgpack::object& o, Bytes& v) {
    if (o.type != msgpack::type::BIN) return fail("is not binary");
    if (within(o.via.bin.size, limit_)) v = {reinterpret_cast<const std::byte*>(o.via.bin.ptr), o.via.bin.size};
  }
  template <class T>
  void get_bin(const msgpack::object& o, std::vector<T>& v, size_t max_entries) {
    if (o.type != msgpack::type::BIN) return fail("is not binary");
    if (o.via.bin.size % sizeof(T))
      return fail(fmt::format("has {} bytes, not a multiple of {}", o.via.bin.size, sizeof(T)));
    if (!within(o.via.bin.size / sizeof(T), max_entries)) return;
    v.resize(o.via.bin.size / sizeof(T));
    if (!v.empty()) std::memcpy(v.data(), o.via.bin.ptr, o.via.bin.size);
  }
  void get(const msgpack::object& o, std::vector<uint32_t>& v) { get_bin(o, v, kMaxKeys); }
  void get(const msgpack::object& o, std::vector<double>& v) { get_bin(o, v, kMaxBulkBytes / sizeof(double)); }
  void get(const msgpack::object& o, std::vector<std::string>& v) {
    if (o.type != msgpack::type::ARRAY) return fail("is not a list");
    if (!within(o.via.array.size, kMaxEntries)) return;
    v.resize(o.via.array.size);
    for (uint32_t i = 0; i < o.via.array.size && !error; ++i) get(o.via.array.ptr[i], v[i]);
  }
  template <class V>
  void get(const msgpack::object& o, std::map<std::string, V>& v) {
    if (o.type != msgpack::type::MAP) return fail("is not a map");
    if (!within(o.via.map.size, kMaxEntries)) return;
    const size_t value_limit = limit_;
    for (uint32_t i = 0; i < o.via.map.size && !error; ++i) {
      std::string key;
      limit_ = 0;  // a field's own limit is its values'
      get(o.via.map.ptr[i].key, key);
      limit_ = value_limit;
      if (!error) get(o.via.map.ptr[i].val, v[key]);
    }
  }
  template <size_t N>
  bool numbers(const msgpack::object& o, double (&v)[N]) {
    if (o.type != msgpack::type::ARRAY || o.via.array.size != N) {
      fail(fmt::format("is not a list of {} numbers", N));
      return false;
    }
    for (size_t i = 0; i < N && !error; ++i) get(o.via.array.ptr[i], v[i]);
    return !error;
  }
  static bool is_integer(double v, double lo, double hi) { return v >= lo && v <= hi && v == std::floor(v); }
  void get(const msgpack::object& o, geometry::Box& b) {
    double v[6];
    if (!numbers(o, v)) return;
    for (double x : v)
      if (std::abs(x) > 3.5e38) return fail("is beyond single precision");
    b = {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
  }
  void get(const msgpack::object& o, geometry::Rect& r) {
    double v[4];
    if (!numbers(o, v)) return;
    const double side = geometry::kMaxImageSide;
    if (!is_integer(v[0], 0, side) || !is_integer(v[1], 0, side) || !is_integer(v[2], 1, side) ||
        !is_integer(v[3], 1, side))
      return fail(fmt::format("{}x{}+{}+{} is not a rectangle within {}", v[2], v[3], v[0], v[1], side));
    r = {int(v[0]), int(v[1]), int(v[2]), int(v[3])};
  }
  void get(const msgpack::object& o, geometry::Camera& c) {
    double v[14];
    if (!numbers(o, v)) return;
    if (!is_integer(v[12], 1, geometry::kMaxImageSide) || !is_integer(v[13], 1, geometry::kMaxImageSide))
      return fail(fmt::format("has size {}x{}, limit {}", v[12], v[13], geometry::kMaxImageSide));
    c = {{{v[0], v[1], v[2]}, glm::dquat(v[3], v[4], v[5], v[6])},
         v[7],
         v[8],
         v[9],
         v[10],
         v[11],
         int(v[12]),
         int(v[13])};
    if (const auto valid = geometry::validate(c); !valid) fail(": " + valid.error().text);
  }
  void get(const msgpack::object& o, std::vector<geometry::ChunkInfo>& chunks) {
    if (o.type != msgpack::type::ARRAY) return fail("is not a list");
    if (!within(o.via.array.size, geometry::kMaxChunks)) return;
    for (uint32_t i = 0; i < o.via.array.size && !error; ++i) {
      double v[9];
      if (!numbers(o.via.array.ptr[i], v)) return;
      if (!is_integer(v[0], 0, geometry::kMaxChunks) || !is_integer(v[1], 0, geometry::kMaxChunkTriangles) ||
          !is_integer(v[2], 0, kMaxBulkBytes))
        return fail("holds a chunk whose id, triangles or bytes are out of range");
      chunks.push_back(
          {ChunkId{uint64_t(v[0])}, {{v[3], v[4], v[5]}, {v[6], v[7], v[8]}}, uint64_t(v[1]), uint64_t(v[2])});
    }
  }
  void get(const msgpack::object& o, volume::ShearFrame& s) {
    if (o.type != msgpack::type::ARRAY) return fail("is not a list");
    const auto& list = o.via.array;
    if (list.size < kShearNumbers + 3 || (list.size - kShearNumbers) % 3 ||
        list.size > kShearNumbers + 3 * volume::kMaxLayers)
      return fail(fmt::format("is a list of {} numbers, limits {} and {}, three a layer", list.size, kShearNumbers + 3,
                              kShearNumbers + 3 * volume::kMaxLayers));
    const auto number = [&](uint32_t i) {
      double v = 0;
      if (!error) get(list.ptr[i], v);
      return v;
    };
    const auto integer = [&](uint32_t i, double lo, double hi) {
      const double v = number(i);
      if (!error && !is_integer(v, lo, hi))
        fail(fmt::format("has {} as number {}, not an integer in {} to {}", v, i, lo, hi));
      return error ? 0 : int(v);
    };
    s.axis = integer(0, 0, 2);
    s.direction = integer(1, -1, 1);
    s.eye = {number(2), number(3), number(4)};
    s.u0 = number(5), s.du = number(6), s.v0 = number(7), s.dv = number(8);
    s.width = integer(9, 1, volume::kMaxRasterSide);
    s.height = integer(10, 1, volume::kMaxRasterSide);
    for (uint32_t at = kShearNumbers; at < list.size && !error; at += 3)
      s.layers.push_back({integer(at, 0, volume::kMaxSide), integer(at + 1, 0, volume::kMaxSide), number(at + 2)});
  }
  void get(const msgpack::object& o, Lease& lease) { get_struct(o, lease); }
  void get(const msgpack::object& o, SliceLease& lease) { get_struct(o, lease); }
  void get(const msgpack::object& o, std::vector<SheetEntry>& v) { get_structs(o, v, kMaxSlabs); }
  void get(const msgpack::object& o, std::vector<SliceView>& v) { get_structs(o, v, kMaxViews); }
  template <class M>
  void get_struct(const msgpack::object& o, M& m) {
    if (o.type != msgpack::type::MAP) return fail("is not a map");
    Decoder inner(o);
    M::fields(inner, m);
    if (inner.error) fail(": " + inner.error->text);
  }
  template <class M>
  void get_structs(const msgpack::object& o, std::vector<M>& v, size_t limit) {
    if (o.type != msgpack::type::ARRAY) return fail("is not a list");
    if (!within(o.via.array.size, limit)) return;
    v.resize(o.via.array.size);
    for (uint32_t i = 0; i < o.via.array.size && !error; ++i) get_struct(o.via.array.ptr[i], v[i]);
  }

  const msgpack::object& map_;
  const char* name_ = "";
  size_t limit_ = 0;
};

// A tile's rectangle must lie in its frame, its number among the frame's tiles.
std::optional<Error> check_tile(const geometry::Camera& c, const geometry::Rect& r, uint64_t tile, uint64_t tiles) {
  if (tiles < 1 || tiles > kMaxTiles || tile >= tiles)
    return Error{fmt::format("tile {} of {} is out of range, limit {}", tile, tiles, kMaxTiles)};
  if (r.x + r.width > c.width || r.y + r.height > c.height)
    return Error{
        fmt::format("tile {}x{}+{}+{} is not inside its {}x{} frame", r.width, r.height, r.x, r.y, c.width, c.height)};
  return std::nullopt;
}
template <class M>
std::optional<Error> check(const M&) {
  return std::nullopt;
}
std::optional<Error> check_step(uint64_t step) {
  if (step < 1 || step > kMaxStep)
    return Error{fmt::format("step {} is out of range, limits 1 and {}", step, kMaxStep)};
  return std::nullopt;
}
std::optional<Error> check(const Lease& m) {
  if (auto bad = check_tile(m.camera, m.rect, m.tile, kMaxTiles)) return bad;
  if (int64_t{m.rect.width} * m.rect.height > kMaxTilePixels)
    return Error{fmt::format("tile of {}x{} pixels, limit {}", m.rect.width, m.rect.height, kMaxTilePixels)};
  if (auto bad = check_tile(m.camera, m.block_rect, m.block, m.blocks_in_frame)) return bad;
  const geometry::Rect &r = m.rect, &b = m.block_rect;
  if (r.x < b.x || r.y < b.y || r.x + r.width > b.x + b.width || r.y + r.height > b.y + b.height)
    return Error{fmt::format("tile {}x{}+{}+{} is not inside its block {}x{}+{}+{}", r.width, r.height, r.x, r.y,
                             b.width, b.height, b.x, b.y)};
  return check_step(m.step);
}
std::optional<Error> check(const DepthTile& m) { return check(m.lease); }
std::optional<Error> check(const Patch& m) {
  if (auto bad = check_tile(m.camera, m.rect, m.tile, m.tiles_in_frame)) return bad;
  return check_step(m.step);
}
std::optional<Error> check_frames(const std::vector<uint32_t>& clusters, const std::vector<uint32_t>& frames) {
  if (frames.empty() || frames.size() == clusters.size()) return std::nullopt;
  return Error{fmt::format("{} frames for {} clusters: neither none nor one each", frames.size(), clusters.size())};
}
std::optional<Error> check(const Forget& m) { return check_frames(m.clusters, m.frames); }
std::optional<Error> check(const AccessReport& m) { return check_frames(m.clusters, m.frames); }
std::optional<Error> check_buffers(uint64_t buffers) {
  if (buffers <= kMaxBuffers) return std::nullopt;
  return Error{fmt::format("{} buffers, limit {}", buffers, kMaxBuffers)};
}
std::optional<Error> check(const ViewRequest& m) { return check_buffers(m.buffers); }
std::optional<Error> check(const SliceAck& m) {
  if (m.buffers < 1) return Error{"0 buffers, at least 1"};
  return check_buffers(m.buffers);
}
std::optional<Error> check_slices(uint64_t begin, uint64_t end) {
  if (begin <= end && end <= uint64_t(volume::kMaxSide)) return std::nullopt;
  return Error{fmt::format("slices {} to {}, limit {}", begin, end, volume::kMaxSide)};
}
std::optional<Error> check_slab(uint64_t slab, uint64_t slabs, uint64_t begin, uint64_t end) {
  if (slabs < 1 || slabs > kMaxSlabs || slab >= slabs)
    return Error{fmt::format("slab {} of {} is out of range, limit {}", slab, slabs, kMaxSlabs)};
  return check_slices(begin, end);
}
std::optional<Error> check(const SliceWeights& m) {
  if (m.voxels.size() > size_t(volume::kMaxSide))
    return Error{fmt::format("{} slices, limit {}", m.voxels.size(), volume::kMaxSide)};
  return check_slices(m.begin, m.begin + m.voxels.size());
}
std::optional<Error> check(const SlabAssignment& m) {
  for (const auto& e : m.sheet)
    if (auto bad = check_slices(e.begin, e.end)) return bad;
  return check_slab(m.slab, m.slabs, m.begin, m.end);
}
std::optional<Error> check(const SliceLease& m) {
  if (m.views.empty()) return Error{"is for no viewer"};
  for (const auto& v : m.views)
    if (auto bad = check_buffers(v.buffers)) return bad;
  if (m.begin == m.end) return Error{"its slab is empty"};
  return check_slab(m.slab, m.slabs, m.begin, m.end);
}
std::optional<Error> check(const SliceImages& m) { return check(m.lease); }
std::optional<Error> check(const VoxelRequest& m) { return check_slices(m.begin, m.end); }
std::optional<Error> check(const VoxelData& m) { return check_slices(m.begin, m.end); }

template <class M>
constexpr size_t body_limit() {
  constexpr bool bulk = requires(M m) { m.image; }
  || requires(M m) { m.data; }
  || requires(M m) { m.chunks; }
  || requires(M m) { m.clusters; }
  || requires(M m) { m.columns; };
  return bulk ? kMaxBulkBytes + kMaxControlBytes : kMaxControlBytes;
}

}  // namespace

template <class M>
std::string encode(const M& message) {
  msgpack::sbuffer buffer;
  Packer packer(buffer);
  pack_map(packer, message, true);
  return {buffer.data(), buffer.size()};
}

template <class M>
Result<M> decode(Bytes body) {
  const auto refuse = [](const std::string& why) { return Error{fmt::format("{}: {}", M::kName, why)}; };
  if (body.size() > body_limit<M>()) return refuse(fmt::format("{} bytes, limit {}", body.size(), body_limit<M>()));
  try {
    // Strings and binaries are referenced in place; claimed sizes of lists and maps are limited before they are allocated.
    const msgpack::unpack_limit limit(geometry::kMaxChunks, kMaxEntries, kMaxControlBytes, kMaxBulkBytes, 0, 8);
    size_t offset = 0;
    const msgpack::object_handle handle = msgpack::unpack(
        reinterpret_cast<const char*>(body.data()), body.size(), offset,
        [](msgpack::type::object_type, size_t, void*) { return true; }, nullptr, limit);
    if (offset != body.size()) return refuse(fmt::format("{} bytes follow the map", body.size() - offset));
    const msgpack::object& map = handle.get();
    if (map.type != msgpack::type::MAP) return refuse("is not a map");
    const msgpack::object* version = find(map, "v");
    if (!version || version->type != msgpack::type::POSITIVE_INTEGER) return refuse("has no version");
    if (version->via.u64 != kProtocolVersion)
      return refuse(fmt::format("has version {} instead of {}", version->via.u64, kProtocolVersion));
    M message;
    Decoder decoder(map);
    M::fields(decoder, message);
    if (decoder.error) return refuse(decoder.error->text);
    if (const auto bad = check(message)) return refuse(bad->text);
    return message;
  } catch (const std::exception& e) {  // msgpack's own errors: truncated, too deep, too large
    return refuse(e.what());
  }
}

#define TELESPLAT_MESSAGE(M)                \
  template std::string encode<M>(const M&); \
  template Result<M> decode<M>(Bytes);
TELESPLAT_MESSAGE(Hello)
TELESPLAT_MESSAGE(Welcome)
TELESPLAT_MESSAGE(WhoAreYou)
TELESPLAT_MESSAGE(ViewRequest)
TELESPLAT_MESSAGE(LeaseRequest)
TELESPLAT_MESSAGE(Lease)
TELESPLAT_MESSAGE(LeaseExtend)
TELESPLAT_MESSAGE(TileDone)
TELESPLAT_MESSAGE(StatusReport)
TELESPLAT_MESSAGE(MetricRows)
TELESPLAT_MESSAGE(Control)
TELESPLAT_MESSAGE(ControlReply)
TELESPLAT_MESSAGE(Shutdown)
TELESPLAT_MESSAGE(Goodbye)
TELESPLAT_MESSAGE(ChunkListRequest)
TELESPLAT_MESSAGE(ChunkList)
TELESPLAT_MESSAGE(ChunkRequest)
TELESPLAT_MESSAGE(Chunk)
TELESPLAT_MESSAGE(DepthTile)
TELESPLAT_MESSAGE(Patch)
TELESPLAT_MESSAGE(Forget)
TELESPLAT_MESSAGE(EpochBegin)
TELESPLAT_MESSAGE(StateMark)
TELESPLAT_MESSAGE(StateRequest)
TELESPLAT_MESSAGE(AccessReport)
TELESPLAT_MESSAGE(SliceWeights)
TELESPLAT_MESSAGE(SlabAssignment)
TELESPLAT_MESSAGE(SlabReady)
TELESPLAT_MESSAGE(SliceLease)
TELESPLAT_MESSAGE(VoxelRequest)
TELESPLAT_MESSAGE(VoxelData)
TELESPLAT_MESSAGE(SliceImages)
TELESPLAT_MESSAGE(SliceFrame)
TELESPLAT_MESSAGE(SliceAck)
#undef TELESPLAT_MESSAGE

}  // namespace telesplat::wire
