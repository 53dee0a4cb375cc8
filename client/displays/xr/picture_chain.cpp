#include "client/displays/xr/picture_chain.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <type_traits>
#include <utility>

#include "common/parallel/in_parallel.h"

namespace telesplat::viewer {
namespace {

// Has no branches, so that the compiler can vectorise it.
template <class T>
void half_depth(const float* above, const float* below, const DepthRange& range, size_t pixels, T* out) {
  const auto near = float(1 / range.near_m), scale = float(1 / (1 / range.near_m - 1 / range.far_m));
  for (size_t x = 0; x < pixels; ++x) {
    const float nearest = std::min(std::min(above[2 * x], above[2 * x + 1]), std::min(below[2 * x], below[2 * x + 1]));
    const float value = std::min(std::max((near - 1 / nearest) * scale, 0.0f), 1.0f);
    out[x] = std::is_same_v<T, float> ? T(value) : T(int(value * 65535.0f + 0.5f));
  }
}

constexpr int kRowsAtOnce = 64;

}  // namespace

void to_rgba(const uint32_t* colour, size_t pixels, uint32_t* out) {
  for (size_t x = 0; x < pixels; ++x)
    out[x] = (colour[x] & 0xff00ff00u) | (colour[x] >> 16 & 0xffu) | (colour[x] & 0xffu) << 16;
}

void to_half_depth(const float* above, const float* below, const DepthRange& range, size_t pixels, float* out) {
  half_depth(above, below, range, pixels, out);
}

void to_half_depth(const float* above, const float* below, const DepthRange& range, size_t pixels, uint16_t* out) {
  half_depth(above, below, range, pixels, out);
}

Result<PictureChain> PictureChain::make(const XrSystem& system, XrSession session, int64_t format,
                                        XrSwapchainUsageFlags usage, int width, int height) {
  XrSwapchainCreateInfo info{XR_TYPE_SWAPCHAIN_CREATE_INFO};
  info.usageFlags = usage | XR_SWAPCHAIN_USAGE_SAMPLED_BIT;
  info.format = format;
  info.sampleCount = info.faceCount = info.arraySize = info.mipCount = 1;
  info.width = uint32_t(width), info.height = uint32_t(height);
  XrSwapchain handle = nullptr;
  if (const Status s = system.check("xrCreateSwapchain", xrCreateSwapchain(session, &info, &handle)); !s)
    return s.error();
  PictureChain out(system, handle, format, width, height);
  uint32_t count = 0;
  if (const Status s =
          system.check("xrEnumerateSwapchainImages", xrEnumerateSwapchainImages(handle, 0, &count, nullptr));
      !s)
    return s.error();
  std::vector<XrSwapchainImageOpenGLKHR> images(count, {XR_TYPE_SWAPCHAIN_IMAGE_OPENGL_KHR});
  const XrResult listed =
      xrEnumerateSwapchainImages(handle, count, &count, reinterpret_cast<XrSwapchainImageBaseHeader*>(images.data()));
  if (const Status s = system.check("xrEnumerateSwapchainImages", listed); !s) return s.error();
  for (const auto& image : images) out.textures_.push_back(image.image);
  return out;
}

PictureChain::PictureChain(PictureChain&& o) noexcept
    : system_(o.system_),
      handle_(std::exchange(o.handle_, nullptr)),
      format_(o.format_),
      width_(o.width_),
      height_(o.height_),
      textures_(std::move(o.textures_)) {}

PictureChain::~PictureChain() {
  if (handle_) xrDestroySwapchain(handle_);
}

template <class Upload>
Status PictureChain::put_with(Upload upload) {
  uint32_t index = 0;
  if (const Status s = system_->check("xrAcquireSwapchainImage", xrAcquireSwapchainImage(handle_, nullptr, &index)); !s)
    return s;
  XrSwapchainImageWaitInfo wait{XR_TYPE_SWAPCHAIN_IMAGE_WAIT_INFO};
  wait.timeout = XR_INFINITE_DURATION;
  if (const Status s = system_->check("xrWaitSwapchainImage", xrWaitSwapchainImage(handle_, &wait)); !s) return s;
  if (index < textures_.size()) {
    glBindTexture(GL_TEXTURE_2D, textures_[index]);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
    upload();
    glBindTexture(GL_TEXTURE_2D, 0);
  }
  return system_->check("xrReleaseSwapchainImage", xrReleaseSwapchainImage(handle_, nullptr));
}

// OpenGL begins with the lowest row. All threads convert pixels to the texture's order here: drivers would do so in one
// thread, and take several times as long.
template <class T, class Row>
void PictureChain::turn(std::vector<T>& turned, Row row) {
  turned.resize(size_t(width_) * size_t(height_));
  in_parallel(tbb::blocked_range<int>(0, height_, kRowsAtOnce), [&](const tbb::blocked_range<int>& rows) {
    for (int y = rows.begin(); y < rows.end(); ++y)
      row(size_t(y), turned.data() + size_t(height_ - 1 - y) * size_t(width_));
  });
}

Status PictureChain::put_colour(const image::View& picture) {
  turn(turned_,
       [&](size_t y, uint32_t* to) { to_rgba(picture.colour.data() + y * size_t(picture.width), size_t(width_), to); });
  return put_with(
      [&] { glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width_, height_, GL_RGBA, GL_UNSIGNED_BYTE, turned_.data()); });
}

Status PictureChain::put_depth(const image::View& picture, const DepthRange& range) {
  const auto row = [&](size_t y, auto* to) {
    const float* above = picture.depth_m.data() + 2 * y * size_t(picture.width);
    to_half_depth(above, above + picture.width, range, size_t(width_), to);
  };
  const bool is_short = format_ == GL_DEPTH_COMPONENT16;
  if (is_short)
    turn(turned_depth16_, row);
  else
    turn(turned_depth_, row);
  return put_with([&] {
    if (is_short) {
      glPixelStorei(GL_UNPACK_ALIGNMENT, 2);
      glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width_, height_, GL_DEPTH_COMPONENT, GL_UNSIGNED_SHORT,
                      turned_depth16_.data());
    } else {
      glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width_, height_, GL_DEPTH_COMPONENT, GL_FLOAT, turned_depth_.data());
    }
  });
}

XrSwapchainSubImage PictureChain::sub_image() const { return {handle_, {{0, 0}, {width_, height_}}, 0}; }

}  // namespace telesplat::viewer
