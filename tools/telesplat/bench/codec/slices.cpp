#include "tools/telesplat/bench/codec/slices.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "client/viewer/viewer_service.h"
#include "common/net/service.h"
#include "common/volume/shear.h"
#include "common/volume/slices/image.h"
#include "services/data/volume/store.h"
#include "services/sampler/volume/shear/splatter.h"
#include "tools/telesplat/bench/codec/zstd_size.h"
#include "tools/telesplat/bench/walk.h"

namespace telesplat::launcher {
namespace {

constexpr size_t kMostTimed = 64;  // images

struct Slice {
  volume::SliceImage image;
  int width = 0, height = 0, layers = 0;  // of the raster
};

// The volume as one sampler holds it.
class SampledVolume {
 public:
  static Result<std::unique_ptr<SampledVolume>> open(const data::DataOptions& data, int threads,
                                                     const ShowProgress& progress) {
    const auto store =
        data::VolumeStore::open(data.scene, data.volume, data.mesh, [&](const char* stage, double fraction) {
          progress(fmt::format("{}: {} {:.0f} %", data.scene, stage, 100 * fraction));
        });
    if (!store) return store.error();
    const volume::Session& session = (*store)->session();
    auto voxels = (*store)->voxels(0, 0, session.grid.size[2], data::shown_levels(session.transfer, session.levels),
                                   volume::LevelSet());
    if (!voxels) return voxels.error();
    return std::make_unique<SampledVolume>(session, std::move(*voxels), threads);
  }
  SampledVolume(const volume::Session& session, volume::Voxels voxels, int threads)
      : grid_(session.grid),
        slab_(session.grid, std::move(voxels)),
        colours_(volume::level_colours(session.transfer, session.levels)),
        splatter_(threads) {}

  std::vector<Slice> sample(const geometry::Camera& camera) {
    std::vector<Slice> out;
    const auto frame = volume::plan_frame(grid_, {&camera, 1});
    if (!frame) return out;
    for (auto& image : splatter_.splat(slab_, colours_, *frame, 0, grid_.size[2]))
      out.push_back({std::move(image), frame->width, frame->height, int(frame->layers.size())});
    return out;
  }

 private:
  volume::Grid grid_;
  sampler::SlabVolume slab_;
  std::vector<volume::LevelColour> colours_;
  sampler::ShearSplatter splatter_;
};

size_t covered_pixels(const volume::SliceImage& image) {
  return image.pixels.size() - size_t(std::count(image.pixels.begin(), image.pixels.end(), 0u));
}

uint32_t pixel_at(const volume::SliceImage& image, int x, int y) {
  const auto& r = image.rect;
  if (x < r.x || y < r.y || x >= r.x + r.width || y >= r.y + r.height) return 0;
  return image.pixels[size_t(y - r.y) * size_t(r.width) + size_t(x - r.x)];
}

// Pixels that differ; the decoded image has whole blocks.
size_t differing(const volume::SliceImage& a, const volume::SliceImage& b) {
  size_t out = 0;
  for (int y = a.rect.y; y < a.rect.y + a.rect.height; ++y)
    for (int x = a.rect.x; x < a.rect.x + a.rect.width; ++x) out += pixel_at(a, x, y) != pixel_at(b, x, y);
  return out + (covered_pixels(a) == covered_pixels(b) ? 0 : 1);
}

size_t zstd_bits(const volume::SliceImage& image) {
  constexpr int kSide = volume::kSliceBlock;
  std::vector<uint32_t> block(size_t{kSide} * kSide);
  const auto& r = image.rect;
  size_t bytes = 0;
  for (int y = r.y / kSide * kSide; y < r.y + r.height; y += kSide)
    for (int x = r.x / kSide * kSide; x < r.x + r.width; x += kSide) {
      for (int i = 0; i < kSide * kSide; ++i) block[size_t(i)] = pixel_at(image, x + i % kSide, y + i / kSide);
      if (std::any_of(block.begin(), block.end(), [](uint32_t p) { return p != 0; }))
        bytes += zstd_size(std::as_bytes(std::span(block)));
    }
  return 8 * bytes;
}

Status decode(volume::SliceImage& to, const std::vector<uint8_t>& bytes, const Slice& slice) {
  const auto parsed = volume::parse_slices(bytes, slice.width, slice.height, slice.layers);
  if (!parsed) return parsed.error();
  if (parsed->size() != 1) return Error{fmt::format("{} slice images in place of one", parsed->size())};
  return volume::decode_slice_into(to, parsed->front(), slice.width, slice.height);
}

Status add(const Slice& slice, SliceReport& to) {
  const auto bytes = volume::encode_slice(slice.image);
  volume::SliceImage decoded;
  if (const Status s = decode(decoded, bytes, slice); !s)
    return Error{fmt::format("what was encoded is not decoded: {}", s.error().text)};
  ++to.images;
  to.pixels += slice.image.pixels.size();
  to.covered += covered_pixels(slice.image);
  to.bits += 8 * bytes.size();
  to.zstd_bits += zstd_bits(slice.image);
  to.wrong += differing(slice.image, decoded);
  return ok_status();
}

std::vector<TargetSpeed> speeds_of(const std::vector<Slice>& slices, double seconds) {
  std::vector<std::vector<uint8_t>> streams;
  size_t covered = 0, kept = 0;
  for (const Slice& s : slices) {
    streams.push_back(volume::encode_slice(s.image));
    covered += covered_pixels(s.image);
  }
  volume::SliceImage decoded;
  return measure_speeds(
      covered, seconds,
      [&] {
        for (const Slice& s : slices) kept += volume::encode_slice(s.image).size();
      },
      [&] {
        for (size_t i = 0; i < slices.size(); ++i) kept += size_t(decode(decoded, streams[i], slices[i]).ok());
      });
}

}  // namespace

Result<SliceReport> measure_slices(const data::DataOptions& data, const ViewOptions& views, double seconds,
                                   const ShowProgress& progress) {
  const auto size = viewer::parse_size(views.size, "--size");
  if (!size) return size.error();
  const auto walk = Walk::open(views.trajectory);
  if (!walk) return walk.error();
  auto volume = SampledVolume::open(data, views.threads, progress);
  if (!volume) return volume.error();
  SliceReport out;
  out.name = std::filesystem::path(data.scene).filename().string();
  std::vector<Slice> timed;
  for (int i = 0; i < views.views; ++i) {
    if (net::stop_requested()) return Error{"told to stop"};
    progress(fmt::format("{}: sampling view {} of {}", data.scene, i + 1, views.views));
    const auto pose = walk->at(walk->length_s() * (i + 0.5) / views.views);
    ++out.views;
    for (Slice& slice : (*volume)->sample(geometry::make_camera(pose, views.fov_deg, size->first, size->second))) {
      if (const Status s = add(slice, out); !s) return Error{fmt::format("{}: {}", data.scene, s.error().text)};
      if (timed.size() < kMostTimed) timed.push_back(std::move(slice));
    }
  }
  progress(fmt::format("{}: measuring speeds", data.scene));
  if (!timed.empty() && seconds > 0) out.speeds = speeds_of(timed, seconds);
  return out;
}

}  // namespace telesplat::launcher
