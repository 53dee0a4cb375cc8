// Textures, made in the application's own context.
#include <epoxy/gl.h>

#include <algorithm>
#include <array>

#include "tests/support/xr/calls.h"
#include "tests/support/xr/runtime.h"

namespace telesplat::xr_test::calls {
namespace {

using Of = Runtime::Of;
Runtime& runtime() { return Runtime::get(); }

constexpr uint32_t kTextures = 3;
constexpr std::array<int64_t, 5> kFormats{GL_SRGB8_ALPHA8, GL_RGBA8, GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT24,
                                          GL_DEPTH_COMPONENT16};

bool is_depth(int64_t format) {
  return format == GL_DEPTH_COMPONENT32F || format == GL_DEPTH_COMPONENT24 || format == GL_DEPTH_COMPONENT16;
}

template <class Body>
XrResult with(const char* name, XrSwapchain handle, Body body) {
  Runtime& r = runtime();
  return r.call(name, Of::kSession, [&] {
    const auto found = r.session->swapchains.find(handle);
    if (found == r.session->swapchains.end()) return r.wrong(XR_ERROR_HANDLE_INVALID, "no such swapchain");
    return XrResult(body(found->second));
  });
}

}  // namespace

XrResult EnumerateSwapchainFormats(XrSession, uint32_t capacity, uint32_t* count, int64_t* out) {
  return runtime().call("xrEnumerateSwapchainFormats", Of::kSession,
                        [&] { return hand_out(kFormats, capacity, count, out); });
}

XrResult CreateSwapchain(XrSession, const XrSwapchainCreateInfo* info, XrSwapchain* handle) {
  Runtime& r = runtime();
  return r.call("xrCreateSwapchain", Of::kSession, [&] {
    if (std::find(kFormats.begin(), kFormats.end(), info->format) == kFormats.end())
      return r.wrong(XR_ERROR_SWAPCHAIN_FORMAT_UNSUPPORTED, "a format that was not offered");
    if (info->sampleCount != 1 || info->faceCount != 1 || info->arraySize != 1 || info->mipCount != 1 ||
        info->width == 0 || info->height == 0)
      return r.wrong(XR_ERROR_FEATURE_UNSUPPORTED, "more than one sample, face, layer or level");
    Swapchain made{.width = int(info->width), .height = int(info->height), .depth = is_depth(info->format)};
    const WithContext current(*r.session);
    made.textures.resize(kTextures);
    glGenTextures(GLsizei(kTextures), made.textures.data());
    for (const uint32_t texture : made.textures) {
      glBindTexture(GL_TEXTURE_2D, texture);
      glTexStorage2D(GL_TEXTURE_2D, 1, GLenum(info->format), made.width, made.height);
    }
    glBindTexture(GL_TEXTURE_2D, 0);
    *handle = r.new_handle<XrSwapchain>();
    r.session->swapchains[*handle] = std::move(made);
    return XR_SUCCESS;
  });
}

XrResult DestroySwapchain(XrSwapchain handle) {
  return with("xrDestroySwapchain", handle, [&](Swapchain& chain) {
    const WithContext current(*runtime().session);
    glDeleteTextures(GLsizei(chain.textures.size()), chain.textures.data());
    runtime().session->swapchains.erase(handle);
    return XR_SUCCESS;
  });
}

XrResult EnumerateSwapchainImages(XrSwapchain handle, uint32_t capacity, uint32_t* count,
                                  XrSwapchainImageBaseHeader* out) {
  return with("xrEnumerateSwapchainImages", handle, [&](Swapchain& chain) {
    *count = uint32_t(chain.textures.size());
    if (capacity == 0) return XR_SUCCESS;
    if (capacity < *count) return XR_ERROR_SIZE_INSUFFICIENT;
    auto* images = reinterpret_cast<XrSwapchainImageOpenGLKHR*>(out);
    for (uint32_t i = 0; i < *count; ++i) {
      if (images[i].type != XR_TYPE_SWAPCHAIN_IMAGE_OPENGL_KHR)
        return runtime().wrong(XR_ERROR_VALIDATION_FAILURE, "images of another type");
      images[i].image = chain.textures[i];
    }
    return XR_SUCCESS;
  });
}

XrResult AcquireSwapchainImage(XrSwapchain handle, const XrSwapchainImageAcquireInfo*, uint32_t* index) {
  return with("xrAcquireSwapchainImage", handle, [&](Swapchain& chain) {
    if (chain.stage != Swapchain::Stage::kFree)
      return runtime().wrong(XR_ERROR_CALL_ORDER_INVALID, "the image before was not released");
    chain.stage = Swapchain::Stage::kAcquired;
    *index = chain.next;
    return XR_SUCCESS;
  });
}

XrResult WaitSwapchainImage(XrSwapchain handle, const XrSwapchainImageWaitInfo* info) {
  return with("xrWaitSwapchainImage", handle, [&](Swapchain& chain) {
    if (chain.stage != Swapchain::Stage::kAcquired || !info)
      return runtime().wrong(XR_ERROR_CALL_ORDER_INVALID, "no image was acquired");
    chain.stage = Swapchain::Stage::kWaited;
    return XR_SUCCESS;
  });
}

XrResult ReleaseSwapchainImage(XrSwapchain handle, const XrSwapchainImageReleaseInfo*) {
  return with("xrReleaseSwapchainImage", handle, [&](Swapchain& chain) {
    if (chain.stage != Swapchain::Stage::kWaited)
      return runtime().wrong(XR_ERROR_CALL_ORDER_INVALID, "no image was waited for");
    chain.stage = Swapchain::Stage::kFree;
    chain.released = chain.next;
    chain.next = (chain.next + 1) % uint32_t(chain.textures.size());
    return XR_SUCCESS;
  });
}

}  // namespace telesplat::xr_test::calls
