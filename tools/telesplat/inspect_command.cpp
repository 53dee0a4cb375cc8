#include "tools/telesplat/inspect_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "client/viewer/record/frame_spool.h"
#include "common/codec/depth_codec.h"
#include "services/data/inspect.h"
#include "tools/telesplat/scene/recorded_julia.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

constexpr uintmax_t kMaxDepthImageBytes = 256u << 20;

int refuse(const std::string& why) {
  std::fprintf(stderr, "telesplat: %s\n", why.c_str());
  return 2;
}

int inspect_julia(const std::string& directory) {
  const auto julia = read_recorded_julia(directory);
  if (!julia) return refuse(julia.error().text);
  std::printf("%s, %s\n", julia->title.c_str(),
              julia->animate.empty() ? "not animated when it began" : ("animated: " + julia->animate).c_str());
  for (const auto& info : julia::parameter_infos())
    std::printf("  %-14s %-12g %.*s\n", std::string(info.name).c_str(), julia::get(julia->begin, info.name),
                int(info.text.size()), info.text.data());
  if (!julia->epochs.empty()) std::printf("  %zu epochs (epochs.csv)\n", julia->epochs.size());
  return 0;
}

int inspect_run(const std::string& directory) {
  std::ifstream in(directory + "/summary.json");
  const auto summary = nlohmann::ordered_json::parse(in, nullptr, false);
  if (!summary.is_object())
    return refuse(
        fmt::format("{}: is a folder without a readable summary.json, so it is not a finished run", directory));
  std::printf("%s: a run\n%s\n", directory.c_str(), summary.dump(2).c_str());
  if (summary.value("kind", std::string()) == julia::kSceneWord)
    if (const int code = inspect_julia(directory)) return code;
  std::error_code error;
  for (const auto& entry : fs::recursive_directory_iterator(directory, error))
    if (entry.is_regular_file(error))
      std::printf("  %-40s %12ju bytes\n", fs::relative(entry.path(), directory, error).c_str(),
                  entry.file_size(error));
  return 0;
}

int inspect_view(const std::string& path, const image::View& view, const char* what) {
  std::printf("%s: %s, %dx%d pixels\n", path.c_str(), what, view.width, view.height);
  if (view.depth_m.empty()) return 0;
  float nearest = std::numeric_limits<float>::infinity(), farthest = 0;
  size_t covered = 0;
  for (float d : view.depth_m)
    if (std::isfinite(d)) nearest = std::min(nearest, d), farthest = std::max(farthest, d), ++covered;
  std::printf("  covered %.1f %% of the pixels, depth %.4f to %.4f m\n",
              100.0 * double(covered) / double(view.depth_m.size()), covered ? nearest : 0.0f, farthest);
  return 0;
}

int inspect_depth_image(const std::string& path, const std::vector<uint8_t>& bytes) {
  const auto info = codec::inspect(bytes);
  if (!info) return refuse(fmt::format("{}: {}", path, info.error().text));
  const auto image = codec::decode(bytes);
  if (!image) return refuse(fmt::format("{}: {}", path, image.error().text));
  uint32_t lowest = image::kMaxDepthCode, highest = 0;
  for (uint32_t d : image->depth)
    if (d) lowest = std::min(lowest, d), highest = std::max(highest, d);
  std::printf("%s: a depth image, %dx%d pixels, %zu covered, %zu bytes (%.2f a covered pixel)\n", path.c_str(),
              info->width, info->height, info->covered_pixels, bytes.size(),
              info->covered_pixels ? double(bytes.size()) / double(info->covered_pixels) : 0.0);
  std::printf("  mask %zu, depth %zu, colour %zu, normals %zu bytes\n", info->mask_bytes, info->depth_bytes,
              info->colour_bytes, info->normal_bytes);
  if (info->covered_pixels)
    std::printf("  reciprocal depth codes %u to %u of %u\n", lowest, highest, image::kMaxDepthCode);
  return 0;
}

int inspect_mesh(const std::string& path, const data::MeshOptions& options) {
  const auto facts = data::inspect_mesh(path, options, [](const char*, double) {});
  if (!facts) return refuse(facts.error().text);
  std::fputs(data::describe(*facts).c_str(), stdout);
  return 0;
}

int inspect_volume(const std::string& path, const std::string& raw) {
  const auto facts = data::inspect_volume(path, raw, nullptr);
  if (!facts) return refuse(facts.error().text);
  std::fputs(data::describe(*facts).c_str(), stdout);
  return 0;
}

}  // namespace

int inspect(const std::string& path, const data::MeshOptions& options, const std::string& raw) {
  std::error_code error;
  if (!fs::exists(path, error)) return refuse(fmt::format("{}: no such file", path));
  if (!raw.empty() || (!fs::exists(path + "/summary.json", error) && data::looks_like_volume(path)))
    return inspect_volume(path, raw);
  if (fs::is_directory(path, error)) return inspect_run(path);
  std::string extension = fs::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return char(std::tolower(c)); });
  if (extension == ".frame") {
    const auto frame = viewer::read_spooled_frame(path);
    if (!frame) return refuse(frame.error().text);
    return inspect_view(path, frame->view, "a recorded frame");
  }
  if (extension == ".exr" || extension == ".png") {
    const auto view = image::read_view(path);
    if (!view) return refuse(view.error().text);
    return inspect_view(path, *view, view->depth_m.empty() ? "a picture" : "a picture with depth");
  }
  if (extension == ".depth") {
    if (fs::file_size(path, error) > kMaxDepthImageBytes)
      return refuse(fmt::format("{}: {} bytes, limit {}", path, fs::file_size(path, error), kMaxDepthImageBytes));
    std::ifstream in(path, std::ios::binary);
    const std::vector<uint8_t> bytes((std::istreambuf_iterator<char>(in)), {});
    return inspect_depth_image(path, bytes);
  }
  return inspect_mesh(path, options);
}

}  // namespace telesplat::launcher
