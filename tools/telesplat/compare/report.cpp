#include "tools/telesplat/compare/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "common/metrics/statistics.h"

namespace telesplat::launcher {
namespace {

struct Figure {
  const char* name;
  const char* format;
  std::function<double(const Cell&)> of;
};

const std::vector<Figure>& figures() {
  static const std::vector<Figure> all{
      {"splat_scale", "{:.3g}", [](const Cell& c) { return c.splat_scale; }},
      {"psnr_db", "{:.3f}", [](const Cell& c) { return c.quality.psnr_db; }},
      {"ssim", "{:.5f}", [](const Cell& c) { return c.quality.ssim; }},
      {"flip", "{:.5f}", [](const Cell& c) { return c.flip; }},
      {"hole_fraction", "{:.6f}", [](const Cell& c) { return c.quality.hole_fraction; }},
      {"object_pixels", "{:.0f}", [](const Cell& c) { return double(c.quality.object_pixels); }},
      {"error_silhouette", "{:.4f}", [](const Cell& c) { return c.shares.silhouette; }},
      {"error_depth_edge", "{:.4f}", [](const Cell& c) { return c.shares.depth_edge; }},
      {"error_interior", "{:.4f}", [](const Cell& c) { return c.shares.interior; }},
      {"pixels_silhouette", "{:.5f}", [](const Cell& c) { return c.shares.silhouette_pixels; }},
      {"pixels_depth_edge", "{:.5f}", [](const Cell& c) { return c.shares.depth_edge_pixels; }},
      {"interior_psnr_db", "{:.3f}", [](const Cell& c) { return c.shares.interior_psnr_db; }},
      {"frame_ms", "{:.3f}", [](const Cell& c) { return c.times.frame_ms; }},
      {"select_ms", "{:.3f}", [](const Cell& c) { return c.times.select_ms; }},
      {"render_ms", "{:.3f}", [](const Cell& c) { return c.times.render_ms; }},
      {"project_cpu_ms", "{:.3f}", [](const Cell& c) { return c.times.stats.project_ms; }},
      {"resolve_cpu_ms", "{:.3f}", [](const Cell& c) { return c.times.stats.resolve_ms; }},
      {"fill_cpu_ms", "{:.3f}", [](const Cell& c) { return c.times.stats.fill_ms; }},
      {"smooth_cpu_ms", "{:.3f}", [](const Cell& c) { return c.times.stats.smooth_ms; }},
      {"antialias_cpu_ms", "{:.3f}", [](const Cell& c) { return c.times.stats.antialias_ms; }},
      {"points_drawn", "{:.0f}", [](const Cell& c) { return double(c.times.stats.points_drawn); }},
      {"items", "{:.0f}", [](const Cell& c) { return double(c.items); }}};
  return all;
}

double median_of(const std::vector<ComparedPose>& poses, size_t cell, const std::function<double(const Cell&)>& of) {
  std::vector<double> values;
  for (const auto& p : poses) values.push_back(of(p.cells.at(cell)));
  return metrics::distribution(values).median;
}

std::string table_line(std::string_view pose, const Cell& c, const std::function<double(const char*)>& value) {
  return fmt::format("{:>8} {:8} {:4} {:8.2f} {:8.4f} {:8.4f} {:9.3f} {:5.0f} {:5.0f} {:5.0f} {:10.2f} {:10.2f}\n",
                     pose, splat::kernel_name(c.kernel), c.renderer, value("psnr_db"), value("ssim"), value("flip"),
                     100 * value("hole_fraction"), 100 * value("error_silhouette"), 100 * value("error_depth_edge"),
                     100 * value("error_interior"), value("interior_psnr_db"), value("frame_ms"));
}

const Figure& figure(std::string_view name) {
  for (const Figure& f : figures())
    if (f.name == name) return f;
  CHECK(false);
  return figures().front();
}

constexpr uint32_t kFrame = 0xffd23f;
constexpr int kZoom = 4, kPoseWidth = 480, kColumnWidth = 280;

// Returns the side of the magnified square: once magnified, it is as high as the small pictures.
int square_side(const image::View& reference, int width) {
  return std::max(8, small_picture(reference, width).height / kZoom);
}

image::View small_with_frame(const image::View& v, int width, const geometry::Rect& square) {
  const image::View small = small_picture(v, width);
  image::Canvas canvas(small.width, small.height, 0);
  canvas.place(small, 0, 0);
  const double scale = double(small.width) / v.width;
  canvas.outline({int(square.x * scale), int(square.y * scale), std::max(3, int(square.width * scale)),
                  std::max(3, int(square.height * scale))},
                 kFrame);
  return canvas.view();
}

image::View errors_of(const Cell& cell) {
  return image::picture_of_errors(cell.flip_map, cell.view.width, cell.view.height);
}

std::string label_of(const Cell& c) {
  return fmt::format("{} {}  PSNR {:.2f} dB  SSIM {:.4f}  FLIP {:.4f}  holes {:.2f} %  {:.2f} ms",
                     splat::kernel_name(c.kernel), c.renderer, c.quality.psnr_db, c.quality.ssim, c.flip,
                     100 * c.quality.hole_fraction, c.times.frame_ms);
}

}  // namespace

std::string comparison_csv(const std::vector<ComparedPose>& poses) {
  std::string out = "frame,t_s,sequence,points_cached,kernel,renderer";
  for (const Figure& f : figures()) out += std::string(",") + f.name;
  out += "\n";
  for (const auto& p : poses)
    for (const Cell& c : p.cells) {
      out += fmt::format("{},{:.4f},{},{},{},{}", p.frame.number, p.frame.t_s, p.frame.sequence.value, p.points_cached,
                         splat::kernel_name(c.kernel), c.renderer);
      for (const Figure& f : figures()) out += "," + fmt::format(fmt::runtime(f.format), f.of(c));
      out += "\n";
    }
  return out;
}

nlohmann::ordered_json comparison_json(nlohmann::ordered_json about, const std::vector<ComparedPose>& poses) {
  about["poses"] = nlohmann::ordered_json::array();
  for (const auto& p : poses) {
    const auto& e = p.frame.camera.pose.position_room;
    const auto& q = p.frame.camera.pose.orientation;
    nlohmann::ordered_json pose{{"frame", p.frame.number},
                                {"t_s", p.frame.t_s},
                                {"sequence", p.frame.sequence.value},
                                {"points_cached", p.points_cached},
                                {"position_room", {e.x, e.y, e.z}},
                                {"orientation_wxyz", {q.w, q.x, q.y, q.z}},
                                {"cells", nlohmann::ordered_json::array()}};
    for (const Cell& c : p.cells) {
      nlohmann::ordered_json cell{{"kernel", splat::kernel_name(c.kernel)}, {"renderer", c.renderer}};
      for (const Figure& f : figures()) cell[f.name] = f.of(c);
      pose["cells"].push_back(std::move(cell));
    }
    about["poses"].push_back(std::move(pose));
  }
  about["medians"] = nlohmann::ordered_json::array();
  for (size_t i = 0; !poses.empty() && i < poses.front().cells.size(); ++i) {
    const Cell& c = poses.front().cells[i];
    nlohmann::ordered_json row{{"kernel", splat::kernel_name(c.kernel)}, {"renderer", c.renderer}};
    for (const Figure& f : figures()) row[f.name] = median_of(poses, i, f.of);
    about["medians"].push_back(std::move(row));
  }
  return about;
}

std::string comparison_table(const std::vector<ComparedPose>& poses) {
  std::string out =
      "                           PSNR                            squared error %    interior      frame\n"
      "   frame kernel   rend.      dB     SSIM     FLIP   holes %  silh  edge inter    PSNR dB         ms\n";
  if (poses.empty()) return out;
  for (const auto& p : poses)
    for (const Cell& c : p.cells)
      out += table_line(std::to_string(p.frame.number), c, [&](const char* name) { return figure(name).of(c); });
  if (poses.size() > 1)
    for (size_t i = 0; i < poses.front().cells.size(); ++i)
      out += table_line("median", poses.front().cells[i],
                        [&](const char* name) { return median_of(poses, i, figure(name).of); });
  return out;
}

std::string median_label(const std::vector<ComparedPose>& poses, size_t i) {
  const Cell& c = poses.front().cells.at(i);
  const auto value = [&](const char* name) { return median_of(poses, i, figure(name).of); };
  return fmt::format("{} {}  PSNR {:.2f} dB  SSIM {:.4f}  FLIP {:.4f}  holes {:.2f} %  {:.2f} ms",
                     splat::kernel_name(c.kernel), c.renderer, value("psnr_db"), value("ssim"), value("flip"),
                     100 * value("hole_fraction"), value("frame_ms"));
}

image::View pose_sheet(const image::View& reference, const std::vector<Cell>& cells,
                       const std::vector<std::string>& captions) {
  const int side = square_side(reference, kPoseWidth);
  std::vector<SheetRow> rows{{"reference", {{{small_picture(reference, kPoseWidth)}, {}}}}};
  for (const Cell& c : cells) {
    const auto square = image::worst_square(c.flip_map, reference.width, reference.height, side);
    SheetCell pictures{
        {small_with_frame(c.view, kPoseWidth, square), small_with_frame(errors_of(c), kPoseWidth, square),
         image::magnify(c.view, square, kZoom), image::magnify(reference, square, kZoom)},
        {}};
    rows.push_back({label_of(c), {std::move(pictures)}});
  }
  return contact_sheet(captions, rows);
}

std::vector<SheetCell> pose_column(const image::View& reference, const std::vector<Cell>& cells,
                                   const std::string& pose_name) {
  std::vector<float> sum(reference.colour.size());
  for (const Cell& c : cells)
    for (size_t i = 0; i < sum.size(); ++i) sum[i] += c.flip_map[i];
  const auto square = image::worst_square(sum, reference.width, reference.height, square_side(reference, kColumnWidth));
  std::vector<SheetCell> out;
  out.push_back(
      {{small_with_frame(reference, kColumnWidth, square), image::magnify(reference, square, kZoom)}, {pose_name}});
  for (const Cell& c : cells)
    out.push_back({{small_with_frame(c.view, kColumnWidth, square), image::magnify(c.view, square, kZoom),
                    small_with_frame(errors_of(c), kColumnWidth, square)},
                   {fmt::format("{:.2f} dB  FLIP {:.4f}  holes {:.2f} %", c.quality.psnr_db, c.flip,
                                100 * c.quality.hole_fraction)}});
  return out;
}

}  // namespace telesplat::launcher
