// `telesplat inspect PATH`: what a data file or volume folder, a run folder, a recorded frame, a depth image or a
// picture holds.
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
#include "services/data/volume/volume.h"
#include "tools/common/complain.h"
#include "tools/telesplat/command.h"
#include "tools/telesplat/scene/scene.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

constexpr uintmax_t kMaxDepthImageBytes = 256u << 20;

int refuse(const std::string& why) { return tools::complain({why}); }

// Of a run, or of a data file.
struct InspectOptions {
  data::DataOptions data;
};

options::Table table(InspectOptions& o) {
  options::Table out{{.flag = "path", .value = &o.data.scene, .help = "file or folder", .required = true}};
  for (options::Row& row : data::scene_table(o.data))
    if (const auto name = options::name_of(row); name == "--cache" || name == "--raw") out.push_back(std::move(row));
  return out;
}

int inspect_run(const std::string& directory) {
  std::ifstream in(directory + "/summary.json");
  const auto summary = nlohmann::ordered_json::parse(in, nullptr, false);
  if (!summary.is_object())
    return refuse(
        fmt::format("{}: is a folder without a readable summary.json, so it is not a finished run", directory));
  std::printf("%s: a run\n%s\n", directory.c_str(), summary.dump(2).c_str());
  std::error_code error;
  if (fs::exists(directory + "/session.toml", error)) {
    const auto scene = recorded_scene(directory);
    if (scene)
      std::fputs((*scene)->describe_record().c_str(), stdout);
    else
      std::printf("  its scene cannot be told: %s\n", scene.error().text.c_str());
  }
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

int inspect_data(const data::DataOptions& options) {
  const auto scene = scene_of(options);
  if (!scene) return refuse(scene.error().text);
  const auto facts = (*scene)->describe_data();
  if (!facts) return refuse(facts.error().text);
  std::fputs(facts->c_str(), stdout);
  return 0;
}

int inspect_depth_file(const std::string& path) {
  std::error_code error;
  if (fs::file_size(path, error) > kMaxDepthImageBytes)
    return refuse(fmt::format("{}: {} bytes, limit {}", path, fs::file_size(path, error), kMaxDepthImageBytes));
  std::ifstream in(path, std::ios::binary);
  const std::vector<uint8_t> bytes((std::istreambuf_iterator<char>(in)), {});
  return inspect_depth_image(path, bytes);
}

// A folder is a run's, unless it holds a volume and no run.
bool is_run(const data::DataOptions& o) {
  std::error_code error;
  return o.volume.raw.empty() && fs::is_directory(o.scene, error) &&
         (fs::exists(o.scene + "/summary.json", error) || !data::looks_like_volume(o.scene));
}

int inspect(InspectOptions o, const options::Given&) {
  const std::string& path = o.data.scene;
  std::error_code error;
  if (!fs::exists(path, error)) return refuse(fmt::format("{}: no such file", path));
  if (is_run(o.data)) return inspect_run(path);
  if (!o.data.volume.raw.empty()) return inspect_data(o.data);
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
  return extension == ".depth" ? inspect_depth_file(path) : inspect_data(o.data);
}

}  // namespace

Command inspect_command() {
  return make_command("inspect", "tell what a data file, a run folder, a recorded frame or a depth image holds", table,
                      inspect);
}

}  // namespace telesplat::launcher
