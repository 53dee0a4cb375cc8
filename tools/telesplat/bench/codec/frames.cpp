#include "tools/telesplat/bench/codec/frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "client/viewer/viewer_service.h"
#include "common/codec/depth_codec.h"
#include "common/core/whole_file.h"
#include "common/net/service.h"
#include "tools/telesplat/bench/walk.h"
#include "tools/telesplat/record/depth_camera.h"
#include "tools/telesplat/scene/scene.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

constexpr int kTile = 256;               // as the master cuts frames
constexpr ptrdiff_t kLeastCovered = 64;  // pixels of a tile: others are nearly all header
constexpr uint64_t kMostFileBytes = 256u << 20;

// "colorado-01.depth" -> "colorado"; "runs/walk/depth/frame-000001.depth" -> "walk".
std::string set_name(const fs::path& path) {
  std::string stem = path.stem().string();
  const size_t digits = stem.find_last_not_of("0123456789");
  if (digits != stem.npos && digits > 0 && digits + 1 < stem.size() && stem[digits] == '-') stem.resize(digits);
  if (stem != "frame") return stem;
  std::error_code error;
  fs::path folder = fs::absolute(path, error).parent_path();
  if (folder.filename() == "depth") folder = folder.parent_path();
  return folder.filename().string();
}

std::vector<std::string> depth_files(const std::string& folder) {
  std::vector<std::string> out;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (entry.path().extension() == ".depth") out.push_back(entry.path().string());
  std::sort(out.begin(), out.end());
  return out;
}

void add_file(const std::string& file, std::vector<FrameSet>& sets) {
  const std::string name = set_name(file);
  const auto known = std::find_if(sets.begin(), sets.end(), [&](const FrameSet& s) { return s.name == name; });
  if (known != sets.end()) {
    known->files.push_back(file);
  } else {
    sets.push_back({name, {file}});
  }
}

}  // namespace

Result<CodecSubject> codec_subject(const std::string& argument) {
  CodecSubject out;
  std::error_code error;
  if (argument.ends_with(".depth")) {
    add_file(argument, out.sets);
    return out;
  }
  if (!fs::is_directory(argument, error)) {
    out.scene = argument;
    return out;
  }
  auto files = depth_files(argument);
  if (files.empty()) files = depth_files(argument + "/depth");
  for (const std::string& file : files) add_file(file, out.sets);
  if (!out.sets.empty()) return out;
  // A run's folder without depth images; what else is a folder may be a volume's slices.
  if (fs::exists(argument + "/session.toml", error))
    return Error{fmt::format("{}: holds no depth images; telesplat run --record-depth keeps some", argument)};
  out.scene = argument;
  return out;
}

std::vector<FrameSet> joined_sets(const std::vector<CodecSubject>& subjects) {
  std::vector<FrameSet> out;
  for (const CodecSubject& subject : subjects)
    for (const FrameSet& set : subject.sets) {
      const auto known = std::find_if(out.begin(), out.end(), [&](const FrameSet& s) { return s.name == set.name; });
      if (known == out.end())
        out.push_back(set);
      else
        known->files.insert(known->files.end(), set.files.begin(), set.files.end());
    }
  return out;
}

Result<DepthFrame> read_frame(const std::string& path, double fov_deg) {
  const auto bytes = read_whole(path, kMostFileBytes);
  if (!bytes) return bytes.error();
  auto image = codec::decode({reinterpret_cast<const uint8_t*>(bytes->data()), bytes->size()});
  if (!image) return Error{fmt::format("{}: {}", path, image.error().text)};
  const auto camera = recorded_camera(path);
  if (!camera) return camera.error();
  DepthFrame out{std::move(*image), 0, *camera};
  out.focal_px = *camera ? (*camera)->focal_x() : out.image.width / 2.0 / std::tan(fov_deg * std::numbers::pi / 360);
  return out;
}

Result<std::vector<DepthFrame>> sample_frames(const data::DataOptions& data, const ViewOptions& options,
                                              const ShowProgress& progress) {
  const auto size = viewer::parse_size(options.size, "--size");
  if (!size) return size.error();
  const auto walk = Walk::open(options.trajectory);
  if (!walk) return walk.error();
  const auto scene = scene_of(data);
  if (!scene) return scene.error();
  const auto direct = (*scene)->open_direct(options.threads, [&](const char* stage, double fraction) {
    progress(fmt::format("{}: {} {:.0f} %", data.scene, stage, 100 * fraction));
  });
  if (!direct) return direct.error();
  std::vector<DepthFrame> out;
  for (int i = 0; i < options.views; ++i) {
    if (net::stop_requested()) return Error{"told to stop"};
    progress(fmt::format("{}: sampling view {} of {}", data.scene, i + 1, options.views));
    const auto pose = walk->at(walk->length_s() * (i + 0.5) / options.views);
    const auto camera = geometry::make_camera(pose, options.fov_deg, size->first, size->second);
    auto image = (*direct)->sample(camera, EpochId{1});
    if (!image) return image.error();
    out.push_back({std::move(*image), camera.focal_x(), camera});
  }
  return out;
}

std::vector<DepthFrame> tiles_of(const DepthFrame& frame) {
  const image::DepthImage& image = frame.image;
  std::vector<DepthFrame> out;
  for (int y = 0; y < image.height; y += kTile)
    for (int x = 0; x < image.width; x += kTile) {
      const geometry::Rect rect{x, y, std::min(kTile, image.width - x), std::min(kTile, image.height - y)};
      auto tile = cut(image, rect);
      const auto empty = std::count(tile.depth.begin(), tile.depth.end(), 0u);
      if (ptrdiff_t(tile.pixels()) - empty < kLeastCovered) continue;
      out.push_back({std::move(tile), frame.focal_px});
      if (frame.camera) out.back().camera = geometry::crop(*frame.camera, rect);
    }
  return out;
}

}  // namespace telesplat::launcher
