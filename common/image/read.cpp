// Pictures that Telesplat writes, read again through libpng and OpenEXR themselves, as in write.cpp.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "common/geometry/camera.h"
#include "common/image/file.h"
#include "common/image/srgb.h"

namespace telesplat::image {
namespace {

// Rows that are read at once: memory follows what a file holds, not what its header claims.
constexpr int kRowsAtOnce = 16;

std::string size_error(int64_t width, int64_t height) {
  const bool good = width >= 1 && height >= 1 && width <= geometry::kMaxImageSide && height <= geometry::kMaxImageSide;
  return good ? std::string()
              : fmt::format("it has {}x{} pixels, limits are 1..{} a side", width, height, geometry::kMaxImageSide);
}

// libpng leaves a function only by a long jump, which no object with a destructor may see: these outlive it.
struct PngInput {
  explicit PngInput(const std::string& path) : file(std::fopen(path.c_str(), "rb")) {
    if (!file) {
      error = std::strerror(errno);
      return;
    }
    png = png_create_read_struct(
        PNG_LIBPNG_VER_STRING, &error,
        [](png_structp png, png_const_charp text) {
          *static_cast<std::string*>(png_get_error_ptr(png)) = text;
          png_longjmp(png, 1);
        },
        [](png_structp, png_const_charp) {});
    if (png) info = png_create_info_struct(png);
    if (!info) error = "out of memory";
  }
  ~PngInput() {
    png_destroy_read_struct(&png, &info, nullptr);
    if (file) std::fclose(file);
  }
  PngInput(const PngInput&) = delete;

  std::FILE* file;
  png_structp png = nullptr;
  png_infop info = nullptr;
  std::string error;
  std::vector<uint8_t> row;  // RGBA
  View view;
};

// False: the input's error says why.
bool read_header(PngInput& from) {
  if (setjmp(png_jmpbuf(from.png))) return false;
  png_init_io(from.png, from.file);
  png_read_info(from.png, from.info);
  png_set_expand(from.png);
  png_set_strip_16(from.png);
  png_set_gray_to_rgb(from.png);
  png_set_add_alpha(from.png, 0xff, PNG_FILLER_AFTER);
  if (png_get_interlace_type(from.png, from.info) != PNG_INTERLACE_NONE) png_error(from.png, "it is interlaced");
  png_read_update_info(from.png, from.info);
  return true;
}

bool read_row(PngInput& from) {
  if (setjmp(png_jmpbuf(from.png))) return false;
  png_read_row(from.png, from.row.data(), nullptr);
  return true;
}

bool read_end(PngInput& from) {
  if (setjmp(png_jmpbuf(from.png))) return false;
  png_read_end(from.png, nullptr);
  return true;
}

// A channel over black.
uint32_t covered(uint8_t channel, uint8_t alpha) { return (uint32_t(channel) * alpha + 127) / 255; }

std::string read_png(const std::string& path, View& view) {
  PngInput from(path);
  if (!from.info || !read_header(from)) return from.error;
  const int64_t width = png_get_image_width(from.png, from.info), height = png_get_image_height(from.png, from.info);
  if (std::string wrong = size_error(width, height); !wrong.empty()) return wrong;
  from.row.resize(size_t(width) * 4);
  for (int64_t y = 0; y < height; ++y) {
    if (!read_row(from)) return fmt::format("row {}: {}", y, from.error);
    for (size_t x = 0; x < size_t(width); ++x) {
      const uint8_t* const p = &from.row[4 * x];
      view.colour.push_back(covered(p[0], p[3]) << 16 | covered(p[1], p[3]) << 8 | covered(p[2], p[3]));
    }
  }
  if (!read_end(from)) return from.error;
  view.width = int(width), view.height = int(height);
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
