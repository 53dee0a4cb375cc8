#include "tools/telesplat/record/depth_camera.h"

#include <algorithm>
#include <charconv>
#include <filesystem>

#include "tools/common/csv_table.h"

namespace telesplat::launcher {
namespace {

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

}  // namespace

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

}  // namespace telesplat::launcher
