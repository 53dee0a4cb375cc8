// Frames: their times and their content.
#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <thread>

#include "common/core/clock.h"
#include "tests/support/xr/calls.h"
#include "tests/support/xr/spaces.h"

namespace telesplat::xr_test::calls {
namespace {

using Of = Runtime::Of;
Runtime& runtime() { return Runtime::get(); }

constexpr const char* kEyes[]{"left", "right"};

bool renders(const Session& s) {
  return s.state == XR_SESSION_STATE_VISIBLE || s.state == XR_SESSION_STATE_FOCUSED || !s.shown;
}

const Swapchain* chain_of(Runtime& r, const XrSwapchainSubImage& image, bool depth) {
  const auto found = r.session->swapchains.find(image.swapchain);
  if (found == r.session->swapchains.end() || !found->second.released || found->second.depth != depth) return nullptr;
  const auto& [offset, extent] = image.imageRect;
  const bool inside = offset.x >= 0 && offset.y >= 0 && extent.width > 0 && extent.height > 0 &&
                      offset.x + extent.width <= found->second.width &&
                      offset.y + extent.height <= found->second.height && image.imageArrayIndex == 0;
  return inside ? &found->second : nullptr;
}

const XrCompositionLayerDepthInfoKHR* depth_of(const XrCompositionLayerProjectionView& view) {
  const auto* next = static_cast<const XrBaseInStructure*>(view.next);
  while (next && next->type != XR_TYPE_COMPOSITION_LAYER_DEPTH_INFO_KHR) next = next->next;
  return reinterpret_cast<const XrCompositionLayerDepthInfoKHR*>(next);
}

// Empty: the layer is right.
std::string complain_about(Runtime& r, const XrCompositionLayerProjection& layer) {
  if (layer.type != XR_TYPE_COMPOSITION_LAYER_PROJECTION || layer.viewCount != 2 || !layer.views)
    return "not a projection of two views";
  if (!r.session->spaces.contains(layer.space)) return "a layer in no space";
  for (int eye = 0; eye < 2; ++eye) {
    const auto& view = layer.views[eye];
    if (view.type != XR_TYPE_COMPOSITION_LAYER_PROJECTION_VIEW) return "a view of another type";
    if (!chain_of(r, view.subImage, false)) return "a view without a released picture";
    const auto& q = view.pose.orientation;
    if (std::abs(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w - 1) > 0.01) return "a view's pose is no rotation";
    if (!(view.fov.angleLeft < view.fov.angleRight && view.fov.angleDown < view.fov.angleUp))
      return "a view that is turned round";
    const auto* depth = depth_of(view);
    if (!depth) continue;
    if (!r.enabled.contains(XR_KHR_COMPOSITION_LAYER_DEPTH_EXTENSION_NAME)) return "depth without its extension";
    if (!chain_of(r, depth->subImage, true)) return "depth without a released picture";
    if (!(depth->minDepth >= 0 && depth->maxDepth <= 1 && depth->minDepth < depth->maxDepth && depth->nearZ > 0 &&
          depth->farZ > 0 && depth->nearZ != depth->farZ))
      return "depth whose range cannot be";
  }
  return {};
}

// OpenGL's textures begin with the lowest row.
template <class T>
std::vector<T> turned(const std::vector<T>& rows, int width, int height) {
  std::vector<T> out(rows.size());
  for (int y = 0; y < height; ++y)
    std::copy_n(rows.data() + size_t(y) * size_t(width), width, out.data() + size_t(height - 1 - y) * size_t(width));
  return out;
}

image::View picture_of(Runtime& r, const XrCompositionLayerProjectionView& view) {
  const Swapchain& chain = *chain_of(r, view.subImage, false);
  const size_t pixels = size_t(chain.width) * size_t(chain.height);
  image::View out{chain.width, chain.height, {}, {}};
  std::vector<uint32_t> colour(pixels);
  glBindTexture(GL_TEXTURE_2D, chain.textures[*chain.released]);
  glGetTexImage(GL_TEXTURE_2D, 0, GL_BGRA, GL_UNSIGNED_INT_8_8_8_8_REV, colour.data());
  out.colour = turned(colour, chain.width, chain.height);
  if (const auto* info = depth_of(view)) {
    const Swapchain& depth = *chain_of(r, info->subImage, true);
    std::vector<float> values(size_t(depth.width) * size_t(depth.height));
    glBindTexture(GL_TEXTURE_2D, depth.textures[*depth.released]);
    glGetTexImage(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT, GL_FLOAT, values.data());
    const float near = 1 / info->nearZ, far = 1 / info->farZ;
    for (float& v : values) {
      const float d = (v - info->minDepth) / (info->maxDepth - info->minDepth);
      v = d >= 1 ? std::numeric_limits<float>::infinity() : 1 / (near + d * (far - near));
    }
    // The depth image may have fewer pixels than the picture.
    values = turned(values, depth.width, depth.height);
    out.depth_m.resize(pixels);
    for (int y = 0; y < out.height; ++y)
      for (int x = 0; x < out.width; ++x)
        out.depth_m[size_t(y) * size_t(out.width) + size_t(x)] =
            values[size_t(y * depth.height / out.height) * size_t(depth.width) + size_t(x * depth.width / out.width)];
  }
  glBindTexture(GL_TEXTURE_2D, 0);
  return out;
}

void keep_pictures(Runtime& r, const XrCompositionLayerProjection& layer) {
  const WithContext current(*r.session);
  for (int eye = 0; eye < 2; ++eye)
    r.recorder->picture(fmt::format("frame-{:06d}-{}", r.session->begun - 1, kEyes[eye]),
                        picture_of(r, layer.views[eye]), r.config.exr);
}

}  // namespace

XrResult WaitFrame(XrSession, const XrFrameWaitInfo*, XrFrameState* state) {
  Runtime& r = runtime();
  double wake_s = 0;
  const XrResult result = r.call("xrWaitFrame", Of::kSession, [&] {
    Session& s = *r.session;
    if (!s.running) return r.wrong(XR_ERROR_SESSION_NOT_RUNNING, "the session does not run");
    if (s.turn != Session::Turn::kWait) return r.wrong(XR_ERROR_CALL_ORDER_INVALID, "the frame before was not ended");
    s.turn = Session::Turn::kBegin;
    const Pacing::Frame frame = s.pacing->next(monotonic_s());
    wake_s = frame.wake_s;
    s.display_s = frame.display_s;
    state->predictedDisplayTime = to_time(frame.display_s);
    state->predictedDisplayPeriod = to_time(s.pacing->period_s());
    s.told_to_render = renders(s);
    state->shouldRender = s.told_to_render ? XR_TRUE : XR_FALSE;
    return XR_SUCCESS;
  });
  const double wait_s = wake_s - monotonic_s();
  if (result == XR_SUCCESS && wait_s > 0) std::this_thread::sleep_for(std::chrono::duration<double>(wait_s));
  return result;
}

XrResult BeginFrame(XrSession, const XrFrameBeginInfo*) {
  Runtime& r = runtime();
  return r.call("xrBeginFrame", Of::kSession, [&] {
    Session& s = *r.session;
    if (s.turn != Session::Turn::kBegin) return r.wrong(XR_ERROR_CALL_ORDER_INVALID, "without xrWaitFrame");
    s.turn = Session::Turn::kEnd;
    ++s.begun;
    const int every = r.config.discard_every;
    return every > 0 && s.begun % uint64_t(every) == 0 ? XR_FRAME_DISCARDED : XR_SUCCESS;
  });
}

XrResult EndFrame(XrSession, const XrFrameEndInfo* info) {
  Runtime& r = runtime();
  return r.call("xrEndFrame", Of::kSession, [&] {
    Session& s = *r.session;
    if (s.turn != Session::Turn::kEnd) return r.wrong(XR_ERROR_CALL_ORDER_INVALID, "without xrBeginFrame");
    s.turn = Session::Turn::kWait;
    if (info->environmentBlendMode != XR_ENVIRONMENT_BLEND_MODE_OPAQUE)
      return r.wrong(XR_ERROR_ENVIRONMENT_BLEND_MODE_UNSUPPORTED, "a blend mode that was not offered");
    if (std::abs(to_s(info->displayTime) - s.display_s) > 1e-6)
      return r.wrong(XR_ERROR_TIME_INVALID, "not the time that xrWaitFrame told");
    Recorder::Frame frame{.number = s.begun - 1, .display_s = s.display_s, .submitted_s = monotonic_s()};
    frame.shown_s = s.pacing->shown_s(frame.display_s, frame.submitted_s);
    frame.layers = info->layerCount > 0;
    frame.discarded = r.config.discard_every > 0 && s.begun % uint64_t(r.config.discard_every) == 0;
    if (frame.layers) {
      const auto& layer = *reinterpret_cast<const XrCompositionLayerProjection*>(info->layers[0]);
      if (const std::string why = complain_about(r, layer); !why.empty()) return r.wrong(XR_ERROR_LAYER_INVALID, why);
      if (!s.told_to_render) r.wrong(XR_SUCCESS, "a picture that nobody sees");
      frame.depth = depth_of(layer.views[0]) != nullptr;
      frame.left = from_xr(layer.views[0].pose);
      if (r.config.every > 0 && frame.number % uint64_t(r.config.every) == 0) keep_pictures(r, layer);
    }
    r.recorder->frame(frame, s.pacing->period_s());
    if (!std::exchange(s.shown, true))
      for (const auto state : {XR_SESSION_STATE_SYNCHRONIZED, XR_SESSION_STATE_VISIBLE, XR_SESSION_STATE_FOCUSED})
        r.go_to(state);
    return XR_SUCCESS;
  });
}

}  // namespace telesplat::xr_test::calls
