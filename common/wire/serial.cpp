#include "common/wire/serial.h"

#include <fmt/format.h>

#include <array>

#include "common/wire/decoder.h"
#include "common/wire/encoder.h"

namespace telesplat::wire {
namespace {

constexpr uint64_t kMaxWallFrame = uint64_t{1} << 53;  // largest number of a wall's frame

// A tile's rectangle must lie in its frame, its number among the frame's tiles.
std::optional<Error> check_tile(const geometry::Camera& c, const geometry::Rect& r, uint64_t tile, uint64_t tiles) {
  if (tiles < 1 || tiles > kMaxTiles || tile >= tiles)
    return Error{fmt::format("tile {} of {} is out of range, limit {}", tile, tiles, kMaxTiles)};
  if (r.x + r.width > c.width || r.y + r.height > c.height)
    return Error{
        fmt::format("tile {}x{}+{}+{} is not inside its {}x{} frame", r.width, r.height, r.x, r.y, c.width, c.height)};
  return std::nullopt;
}

std::optional<Error> check_pixels(const geometry::Rect& r) {
  if (int64_t{r.width} * r.height <= kMaxTilePixels) return std::nullopt;
  return Error{fmt::format("tile of {}x{} pixels, limit {}", r.width, r.height, kMaxTilePixels)};
}

std::optional<Error> check_step(uint64_t step) {
  if (step < 1 || step > kMaxStep)
    return Error{fmt::format("step {} is out of range, limits 1 and {}", step, kMaxStep)};
  return std::nullopt;
}

std::optional<Error> check_footprint(double footprint) {
  if (footprint >= 0) return std::nullopt;
  return Error{fmt::format("footprint {}, at least 0", footprint)};
}

std::optional<Error> check_frames(const std::vector<uint32_t>& clusters, const std::vector<uint32_t>& frames) {
  if (frames.empty() || frames.size() == clusters.size()) return std::nullopt;
  return Error{fmt::format("{} frames for {} clusters: neither none nor one each", frames.size(), clusters.size())};
}

std::optional<Error> check_buffers(uint64_t buffers) {
  if (buffers <= kMaxBuffers) return std::nullopt;
  return Error{fmt::format("{} buffers, limit {}", buffers, kMaxBuffers)};
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

// NaN lies within no limits.
struct Setting {
  const char* name;
  double value, least, most;
};

// Checks conditions between the fields of a message, beyond each field's own limits. Most messages need no check.
template <class M>
std::optional<Error> check(const M&) {
  return std::nullopt;
}

std::optional<Error> check(const Welcome& m) {
  const SessionSettings& s = m.settings;
  for (const Setting& row : {Setting{"max_points", double(s.max_points), 0, 1e12},
                             {"base_triangles", double(s.base_triangles), 0, double(kMaxBaseTriangles)},
                             {"obsolete_after_s", s.obsolete_after_s, 0, 1e12},
                             {"max_rate_mbit", s.max_rate_mbit, 0, 1e6},
                             {"view_cell_m", s.view_cell_m, 0, 1e3},
                             {"validation", double(s.validation), 0, 4096},
                             {"still_rays", double(s.still_rays), 1, 16},
                             {"layers", double(s.layers), 1, volume::kMaxLayers},
                             {"least_sampling", s.least_sampling, 0.01, 1},
                             {"buffers", double(s.buffers), 1, double(kMaxBuffers)},
                             {"picture_quality", double(s.picture_quality), 1, 100},
                             {"picture_samples", double(s.picture_samples), 1, 16},
                             {"picture_shading", double(s.picture_shading), 0, 2},
                             {"picture_background", double(s.picture_background), 0, 0xffffff}})
    if (!(row.value >= row.least && row.value <= row.most))
      return Error{fmt::format("setting {} is {}, limits {} and {}", row.name, row.value, row.least, row.most)};
  return std::nullopt;
}

std::optional<Error> check(const Lease& m) {
  if (auto bad = check_tile(m.camera, m.rect, m.tile, kMaxTiles)) return bad;
  if (auto bad = check_pixels(m.rect)) return bad;
  if (auto bad = check_tile(m.camera, m.block_rect, m.block, m.blocks_in_frame)) return bad;
  const geometry::Rect &r = m.rect, &b = m.block_rect;
  if (r.x < b.x || r.y < b.y || r.x + r.width > b.x + b.width || r.y + r.height > b.y + b.height)
    return Error{fmt::format("tile {}x{}+{}+{} is not inside its block {}x{}+{}+{}", r.width, r.height, r.x, r.y,
                             b.width, b.height, b.x, b.y)};
  if (m.rays > uint64_t(m.rect.width) * uint64_t(m.rect.height))
    return Error{fmt::format("{} rays of {}x{} pixels", m.rays, m.rect.width, m.rect.height)};
  if (auto bad = check_footprint(m.footprint)) return bad;
  return check_step(m.step);
}

std::optional<Error> check(const PlanRequest& m) {
  if (m.tile_size >= 32 && m.tile_size <= kMaxTileSide) return std::nullopt;
  return Error{fmt::format("tiles of {} pixels, limits 32 and {}", m.tile_size, kMaxTileSide)};
}

// Each tile lies in the frame and has rays, and its mask is there. All tiles together have no more pixels than the
// frame: a plan costs no more work than the frame.
std::optional<Error> check(const Plan& m) {
  if (m.tiles.size() % kPlanNumbers != 0) return Error{fmt::format("{} numbers of tiles", m.tiles.size())};
  uint64_t words = 0, pixels = 0;
  for (size_t i = 0; i < m.tiles.size(); i += kPlanNumbers) {
    const uint64_t x = m.tiles[i], y = m.tiles[i + 1], width = m.tiles[i + 2], height = m.tiles[i + 3];
    const uint64_t rays = m.tiles[i + 4], mask = m.tiles[i + 5];
    if (width < 1 || height < 1 || x + width > uint64_t(m.camera.width) || y + height > uint64_t(m.camera.height) ||
        width * height > uint64_t(kMaxTilePixels))
      return Error{fmt::format("tile {}x{}+{}+{} is not inside its {}x{} frame", width, height, x, y, m.camera.width,
                               m.camera.height)};
    if (rays < 1 || rays > width * height || mask > kMaxMaskWords || (mask == 0 && rays != width * height))
      return Error{fmt::format("{} rays and {} words of mask in a tile of {}x{} pixels", rays, mask, width, height)};
    words += mask;
    pixels += width * height;
  }
  if (const uint64_t most = uint64_t(m.camera.width) * uint64_t(m.camera.height); pixels > most)
    return Error{fmt::format("its tiles have {} pixels, the frame {}", pixels, most)};
  if (words == m.masks.size()) return std::nullopt;
  return Error{fmt::format("{} words of masks, its tiles have {}", m.masks.size(), words)};
}

std::optional<Error> check(const DepthTile& m) { return check(m.lease); }

std::optional<Error> check(const Patch& m) {
  if (auto bad = check_tile(m.camera, m.rect, m.tile, m.tiles_in_frame)) return bad;
  if (auto bad = check_tile(m.camera, m.missed.rect, m.tile, m.tiles_in_frame)) return bad;
  if (auto bad = check_pixels(m.missed.rect)) return bad;
  return check_step(m.step);
}

std::optional<Error> check(const PictureTile& m) { return check(m.lease); }

std::optional<Error> check(const Picture& m) {
  if (auto bad = check_tile(m.camera, m.rect, m.tile, m.tiles_in_frame)) return bad;
  return check_pixels(m.rect);
}

std::optional<Error> check(const BaseRequest& m) {
  if (m.part < kMaxBaseParts && m.parts <= kMaxBaseParts) return {};
  return Error{fmt::format("{} parts from {} on, limit {}", m.parts, m.part, kMaxBaseParts)};
}

std::optional<Error> check(const BaseBegin& m) {
  if (m.nodes <= geometry::kMaxChunks) return {};
  return Error{fmt::format("{} nodes, limit {}", m.nodes, geometry::kMaxChunks)};
}

std::optional<Error> check(const BasePart& m) {
  if (m.part < kMaxBaseParts) return {};
  return Error{fmt::format("part {}, limit {}", m.part, kMaxBaseParts)};
}

std::optional<Error> check(const BaseTree& m) {
  for (const auto& node : m.nodes)
    if (node.triangles == 0 && !node.is_leaf()) return Error{fmt::format("node {} has no triangles", node.id.value)};
  const uint64_t parts = first_base_parts(m.nodes).back();
  if (parts <= kMaxBaseParts) return {};
  return Error{fmt::format("{} parts, limit {}", parts, kMaxBaseParts)};
}

std::optional<Error> check(const BaseHidden& m) {
  if (m.words.size() % 3 == 0) return {};
  return Error{fmt::format("{} numbers are not a multiple of three", m.words.size())};
}

std::optional<Error> check(const Forget& m) { return check_frames(m.clusters, m.frames); }

std::optional<Error> check(const AccessReport& m) { return check_frames(m.clusters, m.frames); }

std::optional<Error> check(const ViewRequest& m) {
  if (auto bad = check_footprint(m.footprint)) return bad;
  if (m.wall_viewers > kMaxWallViewers)
    return Error{fmt::format("a wall of {} viewers, limit {}", m.wall_viewers, kMaxWallViewers)};
  return check_buffers(m.buffers);
}

std::optional<Error> check(const SliceAck& m) {
  if (m.buffers < 1) return Error{"0 buffers, at least 1"};
  return check_buffers(m.buffers);
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

std::optional<Error> check(const SwapReady& m) {
  if (m.viewers < 1 || m.viewers > kMaxWallViewers || m.number >= m.viewers)
    return Error{fmt::format("viewer {} of a wall of {}, limit {}", m.number, m.viewers, kMaxWallViewers)};
  for (const uint64_t frame : {m.frame, m.presented})
    if (frame > kMaxWallFrame) return Error{fmt::format("frame {} of a wall, limit {}", frame, kMaxWallFrame)};
  if (m.period_s < 0 || m.late_s < 0)
    return Error{fmt::format("period {} s and {} s late, at least 0", m.period_s, m.late_s)};
  return std::nullopt;
}

/// Functions and limits that write and read one message.
struct Codec {
  std::string_view name;
  size_t body_limit, element_limit;
  void (*write)(Encoder&, const void*);
  std::optional<Error> (*read)(Decoder&, void*);
};

template <class M>
void write(Encoder& encoder, const void* message) {
  encoder.versioned_map(*static_cast<const M*>(message));
}

template <class M>
std::optional<Error> read(Decoder& decoder, void* message) {
  M& m = *static_cast<M*>(message);
  if (kIsBrief<M>) decoder.be_brief();
  M::fields(decoder, m);
  return decoder.error() ? decoder.error() : check(m);
}

template <class... M>
constexpr std::array<Codec, sizeof...(M)> codecs(std::type_identity<std::tuple<M...>>) {
  return {{{M::kName, kBodyLimit<M>, element_limit<M>(), write<M>, read<M>}...}};
}
constexpr auto kCodecs = codecs(std::type_identity<Messages>{});

std::string encode_as(uint64_t version, const auto& message) {
  std::string body;
  Encoder(body).versioned_map(message, version);
  return body;
}

}  // namespace

std::string detail::encode(size_t number, const void* message) {
  std::string body;
  Encoder encoder(body);
  kCodecs[number].write(encoder, message);
  return body;
}

std::optional<Error> detail::decode(size_t number, Bytes body, void* message) {
  const Codec& codec = kCodecs[number];
  const auto refused = [&](std::string_view why) { return Error{fmt::format("{}: {}", codec.name, why)}; };
  if (body.size() > codec.body_limit) return refused(fmt::format("{} bytes, limit {}", body.size(), codec.body_limit));
  const auto bad = read_map(body, codec.element_limit, [&](Decoder& decoder) { return codec.read(decoder, message); });
  return bad ? std::optional(refused(bad->text)) : std::nullopt;
}

std::optional<uint64_t> other_version(Bytes body) {
  const auto version = version_of(body);
  return version == kProtocolVersion ? std::nullopt : version;
}

std::string about_versions(uint64_t other) {
  return fmt::format("it speaks version {} of the protocol, and this master version {}", other, kProtocolVersion);
}

std::string encode_for(uint64_t version, const Shutdown& message) { return encode_as(version, message); }
std::string encode_for(uint64_t version, const ControlReply& message) { return encode_as(version, message); }

}  // namespace telesplat::wire
