#include "tools/telesplat/bench/steering/pictures.h"

#include <algorithm>
#include <cctype>

#include "common/image/canvas.h"
#include "common/image/measures/flip.h"

namespace telesplat::launcher {
namespace {

constexpr uint32_t kPaper = 0x202020, kInk = 0xffffff;
constexpr int kGap = 8, kCaption = 24, kZoom = 4;

// Dark enough that colours stand out.
uint32_t grey_of(uint32_t c) {
  const uint32_t luma = (2 * (c >> 16 & 255) + 5 * (c >> 8 & 255) + (c & 255)) / 8;
  return (luma * 5 / 12) * 0x010101;
}

// The largest difference of a channel, as an error of 0..1.
std::vector<float> differences(const image::View& a, const image::View& b) {
  std::vector<float> out(a.colour.size());
  for (size_t i = 0; i < out.size(); ++i) {
    int most = 0;
    for (const int shift : {16, 8, 0})
      most = std::max(most, std::abs(int(a.colour[i] >> shift & 255) - int(b.colour[i] >> shift & 255)));
    out[i] = float(most) / 255;
  }
  return out;
}

void place(image::Canvas& canvas, const image::View& picture, const std::string& caption, int x, int y) {
  canvas.text(x, y + 4, caption, kInk);
  canvas.place(picture, x, y + kCaption);
}

}  // namespace

std::string file_stem(const std::string& scene) {
  std::string out = scene.substr(scene.find_last_of('/') + 1);
  out = out.substr(0, out.find_last_of('.'));
  for (char& c : out)
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '.' && c != '-') c = '-';
  return out;
}

image::View cast_picture(const image::View& truth, const image::PixelMask& cast, const image::PixelMask& needed) {
  constexpr uint32_t kLacked = 0xffffff, kVain = 0xff3030, kMissed = 0x30a0ff;
  image::View out{truth.width, truth.height, std::vector<uint32_t>(truth.colour.size()), {}};
  const bool known = needed.width() == cast.width() && needed.height() == cast.height();
  for (int y = 0; y < truth.height; ++y)
    for (int x = 0; x < truth.width; ++x) {
      const size_t at = size_t(y) * truth.width + x;
      const bool lacked = !known || needed.at(x, y);
      out.colour[at] = cast.at(x, y)     ? (lacked ? kLacked : kVain)
                       : known && lacked ? kMissed
                                         : grey_of(truth.colour[at]);
    }
  return out;
}

Status write_plan_sheet(const std::string& path, const image::View& truth, const image::View& displayed,
                        const image::PixelMask& cast, const image::PixelMask& needed) {
  const int w = truth.width, h = truth.height;
  image::Canvas canvas(2 * w + 3 * kGap, 2 * (h + kCaption) + 3 * kGap, kPaper);
  const int right = w + 2 * kGap, below = h + kCaption + 2 * kGap;
  place(canvas, truth, "direct rendering", kGap, kGap);
  place(canvas, displayed, "displayed", right, kGap);
  place(canvas, image::picture_of_errors(differences(truth, displayed), w, h), "difference", kGap, below);
  place(canvas, cast_picture(truth, cast, needed), "cast: white lacked, red in vain; blue: missed", right, below);
  return image::write_png(path, canvas.view());
}

Status write_still_sheet(const std::string& path, const image::Reference& reference,
                         const std::vector<image::View>& views, const std::vector<std::string>& names) {
  const int w = reference.view.width, h = reference.view.height;
  const int side = std::min({w, h, h / kZoom});
  const auto worst = image::worst_square(differences(reference.view, views.back()), w, h, std::max(side, 1));
  const int row = h + kCaption + kGap, zoomed = worst.width * kZoom;
  image::Canvas canvas(2 * w + zoomed + 4 * kGap, int(views.size() + 1) * row + kGap, kPaper);
  for (size_t i = 0; i <= views.size(); ++i) {
    const bool truth = i == views.size();
    const image::View& view = truth ? reference.view : views[i];
    const int y = kGap + int(i) * row;
    place(canvas, view, truth ? "reference" : "steering: " + names[i], kGap, y);
    if (!truth)
      place(canvas, image::picture_of_errors(differences(reference.view, view), w, h), "difference", w + 2 * kGap, y);
    place(canvas, image::magnify(view, worst, kZoom), "enlarged", 2 * w + 3 * kGap, y);
  }
  return image::write_png(path, canvas.view());
}

}  // namespace telesplat::launcher
