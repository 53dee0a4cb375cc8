#include "tools/telesplat/presets_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "client/viewer/viewer_service.h"
#include "common/geometry/trajectory.h"
#include "common/image/canvas.h"
#include "common/julia/flags.h"
#include "common/volume/transfer/function.h"
#include "tools/telesplat/progress_line.h"
#include "tools/telesplat/scene/direct_scene.h"

namespace telesplat::launcher {
namespace {

constexpr double kRoomSize_m = 0.8, kFov_deg = 46, kNear_m = 0.02;
constexpr int kMargin = 12, kLine = 20;
constexpr uint32_t kPaper = 0xff181818, kInk = 0xffe8e8e8, kPale = 0xffa0a0a0;

// From in front, right and above.
geometry::Camera camera_of(int width, int height) {
  return geometry::make_camera(geometry::look_at({0.75, 0.55, 0.95}, {0, 0, 0}), kFov_deg, width, height, kNear_m);
}

Result<image::View> picture_of(const julia::Preset& preset, int width, int height, int magnify) {
  const julia::Scene scene{std::string(preset.name), preset.parameters, {}};
  const auto placement = julia::place(scene, kRoomSize_m);
  if (!placement) return Error{fmt::format("{}: {}", preset.name, placement.error().text)};
  RecordedJulia julia;
  julia.begin = preset.parameters;
  julia.placement = *placement;
  const auto direct = open_direct_julia(julia, 0);
  const auto view = direct->draw(camera_of(width * magnify, height * magnify), {}, {});
  if (!view) return view.error();
  return image::shrink(*view, width, height);
}

}  // namespace

void add_presets_flags(CLI::App& app, PresetsOptions& o) {
  app.add_option("--out", o.out, "PNG file for a sheet of pictures; without it they are told");
  app.add_option("--size", o.size, "pixels of one picture, WxH")->capture_default_str();
  app.add_option("--columns", o.columns, "pictures beside each other")->capture_default_str()->check(CLI::Range(1, 16));
  app.add_option("--magnify", o.magnify, "rays a pixel on each axis")->capture_default_str()->check(CLI::Range(1, 4));
}

int presets(const PresetsOptions& o) {
  if (o.out.empty()) {
    std::printf("Julia sets (--preset):\n%s\nTransfer functions of volumes (--tf):\n",
                julia::describe_presets().c_str());
    for (const auto& preset : volume::transfer_presets())
      std::fputs(fmt::format("  {:<12} {}\n", preset.name, preset.text).c_str(), stdout);
    return 0;
  }
  const auto size = viewer::parse_size(o.size, "--size");
  if (!size || size->first > 2048 || size->second > 2048) {
    std::fprintf(stderr, "telesplat: %s\n",
                 size ? fmt::format("--size {}: at most 2048 a side", o.size).c_str() : size.error().text.c_str());
    return 2;
  }
  net::install_signal_handlers();
  const auto [width, height] = *size;
  const int n = int(julia::presets().size()), rows = (n + o.columns - 1) / o.columns;
  const int columns = std::min(n, o.columns), across = width + kMargin, down = height + 2 * kLine + kMargin;
  image::Canvas sheet(kMargin + columns * across, kMargin + rows * down, kPaper);
  ProgressLine progress;
  for (int i = 0; i < n; ++i) {
    if (net::stop_requested()) return 1;
    const auto& preset = julia::presets()[size_t(i)];
    progress.show(fmt::format("{} ({} of {})", preset.name, i + 1, n));
    const auto picture = picture_of(preset, width, height, o.magnify);
    if (!picture) {
      std::fprintf(stderr, "telesplat: %s\n", picture.error().text.c_str());
      return 1;
    }
    const int x = kMargin + i % o.columns * across, y = kMargin + i / o.columns * down;
    const auto& c = preset.parameters.c;
    sheet.place(*picture, x, y);
    sheet.text(x, y + height + 4, preset.name, kInk, 2);
    sheet.text(x, y + height + 4 + kLine, fmt::format("c = ({}, {}, {}, {})", c.x, c.y, c.z, c.w), kPale, 1);
  }
  progress.close();
  if (const Status s = image::write_png(o.out, sheet.view()); !s) {
    std::fprintf(stderr, "telesplat: %s\n", s.error().text.c_str());
    return 1;
  }
  std::printf("%s: %d presets\n", o.out.c_str(), n);
  return 0;
}

}  // namespace telesplat::launcher
