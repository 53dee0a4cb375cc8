// Writes pictures to files, through libpng and OpenEXR themselves: OpenImageIO loads 200 libraries, which programs that
// only write pictures do not need.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <fmt/format.h>
#include <png.h>

#include <cstdio>
#include <functional>

#include "common/core/check.h"
#include "common/core/whole_file.h"
#include "common/image/background.h"
#include "common/image/file.h"
#include "common/image/srgb.h"

namespace telesplat::image {
namespace {

// Writes under a temporary name beside `path`, then renames: readers never see half a file, and links are not followed.
// write: writes the whole file; returns an error text, or an empty one.
Status write_picture(const std::string& path, const std::function<std::string(const std::string& part)>& write) {
  const auto part = new_part(path);
  if (!part) return part.error();
  std::string why = write(*part);
  if (why.empty() && std::rename(part->c_str(), path.c_str()) != 0) why = "renaming " + *part + " failed";
  if (why.empty()) return ok_status();
  std::remove(part->c_str());
  return Error{fmt::format("cannot write {}: {}", path, why)};
}

// channels: 3 or 4 of a pixel, 8 bits each. Pictures are recorded while the viewer runs: without filters, and packed
// lightly, one of 2560x1600 takes half the time, and is 16 % larger.
std::string write_png_file(const std::string& path, const View& view, int channels, const uint8_t* bytes) {
  png_image picture{};
  picture.version = PNG_IMAGE_VERSION;
  picture.width = png_uint_32(view.width), picture.height = png_uint_32(view.height);
  picture.format = channels == 4 ? PNG_FORMAT_RGBA : PNG_FORMAT_RGB;
  picture.flags = PNG_IMAGE_FLAG_FAST;
  return png_image_write_to_file(&picture, path.c_str(), 0, bytes, 0, nullptr) ? "" : picture.message;
}

// Writes an EXR file with `names.size()` interleaved half-float channels, and Z.
Status write_exr_file(const std::string& path, const View& view, const std::vector<const char*>& names,
                      const std::vector<Imath::half>& values) {
  return write_picture(path, [&](const std::string& part) -> std::string {
    try {
      Imf::Header header(view.width, view.height);
      header.compression() = Imf::ZIP_COMPRESSION;
      Imf::FrameBuffer pixels;
      const size_t step = names.size() * sizeof(Imath::half);
      for (size_t c = 0; c < names.size(); ++c) {
        header.channels().insert(names[c], Imf::Channel(Imf::HALF));
        pixels.insert(names[c], Imf::Slice(Imf::HALF, reinterpret_cast<char*>(const_cast<Imath::half*>(&values[c])),
                                           step, step * size_t(view.width)));
      }
      header.channels().insert("Z", Imf::Channel(Imf::FLOAT));
      pixels.insert("Z", Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(const_cast<float*>(view.depth_m.data())),
                                    sizeof(float), sizeof(float) * size_t(view.width)));
      Imf::OutputFile file(part.c_str(), header);
      file.setFrameBuffer(pixels);
      file.writePixels(view.height);
      return {};
    } catch (const std::exception& e) {
      return e.what();
    }
  });
}

}  // namespace

Status write_png(const std::string& path, const View& view, Alpha alpha) {
  const bool has_alpha = alpha == Alpha::kCoverage;
  const size_t channels = has_alpha ? 4 : 3;
  std::vector<uint8_t> bytes(view.colour.size() * channels);
  for (size_t i = 0; i < view.colour.size(); ++i) {
    const uint32_t colour = has_alpha ? straight_colour(view.colour[i]) : view.colour[i];
    for (int c = 0; c < 3; ++c) bytes[channels * i + size_t(c)] = static_cast<uint8_t>(colour >> (16 - 8 * c));
    if (has_alpha) bytes[channels * i + 3] = static_cast<uint8_t>(colour >> 24);
  }
  return write_picture(
      path, [&](const std::string& part) { return write_png_file(part, view, int(channels), bytes.data()); });
}

Status write_exr(const std::string& path, const View& view, Alpha alpha) {
  CHECK(view.depth_m.size() == view.colour.size());
  const bool has_alpha = alpha == Alpha::kCoverage;
  std::vector<const char*> names{"R", "G", "B"};
  if (has_alpha) names.push_back("A");
  const auto& linear = linear_of_srgb();
  std::vector<Imath::half> values(view.colour.size() * names.size());
  for (size_t i = 0; i < view.colour.size(); ++i) {
    const uint32_t colour = has_alpha ? straight_colour(view.colour[i]) : view.colour[i];
    const float covered = has_alpha ? float(colour >> 24) / 255 : 1;
    Imath::half* const out = values.data() + names.size() * i;
    for (int c = 0; c < 3; ++c) out[c] = linear[colour >> (16 - 8 * c) & 255] * covered;
    if (has_alpha) out[3] = covered;
  }
  return write_exr_file(path, view, names, values);
}

Status write_exr(const std::string& path, const View& view, std::span<const glm::vec3> normals) {
  CHECK(view.depth_m.size() == view.colour.size() && normals.size() == view.colour.size());
  const auto& linear = linear_of_srgb();
  constexpr size_t kChannels = 6;
  std::vector<Imath::half> values(view.colour.size() * kChannels);
  for (size_t i = 0; i < view.colour.size(); ++i) {
    Imath::half* const out = values.data() + kChannels * i;
    for (int c = 0; c < 3; ++c) out[c] = linear[view.colour[i] >> (16 - 8 * c) & 255], out[3 + c] = normals[i][c];
  }
  return write_exr_file(path, view, {"R", "G", "B", "N.X", "N.Y", "N.Z"}, values);
}

}  // namespace telesplat::image
