#include "tools/telesplat/inspect/pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <limits>

#include "client/viewer/record/frame_spool.h"
#include "common/codec/depth_codec.h"
#include "common/core/check.h"
#include "common/core/whole_file.h"
#include "common/image/normal.h"
#include "services/data/inspect.h"
#include "tools/common/csv_table.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

constexpr uintmax_t kMaxDepthImageBytes = 256u << 20;
constexpr float kNothing = std::numeric_limits<float>::infinity();

void describe_depth(const std::vector<float>& depth_m, data::Description& out) {
  std::vector<float> there;
  for (const float d : depth_m)
    if (std::isfinite(d)) there.push_back(d);
  const double share = depth_m.empty() ? 0 : double(there.size()) / double(depth_m.size());
  out.row("covered", fmt::format("{:.2f} % of the pixels ({})", 100 * share, there.size()));
  out.json["covered_pixels"] = there.size();
  out.json["coverage"] = share;
  if (there.empty()) return;
  const auto [nearest, farthest] = std::minmax_element(there.begin(), there.end());
  const double least = *nearest, most = *farthest;
  std::nth_element(there.begin(), there.begin() + ptrdiff_t(there.size() / 2), there.end());
  const double median = there[there.size() / 2];
  out.row("depth", fmt::format("{:.4f} .. {:.4f} m, median {:.4f} m", least, most, median));
  out.json["depth_m"] = {{"min", least}, {"median", median}, {"max", most}};
}

void describe_camera(const geometry::Camera& c, data::Description& out) {
  const glm::dvec3 at = c.pose.position_room, along = c.pose.orientation * glm::dvec3(0, 0, -1);
  const auto degrees = [](double a, double b) { return (std::atan(b) - std::atan(a)) * 180 / M_PI; };
  const double across = degrees(c.left, c.right), up = degrees(c.bottom, c.top);
  out.row("camera", fmt::format("at ({:.4f}, {:.4f}, {:.4f}), looking along ({:.3f}, {:.3f}, {:.3f}), {:.1f} x {:.1f} "
                                "degrees, near plane {:g} m",
                                at.x, at.y, at.z, along.x, along.y, along.z, across, up, c.near_m));
  const auto& q = c.pose.orientation;
  out.json["camera"] = {{"position", data::vector_json(at)},
                        {"orientation", {q.w, q.x, q.y, q.z}},
                        {"left", c.left},
                        {"right", c.right},
                        {"bottom", c.bottom},
                        {"top", c.top},
                        {"near_m", c.near_m}};
}

data::Description begin(const std::string& what, const std::string& title, const std::string& path, int width,
                        int height) {
  data::Description out(what, fmt::format("{}: {}", path, title));
  out.row("size", fmt::format("{} x {} pixels", width, height));
  out.json["path"] = path;
  out.json["size"] = {width, height};
  return out;
}

Result<std::vector<uint8_t>> read_limited(const std::string& path) {
  const auto bytes = read_whole(path, kMaxDepthImageBytes);
  if (!bytes) return bytes.error();
  return std::vector<uint8_t>(bytes->begin(), bytes->end());
}

// Decodes codes to metres, colours and normals.
void decode(const image::DepthImage& image, double near_m, Picture& out) {
  out.view = {image.width, image.height, image.colour, {}};
  for (const uint32_t code : image.depth)
    out.view.depth_m.push_back(code == 0 ? kNothing : float(image::decode_depth(code, near_m)));
  for (size_t i = 0; i < image.pixels(); ++i)
    out.normals.push_back(image.depth[i] == 0 ? glm::vec3(0) : image::decode_normal16(image.normal[i]));
}

void describe_codes(const image::DepthImage& image, data::Description& out) {
  uint32_t lowest = image::kMaxDepthCode, highest = 0;
  for (const uint32_t d : image.depth)
    if (d) lowest = std::min(lowest, d), highest = std::max(highest, d);
  if (highest == 0) return;
  out.row("depth codes", fmt::format("{} to {} of {}, reciprocal: --near METRES, the near plane of the camera that saw "
                                     "it, makes metres of them",
                                     lowest, highest, image::kMaxDepthCode));
  out.json["depth_codes"] = {{"min", lowest}, {"max", highest}, {"limit", image::kMaxDepthCode}};
}

namespace fs = std::filesystem;

constexpr tools::CsvTable::Limits kCameras{.rows = 1'000'000, .line_bytes = 4096};

// "frame-000012.depth" -> 12
std::optional<uint64_t> number_of(const std::string& path) {
  const std::string stem = fs::path(path).stem().string();
  const size_t dash = stem.rfind('-');
  uint64_t out = 0;
  if (dash == stem.npos) return std::nullopt;
  const auto parsed = std::from_chars(stem.data() + dash + 1, stem.data() + stem.size(), out);
  return parsed.ec == std::errc() && parsed.ptr == stem.data() + stem.size() ? std::optional(out) : std::nullopt;
}

Result<geometry::Camera> camera_in(const tools::CsvTable& table, size_t index) {
  tools::CsvRow row(table, index);
  geometry::Camera c;
  c.pose = {{row.number("px"), row.number("py"), row.number("pz")},
            {row.number("qw"), row.number("qx"), row.number("qy"), row.number("qz")}};
  for (const auto& [name, to] :
       {std::pair{"left", &c.left}, {"right", &c.right}, {"bottom", &c.bottom}, {"top", &c.top}, {"near_m", &c.near_m}})
    *to = row.number(name);
  c.width = int(std::clamp(row.number("width"), 0.0, 1e6));
  c.height = int(std::clamp(row.number("height"), 0.0, 1e6));
  if (const Status s = row.status(); !s) return s.error();
  if (const Status s = geometry::validate(c); !s) return table.wrong(index, s.error().text);
  return c;
}

