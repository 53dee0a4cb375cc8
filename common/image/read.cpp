// Reads pictures that Telesplat wrote, through libpng and OpenEXR themselves, as in write.cpp.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>

#include "common/geometry/camera.h"
#include "common/image/file.h"
#include "common/image/srgb.h"

namespace telesplat::image {
namespace {

// Rows of an EXR file that are read at once: memory follows the file's content, not its header's claim.
constexpr int kRowsAtOnce = 16;

std::string size_error(int64_t width, int64_t height) {
  const bool good = width >= 1 && height >= 1 && width <= geometry::kMaxImageSide && height <= geometry::kMaxImageSide;
  return good ? std::string()
              : fmt::format("it has {}x{} pixels, limits are 1..{} a side", width, height, geometry::kMaxImageSide);
}

// A channel of a transparent pixel, over black.
uint32_t covered(uint8_t channel, uint8_t alpha) { return (uint32_t(channel) * alpha + 127) / 255; }

std::string read_png(const std::string& path, View& view) {
  png_image picture{};
  picture.version = PNG_IMAGE_VERSION;
  if (!png_image_begin_read_from_file(&picture, path.c_str())) return picture.message;
  const std::unique_ptr<png_image, decltype(&png_image_free)> freed(&picture, &png_image_free);
  if (std::string wrong = size_error(picture.width, picture.height); !wrong.empty()) return wrong;
  picture.format = PNG_FORMAT_RGBA;
  const size_t count = size_t(picture.width) * picture.height;
  const std::unique_ptr<uint8_t[]> rows(new uint8_t[4 * count]);  // uninitialised: pages are touched when read
  if (!png_image_finish_read(&picture, nullptr, rows.get(), 0, nullptr)) return picture.message;
  view.colour.resize(count);
  for (size_t i = 0; i < count; ++i) {
    const uint8_t* const p = &rows[4 * i];
    view.colour[i] = covered(p[0], p[3]) << 16 | covered(p[1], p[3]) << 8 | covered(p[2], p[3]);
  }
  view.width = int(picture.width), view.height = int(picture.height);
  return {};
}

std::string read_exr(const std::string& path, View& view) {
  try {
    Imf::InputFile file(path.c_str());
    const auto& header = file.header();
    const Imath::Box2i window = header.dataWindow();
    const int64_t width = int64_t(window.max.x) - window.min.x + 1, height = int64_t(window.max.y) - window.min.y + 1;
    if (std::string wrong = size_error(width, height); !wrong.empty()) return wrong;
    const bool has_depth = header.channels().findChannel("Z") != nullptr;
    constexpr const char* kNames[] = {"R", "G", "B", "Z"};
    std::array<std::vector<float>, 4> rows;
    for (auto& channel : rows) channel.resize(size_t(width) * kRowsAtOnce);
    for (int64_t y = 0; y < height; y += kRowsAtOnce) {
      const int first = int(window.min.y + y), last = std::min(first + kRowsAtOnce - 1, window.max.y);
      Imf::FrameBuffer pixels;
      for (size_t c = 0; c < rows.size(); ++c) {
        const size_t pitch = sizeof(float) * size_t(width);
        char* const origin = reinterpret_cast<char*>(rows[c].data()) - ptrdiff_t(pitch) * first -
                             ptrdiff_t(sizeof(float)) * window.min.x;
        pixels.insert(kNames[c], Imf::Slice(Imf::FLOAT, origin, sizeof(float), pitch));
      }
      file.setFrameBuffer(pixels);
      file.readPixels(first, last);
      const size_t count = size_t(last - first + 1) * size_t(width);
      for (size_t i = 0; i < count; ++i)
        view.colour.push_back(srgb_of_linear(rows[0][i]) << 16 | srgb_of_linear(rows[1][i]) << 8 |
                              srgb_of_linear(rows[2][i]));
      if (has_depth) view.depth_m.insert(view.depth_m.end(), rows[3].begin(), rows[3].begin() + ptrdiff_t(count));
    }
    view.width = int(width), view.height = int(height);
    return {};
  } catch (const std::exception& e) {
    return e.what();
  }
}

}  // namespace

Result<View> read_view(const std::string& path) {
  std::string ending = std::filesystem::path(path).extension();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  if (ending != ".png" && ending != ".exr")
    return Error{fmt::format("cannot read picture {}: it is neither .png nor .exr", path)};
  View view;
  const std::string wrong = ending == ".png" ? read_png(path, view) : read_exr(path, view);
  if (!wrong.empty()) return Error{fmt::format("cannot read picture {}: {}", path, wrong)};
  return view;
}

}  // namespace telesplat::image
