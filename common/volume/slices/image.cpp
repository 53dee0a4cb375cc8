#include "common/volume/slices/image.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "common/volume/grid.h"
#include "common/volume/shear.h"
#include "common/volume/slices/block.h"

namespace telesplat::volume {
namespace {

static_assert(kBlockSide == kSliceBlock);
static_assert(kMaxRasterSide / kSliceBlock <= 256);
constexpr size_t kSliceHead = 10, kBlockHead = 4;

void put_u16(std::vector<uint8_t>& out, size_t value) {
  out.push_back(uint8_t(value));
  out.push_back(uint8_t(value >> 8));
}
size_t get_u16(std::span<const uint8_t> bytes, size_t at) { return bytes[at] | size_t{bytes[at + 1]} << 8; }

void put_head(std::vector<uint8_t>& out, const EncodedSlice& slice, size_t blocks) {
  for (const size_t v : {size_t(slice.layer), size_t(slice.k_begin), size_t(slice.k_end), blocks, slice.tables.size()})
    put_u16(out, v);
  out.insert(out.end(), slice.tables.begin(), slice.tables.end());
}

int blocks_across(int pixels) { return (pixels + kSliceBlock - 1) / kSliceBlock; }

// Copies the part of an image that lies in a block; other pixels become transparent. False: all are transparent.
bool cut_out(const SliceImage& image, int block_x, int block_y, uint32_t* block) {
  const auto& r = image.rect;
  const int x0 = block_x * kSliceBlock, y0 = block_y * kSliceBlock;
  const int from_x = std::max(x0, r.x), to_x = std::min(x0 + kSliceBlock, r.x + r.width);
  const int from_y = std::max(y0, r.y), to_y = std::min(y0 + kSliceBlock, r.y + r.height);
  const auto row_of = [&](int y) { return &image.pixels[size_t(y - r.y) * size_t(r.width) + size_t(from_x - r.x)]; };
  uint32_t any = 0;
  for (int y = from_y; y < to_y; ++y) {
    const uint32_t* row = row_of(y);
    for (int x = 0; x < to_x - from_x; ++x) any |= row[x];
  }
  if (any == 0) return false;
  if (to_x - from_x < kSliceBlock || to_y - from_y < kSliceBlock) std::fill_n(block, kBlockPixels, 0u);
  for (int y = from_y; y < to_y; ++y)
    std::copy_n(row_of(y), to_x - from_x, block + size_t(y - y0) * kSliceBlock + size_t(from_x - x0));
  return true;
}

}  // namespace

geometry::Rect bounds(const EncodedSlice& slice, int raster_width, int raster_height) {
  int x0 = raster_width, x1 = 0;
  for (const auto& b : slice.blocks) {
    x0 = std::min(x0, b.x * kSliceBlock);
    x1 = std::max(x1, std::min((b.x + 1) * kSliceBlock, raster_width));
  }
  const int y0 = slice.blocks.front().y * kSliceBlock;
  return {x0, y0, x1 - x0, std::min((slice.blocks.back().y + 1) * kSliceBlock, raster_height) - y0};
}

std::vector<uint8_t> encode_slice(const SliceImage& image) {
  std::vector<uint8_t> out;
  const auto& r = image.rect;
  struct Place {
    int x, y;
  };
  std::vector<Place> places;
  static thread_local BlockCoder coder;
  coder.start();
  uint32_t block[kBlockPixels];
  for (int y = r.y / kSliceBlock; y < blocks_across(r.y + r.height); ++y)
    for (int x = r.x / kSliceBlock; x < blocks_across(r.x + r.width); ++x) {
      if (!cut_out(image, x, y, block)) continue;
      places.push_back({x, y});
      coder.add(block);
    }
  if (places.empty()) return out;
  std::vector<uint8_t> tables, blocks;
  coder.put_tables(tables);
  put_head(out, {image.layer, image.k_begin, image.k_end, tables, {}}, places.size());
  for (size_t n = 0, begin = 0; n < places.size(); ++n, begin = blocks.size()) {
    coder.put(n, blocks);
    out.push_back(uint8_t(places[n].x)), out.push_back(uint8_t(places[n].y));
    put_u16(out, blocks.size() - begin);
  }
  out.insert(out.end(), blocks.begin(), blocks.end());
  return out;
}

Result<std::vector<EncodedSlice>> parse_slices(std::span<const uint8_t> bytes, int raster_width, int raster_height,
                                               int layers) {
  std::vector<EncodedSlice> out;
  const int across = blocks_across(raster_width), down = blocks_across(raster_height);
  while (!bytes.empty()) {
    if (out.size() == kMaxSlices) return Error{fmt::format("more than {} slices", kMaxSlices)};
    if (bytes.size() < kSliceHead) return Error{fmt::format("slice {} ends in its head", out.size())};
    EncodedSlice slice{int(get_u16(bytes, 0)), int(get_u16(bytes, 2)), int(get_u16(bytes, 4)), {}, {}};
    const size_t count = get_u16(bytes, 6), table_bytes = get_u16(bytes, 8);
    bytes = bytes.subspan(kSliceHead);
    if (bytes.size() < table_bytes)
      return Error{fmt::format("slice {}: {} bytes left for {} of tables", out.size(), bytes.size(), table_bytes)};
    slice.tables = bytes.first(table_bytes);
    bytes = bytes.subspan(table_bytes);
    if (slice.layer >= layers) return Error{fmt::format("a slice of layer {} of {}", slice.layer, layers)};
    if (slice.k_begin >= slice.k_end || slice.k_end > kMaxSide)
      return Error{fmt::format("a slice of the slab {} to {}, limit {}", slice.k_begin, slice.k_end, kMaxSide)};
    if (count == 0) return Error{"a slice without blocks"};
    if (bytes.size() < count * kBlockHead)
      return Error{fmt::format("slice {}: {} bytes left for {} blocks", out.size(), bytes.size(), count)};
    auto heads = bytes.first(count * kBlockHead);
    bytes = bytes.subspan(heads.size());
    slice.blocks.reserve(count);
    for (; !heads.empty(); heads = heads.subspan(kBlockHead)) {
      const EncodedBlock* last = slice.blocks.empty() ? nullptr : &slice.blocks.back();
      const int x = heads[0], y = heads[1];
      const size_t size = get_u16(heads, 2);
      if (x >= across || y >= down)
        return Error{fmt::format("a block at {}, {} in a raster of {} x {} pixels", x, y, raster_width, raster_height)};
      if (last && (y < last->y || (y == last->y && x <= last->x)))
        return Error{fmt::format("a block at {}, {} after one at {}, {}", x, y, last->x, last->y)};
      if (size > bytes.size()) return Error{fmt::format("a block of {} bytes, {} are left", size, bytes.size())};
      slice.blocks.push_back({x, y, bytes.first(size)});
      bytes = bytes.subspan(size);
    }
    out.push_back(std::move(slice));
  }
  return out;
}

std::vector<uint8_t> join_slices(std::span<const EncodedSlice> slices) {
  size_t size = 0;
  for (const auto& s : slices) {
    size += kSliceHead + s.tables.size();
    for (const auto& b : s.blocks) size += kBlockHead + b.bytes.size();
  }
  std::vector<uint8_t> out;
  out.reserve(size);
  for (const auto& s : slices) {
    if (s.blocks.empty()) continue;
    put_head(out, s, s.blocks.size());
    for (const auto& b : s.blocks) {
      out.push_back(uint8_t(b.x)), out.push_back(uint8_t(b.y));
      put_u16(out, b.bytes.size());
    }
    for (const auto& b : s.blocks) out.insert(out.end(), b.bytes.begin(), b.bytes.end());
  }
  return out;
}

Status decode_slice_into(SliceImage& image, const EncodedSlice& slice, int raster_width, int raster_height) {
  image.layer = slice.layer;
  image.k_begin = slice.k_begin, image.k_end = slice.k_end;
  image.rect = bounds(slice, raster_width, raster_height);
  const auto& r = image.rect;
  image.pixels.assign(size_t(r.width) * size_t(r.height), 0);
  uint32_t block[kBlockPixels];
  static thread_local BlockDecoder decoder;
  if (const Status s = decoder.set_tables(slice.tables); !s)
    return Error{fmt::format("layer {}: {}", slice.layer, s.error().text)};
  for (const auto& b : slice.blocks) {
    if (const Status s = decoder.decode(b.bytes, block); !s)
      return Error{fmt::format("layer {}, block {}, {}: {}", slice.layer, b.x, b.y, s.error().text)};
    const int x0 = b.x * kSliceBlock, y0 = b.y * kSliceBlock;
    const int width = std::min(kSliceBlock, raster_width - x0), height = std::min(kSliceBlock, raster_height - y0);
    for (int y = 0; y < height; ++y)
      std::memcpy(&image.pixels[size_t(y0 + y - r.y) * size_t(r.width) + size_t(x0 - r.x)],
                  block + size_t(y) * kSliceBlock, size_t(width) * 4);
  }
  return ok_status();
}

}  // namespace telesplat::volume