// Reads a depth image's camera from cameras.csv beside it; nothing if there is no such file or no such frame. path ends
// in the frame's number: "frame-000012.depth". Error: the file is no such table; names file and line.
Result<std::optional<geometry::Camera>> recorded_camera(const std::string& path) {
  const std::string cameras = (fs::path(path).parent_path() / "cameras.csv").string();
  const auto number = number_of(path);
  std::error_code error;
  if (!number || !fs::exists(cameras, error)) return std::optional<geometry::Camera>();
  const auto table = tools::CsvTable::read(cameras, kCameras);
  if (!table) return table.error();
  const auto frame = table->column("frame");
  if (!frame) return frame.error();
  for (size_t row = 0; row < table->rows(); ++row) {
    const auto id = table->count(row, *frame);
    if (!id) return id.error();
    if (*id != *number) continue;
    const auto camera = camera_in(*table, row);
    return camera ? Result<std::optional<geometry::Camera>>(*camera) : camera.error();
  }
  return std::optional<geometry::Camera>();
}

}  // namespace

Result<Picture> inspect_picture(const std::string& path) {
  const bool spooled = path.ends_with(".frame");
  Picture out{{}, {}, std::nullopt, begin("", "", path, 0, 0)};
  if (spooled) {
    auto frame = viewer::read_spooled_frame(path);
    if (!frame) return frame.error();
    out.view = std::move(frame->view);
    out.camera = frame->camera;
  } else {
    auto view = image::read_view(path);
    if (!view) return view.error();
    out.view = std::move(*view);
  }
  const bool deep = !out.view.depth_m.empty();
  out.description = begin(spooled ? "recorded_frame" : "picture",
                          spooled ? "a recorded frame"
                          : deep  ? "a picture with depth"
                                  : "a picture",
                          path, out.view.width, out.view.height);
  if (deep) describe_depth(out.view.depth_m, out.description);
  if (out.camera) describe_camera(*out.camera, out.description);
  if (const std::string why = data::why_no_mesh(path); !spooled && !deep && !why.empty())
    out.description.row("as a scene", why);
  return out;
}

Result<Picture> inspect_depth_image(const std::string& path, std::optional<double> near_m) {
  const auto bytes = read_limited(path);
  if (!bytes) return bytes.error();
  const auto info = codec::inspect(*bytes);
  if (!info) return Error{fmt::format("{}: {}", path, info.error().text)};
  const auto image = codec::decode(*bytes);
  if (!image) return Error{fmt::format("{}: {}", path, image.error().text)};
  const auto camera = recorded_camera(path);
  if (!camera) return camera.error();
  Picture out{{}, {}, *camera, begin("depth_image", "a sampled depth image", path, image->width, image->height)};
  if (near_m && out.camera) out.camera->near_m = *near_m;
  if (!near_m && out.camera) near_m = out.camera->near_m;
  if (near_m) {
    decode(*image, *near_m, out);
    describe_depth(out.view.depth_m, out.description);
  } else {
    describe_codes(*image, out.description);
  }
  if (out.camera) describe_camera(*out.camera, out.description);
  const size_t covered = info->covered_pixels;
  out.description.row(
      "bytes", fmt::format("{} ({:.2f} a covered pixel): mask {}, depth {}, colour {}, normals {}, sparse tiles {}",
                           bytes->size(), covered ? double(bytes->size()) / double(covered) : 0.0, info->mask_bytes,
                           info->depth_bytes, info->colour_bytes, info->normal_bytes, info->sparse_bytes));
  out.description.json["bytes"] = {{"all", bytes->size()},          {"mask", info->mask_bytes},
                                   {"depth", info->depth_bytes},    {"colour", info->colour_bytes},
                                   {"normals", info->normal_bytes}, {"sparse_tiles", info->sparse_bytes}};
  return out;
}

Status write_depth(const std::string& path, const Picture& picture, const std::string& name) {
  const std::string extension = fs::path(path).extension().string();
  if (extension != ".npy" && extension != ".exr")
    return Error{fmt::format("--out {}: its name must end in .npy or .exr", path)};
  const image::View& view = picture.view;
  if (view.depth_m.empty())
    return Error{picture.description.json["what"] == "depth_image"
                     ? fmt::format("--out: the depths of {} are not metres without --near", name)
                     : fmt::format("--out: {} has no depth", name)};
  if (extension == ".npy") return write_npy(path, view.depth_m, view.height, view.width);
  return picture.normals.empty() ? image::write_exr(path, view) : image::write_exr(path, view, picture.normals);
}

Status write_npy(const std::string& path, std::span<const float> values, int rows, int columns) {
  static_assert(std::endian::native == std::endian::little, "floats are written as they lie in memory");
  CHECK(values.size() == size_t(rows) * size_t(columns));
  constexpr size_t kAlign = 64, kPrefix = 10;  // magic, version, length of what follows
  std::string header = fmt::format("{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, {}), }}", rows, columns);
  header.append(kAlign - 1 - (kPrefix + header.size()) % kAlign, ' ');
  header += '\n';
  const std::string prefix{'\x93', 'N', 'U', 'M', 'P', 'Y', 1, 0, char(header.size() & 255), char(header.size() >> 8)};

  std::string all = prefix + header;
  all.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
  return write_whole(path, all);
}

}  // namespace telesplat::launcher
