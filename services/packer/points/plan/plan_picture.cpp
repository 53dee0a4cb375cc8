#include "services/packer/points/plan/plan_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <filesystem>

#include "common/core/whole_file.h"
#include "common/image/canvas.h"

namespace telesplat::packer {
namespace {

struct Row {
  const char* name;
  const char* text;  // in the legend
  uint32_t colour;
};
constexpr std::array<Row, kRayClasses> kTable{{{"nothing", "nothing there", 0xff8c00},
                                               {"unproven", "unseen space before it", 0xffd700},
                                               {"sparse", "sparse", 0x00c8ff},
                                               {"edge", "edge", 0xff3cac},
                                               {"stale", "stale", 0xff2020},
                                               {"validation", "validation", 0x40ff60},
                                               {"good", "good: not cast", 0x606060},
                                               {"known_empty", "known empty: not cast", 0x101018}}};
constexpr int kLine = 20;  // pixels of the legend

const Row& row_of(RayClass c) { return kTable[static_cast<size_t>(c)]; }

uint32_t grey(uint32_t colour) {
  const uint32_t sum = (colour >> 16 & 255) + (colour >> 8 & 255) + (colour & 255);
  return (24 + sum / 5) * 0x010101u;
}

}  // namespace

const char* name_of(RayClass c) { return row_of(c).name; }

void PlanPicture::reset(FrameId of, int w, int h) {
  frame = of, width = w, height = h;
  classes.assign(static_cast<size_t>(w) * static_cast<size_t>(h), RayClass::kGood);
  ground.assign(classes.size(), 0);
}

void PlanPicture::set(int x0, int y, uint64_t bits, RayClass c) {
  for (; bits != 0; bits &= bits - 1)
    classes[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x0 + std::countr_zero(bits))] = c;
}

image::View drawn(const PlanPicture& picture) {
  image::View view{picture.width, picture.height, {}, {}};
  for (size_t i = 0; i < picture.classes.size(); ++i) {
    const RayClass c = picture.classes[i];
    view.colour.push_back(c == RayClass::kGood ? grey(picture.ground[i]) : row_of(c).colour);
  }
  // As many columns as fit.
  constexpr int kColumn = 320;
  const int columns = std::clamp(picture.width / kColumn, 1, kRayClasses);
  const int lines = (kRayClasses + columns - 1) / columns;
  image::Canvas canvas(picture.width, picture.height + lines * kLine, 0);
  canvas.place(view, 0, 0);
  for (int i = 0; i < kRayClasses; ++i) {
    const int x = i % columns * kColumn + 4, y = picture.height + i / columns * kLine + 3;
    const image::View square{14, 14, std::vector<uint32_t>(14 * 14, kTable[static_cast<size_t>(i)].colour), {}};
    canvas.place(square, x, y);
    canvas.outline({x, y, 14, 14}, 0xffffff);
    canvas.text(x + 20, y, kTable[static_cast<size_t>(i)].text, 0xffffff);
  }
  return canvas.view();
}

Result<PlanRecorder> PlanRecorder::open(const std::string& directory, int most) {
  if (const auto error = make_private_folder(directory))
    return Error{fmt::format("{}: cannot be made a folder for plans: {}", directory, error.message())};
  PlanRecorder out;
  out.directory_ = directory;
  out.left_ = most;
  return out;
}

Status PlanRecorder::add(const PlanPicture& picture) {
  if (full() || picture.width < 1 || picture.height < 1) return ok_status();
  --left_;
  return image::write_png(fmt::format("{}/plan-{:06d}.png", directory_, picture.frame.value), drawn(picture));
}

}  // namespace telesplat::packer
