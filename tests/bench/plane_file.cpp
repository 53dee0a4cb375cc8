#include "tests/bench/plane_file.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include "common/core/check.h"

namespace telesplat::image {

size_t plane_file_bytes(const std::string& extension, const std::string& compression, int width, int height,
                        int channels, int value_bytes, std::span<const std::byte> planes) {
  CHECK(planes.size() == size_t(width) * size_t(height) * size_t(channels) * size_t(value_bytes));
  const auto out = OIIO::ImageOutput::create(extension);
  if (!out || !out->supports("ioproxy")) return 0;
  OIIO::Filesystem::IOVecOutput memory;
  if (!out->set_ioproxy(&memory)) return 0;
  const OIIO::TypeDesc type = value_bytes == 4 ? OIIO::TypeUInt32 : OIIO::TypeUInt8;
  OIIO::ImageSpec spec(width, height, channels, type);
  spec.alpha_channel = -1;  // planes, not premultiplied colour
  spec.attribute("oiio:UnassociatedAlpha", 1);
  if (!compression.empty()) spec.attribute("compression", compression);
  const bool written = out->open("memory." + extension, spec) && out->write_image(type, planes.data()) && out->close();
  return written ? memory.buffer().size() : 0;
}

}  // namespace telesplat::image
