// `telesplat presets`: the Julia sets and the transfer functions that have names; as text, or the Julia sets as a sheet
// of pictures.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "client/viewer/display/size_text.h"
#include "common/geometry/trajectory.h"
#include "common/image/canvas.h"
#include "common/julia/flags.h"
#include "common/net/service.h"
#include "common/volume/transfer/function.h"
#include "tools/common/complain.h"
#include "tools/common/progress_line.h"
#include "tools/telesplat/command.h"
#include "tools/telesplat/scene/scene.h"

namespace telesplat::launcher {
namespace {

constexpr double kFov_deg = 46, kNear_m = 0.02;
constexpr int kMargin = 12, kLine = 20, kMaxSide = 2048;
constexpr uint32_t kPaper = 0xff181818, kInk = 0xffe8e8e8, kPale = 0xffa0a0a0;

struct PresetsOptions {
  std::string out;  ///< PNG; empty: text on stdout
  std::string size = "480x360";
  int columns = 4;
  int magnify = 2;  ///< rays a pixel on each axis
};

options::Table table(PresetsOptions& o) {
  return {
      {.flag = "--out", .value = &o.out, .help = "PNG file for a sheet of pictures; without it they are told"},
      {.flag = "--size", .value = &o.size, .help = "pixels of one picture, WxH"},
      {.flag = "--columns", .value = &o.columns, .help = "pictures beside each other", .limits = options::Range{1, 16}},
      {.flag = "--magnify", .value = &o.magnify, .help = "rays a pixel on each axis", .limits = options::Range{1, 4}}};
}

// From in front, right and above.
geometry::Camera camera_of(int width, int height) {
  return geometry::make_camera(geometry::look_at({0.75, 0.55, 0.95}, {0, 0, 0}), kFov_deg, width, height, kNear_m);
}

Result<image::View> picture_of(const julia::Preset& preset, int width, int height, int magnify) {
  data::DataOptions options;
  options.scene = julia::kSceneWord;
  options.julia.preset = preset.name;
  const auto scene = scene_of(options);
  if (!scene) return scene.error();
  const auto direct = (*scene)->open_direct(0, {});
  if (!direct) return Error{fmt::format("{}: {}", preset.name, direct.error().text)};
  const auto view = (*direct)->draw(camera_of(width * magnify, height * magnify), {}, {});
  if (!view) return view.error();
  return image::shrink(*view, width, height);
}

int print() {
  std::printf("Julia sets (--preset):\n%s\nTransfer functions of volumes (--tf):\n", julia::describe_presets().c_str());
  for (const auto& preset : volume::transfer_presets())
    std::fputs(fmt::format("  {:<12} {}\n", preset.name, preset.text).c_str(), stdout);
  return 0;
}

int draw(const PresetsOptions& o, int width, int height) {
  const int n = int(julia::presets().size()), rows = (n + o.columns - 1) / o.columns;
  const int columns = std::min(n, o.columns), across = width + kMargin, down = height + 2 * kLine + kMargin;
  image::Canvas sheet(kMargin + columns * across, kMargin + rows * down, kPaper);
  tools::ProgressLine progress;
  for (int i = 0; i < n; ++i) {
    if (net::stop_requested()) return 1;
    const auto& preset = julia::presets()[size_t(i)];
    progress.show(fmt::format("{} ({} of {})", preset.name, i + 1, n));
    const auto picture = picture_of(preset, width, height, o.magnify);
    if (!picture) return tools::complain(picture.error(), 1);
    const int x = kMargin + i % o.columns * across, y = kMargin + i / o.columns * down;
    const auto& c = preset.parameters.c;
    sheet.place(*picture, x, y);
    sheet.text(x, y + height + 4, preset.name, kInk, 2);
    sheet.text(x, y + height + 4 + kLine, fmt::format("c = ({}, {}, {}, {})", c.x, c.y, c.z, c.w), kPale, 1);
  }
  progress.close();
  if (const Status s = image::write_png(o.out, sheet.view()); !s) return tools::complain(s.error(), 1);
  std::printf("%s: %d presets\n", o.out.c_str(), n);
  return 0;
}

int presets(PresetsOptions o, const options::Given&) {
  if (o.out.empty()) return print();
  const auto size = viewer::parse_size(o.size, "--size");
  if (!size) return tools::complain(size.error());
  if (std::max(size->first, size->second) > kMaxSide)
    return tools::complain({fmt::format("--size {}: at most {} a side", o.size, kMaxSide)});
  net::install_signal_handlers();
  return draw(o, size->first, size->second);
}

}  // namespace

Command presets_command() {
  return make_command("presets", "tell the Julia sets and transfer functions that have names, or draw the Julia sets",
                      table, presets);
}

}  // namespace telesplat::launcher
