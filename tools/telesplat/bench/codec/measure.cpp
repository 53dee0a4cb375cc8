#include "tools/telesplat/bench/codec/measure.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/codec/depth_codec.h"
#include "common/codec/room_axes.h"
#include "common/geometry/ray_axes.h"

namespace telesplat::launcher {
namespace {

constexpr size_t kMostTimed = 32;  // tiles; they and their streams are far more than caches hold
constexpr size_t kFewFull = 4;     // of fewer the caches would hold all
constexpr int kTile = 256;

size_t covered_pixels(const image::DepthImage& image) {
  return image.pixels() - size_t(std::count(image.depth.begin(), image.depth.end(), 0u));
}

Status add_stream(std::span<const uint8_t> stream, StreamBits& to) {
  const auto info = codec::inspect(stream);
  if (!info) return info.error();
  const size_t parts =
      info->depth_bytes + info->normal_bytes + info->colour_bytes + info->mask_bytes + info->sparse_bytes;
  to.depth += 8 * info->depth_bytes;
  to.normal += 8 * info->normal_bytes;
  to.colour += 8 * info->colour_bytes;
  to.mask += 8 * info->mask_bytes;
  to.sparse += 8 * info->sparse_bytes;
  to.header += 8 * (stream.size() - std::min(parts, stream.size()));
  return ok_status();
}

// Which of two sets of errors is the worse to look at.
double severity(const CodecErrors& e) {
  return double(e.uncovered) * 1e6 + e.depth_px.largest + e.normal_codes.largest + e.colour_codes.largest;
}

// As samplers and packers do it, who know where a tile looks.
std::vector<uint8_t> encoded(const DepthFrame& tile, const codec::ErrorBounds& bounds = {},
                             image::DepthImage* decoded = nullptr) {
  const auto& [image, focal_px, camera] = tile;
  if (!camera) return codec::encode(image, bounds, decoded);
  return codec::encode(image, bounds, decoded, geometry::ray_axes(*camera, {0, 0, image.width, image.height}));
}

image::DepthImage through_codec(const DepthFrame& frame, const codec::ErrorBounds& bounds) {
  image::DepthImage out;
  return codec::decode_into(out, encoded(frame, bounds)) ? out
                                                         : image::DepthImage(frame.image.width, frame.image.height);
}

}  // namespace

Status CodecMeasure::add(const DepthFrame& frame) {
  if (report_.frames == 0) {
    worst_.reset(), worst_error_ = -1;
    report_.wish = options_.wish;
    for (const Baseline* coder : options_.coders) report_.baselines.push_back({coder, {}, coder->missing()});
  }
  ++report_.frames;
  report_.pixels += frame.image.pixels();
  CodecErrors errors;
  for (const DepthFrame& tile : tiles_of(frame))
    if (const Status s = add_tile(tile, errors); !s) return s;
  if (options_.error_maps && severity(errors) > worst_error_) {
    worst_error_ = severity(errors);
    worst_ = error_maps(frame.image, through_codec(frame, options_.wish.bounds(frame.focal_px)), frame.focal_px);
  }
  report_.errors.merge(errors);
  return ok_status();
}

Status CodecMeasure::add_tile(const DepthFrame& frame, CodecErrors& errors) {
  const image::DepthImage& tile = frame.image;
  const auto stream = encoded(frame);
  if (const Status s = add_stream(stream, report_.bits); !s) return s;
  image::DepthImage decoded;
  if (const Status s = codec::decode_into(decoded, stream); !s)
    return Error{fmt::format("what was encoded is not decoded: {}", s.error().text)};
  if (decoded.width != tile.width || decoded.height != tile.height)
    return Error{fmt::format("a tile of {} x {} pixels came back as {} x {}", tile.width, tile.height, decoded.width,
                             decoded.height)};
  const codec::ErrorBounds bounds = options_.wish.bounds(frame.focal_px);
  if (bounds.exact())
    add_errors(tile, decoded, frame.focal_px, errors);
  else if (const Status s = add_bounded(frame, bounds, errors); !s)
    return s;
  for (BaselineReport& b : report_.baselines) {
    if (!b.missing.empty()) continue;
    const auto bits = b.coder->bits(tile);
    if (!bits) {
      b.missing = bits.error().text;
      continue;
    }
    b.bits.depth += bits->depth, b.bits.colour += bits->colour, b.bits.normal += bits->normal;
  }
  const size_t covered = covered_pixels(tile);
  ++report_.tiles;
  report_.covered += covered;
  if (tile.width == kTile && tile.height == kTile) keep_to_time(frame, covered, bounds);
  return ok_status();
}

Status CodecMeasure::add_bounded(const DepthFrame& frame, const codec::ErrorBounds& bounds, CodecErrors& errors) {
  const image::DepthImage& tile = frame.image;
  image::DepthImage bounded;
  const auto stream = encoded(frame, bounds);
  if (const Status s = add_stream(stream, report_.bounded); !s) return s;
  if (const Status s = codec::decode_into(bounded, stream); !s)
    return Error{fmt::format("what was encoded within bounds is not decoded: {}", s.error().text)};
  add_errors(tile, bounded, frame.focal_px, errors);
  const auto refinement = codec::encode_refinement(tile, bounded);
  report_.refinement += 8 * refinement.size();
  const auto exact = codec::decode_refinement(refinement, bounded);
  if (!exact) return Error{fmt::format("what refines is not decoded: {}", exact.error().text)};
  if (*exact != tile) return Error{"a refined tile is not exact"};
  return ok_status();
}

// The fullest ones, of those that are as full those that came first.
void CodecMeasure::keep_to_time(const DepthFrame& tile, size_t covered, const codec::ErrorBounds& bounds) {
  report_.full_tiles += covered == tile.image.pixels();
  if (2 * covered < tile.image.pixels() || options_.seconds <= 0) return;
  const auto fuller = [](size_t c, const Timed& t) { return c > t.covered; };
  timed_.insert(std::upper_bound(timed_.begin(), timed_.end(), covered, fuller), {covered, tile, bounds});
  if (timed_.size() > kMostTimed) timed_.pop_back();
}

void CodecMeasure::measure_speeds_of_kept() {
  if (timed_.empty()) return;
  if (report_.full_tiles >= kFewFull)
    std::erase_if(timed_, [](const Timed& t) { return t.covered != t.frame.image.pixels(); });
  size_t covered = 0, pixels = 0, kept = 0;  // kept: so that nothing is left out
  std::vector<std::vector<uint8_t>> streams;
  for (const Timed& t : timed_) {
    streams.push_back(encoded(t.frame));
    covered += t.covered, pixels += t.frame.image.pixels();
  }
  report_.timed_tiles = timed_.size();
  report_.timed_covered = double(covered) / double(pixels);
  image::DepthImage decoded;
  report_.speeds = measure_speeds(
      covered, options_.seconds,
      [&] {
        for (const Timed& t : timed_) kept += encoded(t.frame).size();
      },
      [&] {
        for (const auto& stream : streams) kept += size_t(codec::decode_into(decoded, stream).ok());
      });
  if (!options_.wish.exact()) measure_bounded_speeds(covered);
  timed_.clear();
}

void CodecMeasure::measure_bounded_speeds(size_t covered) {
  std::vector<std::vector<uint8_t>> streams, refinements;
  std::vector<image::DepthImage> bounded(timed_.size());
  size_t kept = 0;
  for (size_t i = 0; i < timed_.size(); ++i) {
    streams.push_back(encoded(timed_[i].frame, timed_[i].bounds, &bounded[i]));
    refinements.push_back(codec::encode_refinement(timed_[i].frame.image, bounded[i]));
  }
  image::DepthImage decoded;
  report_.bounded_speeds = measure_speeds(
      covered, options_.seconds,
      [&] {
        for (const Timed& t : timed_) kept += encoded(t.frame, t.bounds).size();
      },
      [&] {
        for (const auto& stream : streams) kept += size_t(codec::decode_into(decoded, stream).ok());
      });
  report_.refinement_speeds = measure_speeds(
      covered, options_.seconds,
      [&] {
        for (size_t i = 0; i < timed_.size(); ++i)
          kept += codec::encode_refinement(timed_[i].frame.image, bounded[i]).size();
      },
      [&] {
        for (size_t i = 0; i < timed_.size(); ++i)
          kept += size_t(codec::decode_refinement(refinements[i], bounded[i]).ok());
      });
}

CodecReport CodecMeasure::finish(std::string name) {
  report_.name = std::move(name);
  measure_speeds_of_kept();
  return std::exchange(report_, {});
}

}  // namespace telesplat::launcher
