#include "client/displays/xr/headset_session.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

namespace telesplat::viewer {
namespace {

const glm::dvec3 kOnStage(0, 1.1, -1.0);        // a table in front of a person in the middle of the stage
const glm::dvec3 kBeforeHead(0, -0.35, -0.75);  // the same if the space begins at the eyes
constexpr double kFar_m = 100;                  // far end of the layers' depth; content is always nearer
constexpr double kMostDepthStep_m = 1.5e-3;     // at one metre: coarser steps show in pictures that are moved by depth
constexpr XrPosef kNoOffset{{0, 0, 0, 1}, {0, 0, 0}};
constexpr XrSpaceLocationFlags kHeadLocated =
    XR_SPACE_LOCATION_POSITION_VALID_BIT | XR_SPACE_LOCATION_ORIENTATION_VALID_BIT;
constexpr XrViewStateFlags kSeen = XR_VIEW_STATE_POSITION_VALID_BIT | XR_VIEW_STATE_ORIENTATION_VALID_BIT;

int scaled(int recommended, int most, double scale) {
  return std::clamp(int(std::lround(recommended * scale)), 16, std::max(16, most));
}

// Returns the first of `wanted` that is in `there`; 0: there is no such format.
int64_t chosen(std::span<const int64_t> there, std::initializer_list<int64_t> wanted) {
  for (const int64_t format : wanted)
    if (std::find(there.begin(), there.end(), format) != there.end()) return format;
  return 0;
}

}  // namespace

bool HeadsetSession::done(const char* what, XrResult result) { return done(system_.check(what, result)); }

bool HeadsetSession::done(const Status& status) {
  if (status) return true;
  if (!over_) news_.push_back("the headset's session is over: " + status.error().text);
  over_ = true;
  running_ = false;
  return false;
}

Status HeadsetSession::make_session(const gl::EglContext& context) {
  XrGraphicsBindingEGLMNDX binding{XR_TYPE_GRAPHICS_BINDING_EGL_MNDX};
  binding.getProcAddress = eglGetProcAddress;
  binding.display = context.display();
  binding.config = context.config();
  binding.context = context.context();
  XrSessionCreateInfo info{XR_TYPE_SESSION_CREATE_INFO, &binding};
  info.systemId = system_.system();
  return system_.check("xrCreateSession", xrCreateSession(system_.instance(), &info, &session_));
}

// A stage has a floor; without one, the space begins at the eyes' first place.
Status HeadsetSession::make_spaces() {
  XrReferenceSpaceType types[16];
  uint32_t count = 0;
  if (const Status s =
          system_.check("xrEnumerateReferenceSpaces", xrEnumerateReferenceSpaces(session_, 16, &count, types));
      !s)
    return s;
  const bool stage = std::find(types, types + count, XR_REFERENCE_SPACE_TYPE_STAGE) != types + count;
  origin_ = options_.origin_m.value_or(stage ? kOnStage : kBeforeHead);
  XrReferenceSpaceCreateInfo info{XR_TYPE_REFERENCE_SPACE_CREATE_INFO};
  info.poseInReferenceSpace = kNoOffset;
  info.referenceSpaceType = stage ? XR_REFERENCE_SPACE_TYPE_STAGE : XR_REFERENCE_SPACE_TYPE_LOCAL;
  if (const Status s = system_.check("xrCreateReferenceSpace", xrCreateReferenceSpace(session_, &info, &stage_)); !s)
    return s;
  info.referenceSpaceType = XR_REFERENCE_SPACE_TYPE_VIEW;
  return system_.check("xrCreateReferenceSpace", xrCreateReferenceSpace(session_, &info, &head_));
}

// Colours are sRGB; depth is made only if the runtime takes it.
Status HeadsetSession::make_chains() {
  uint32_t count = 0;
  if (const Status s =
          system_.check("xrEnumerateSwapchainFormats", xrEnumerateSwapchainFormats(session_, 0, &count, nullptr));
      !s)
    return s;
  std::vector<int64_t> formats(count);
  const XrResult listed = xrEnumerateSwapchainFormats(session_, count, &count, formats.data());
  if (const Status s = system_.check("xrEnumerateSwapchainFormats", listed); !s) return s;
  const int64_t colour = chosen(formats, {GL_SRGB8_ALPHA8, GL_SRGB8, GL_RGBA8});
  // Drivers take 16 bits as they are, but convert floats one by one.
  const bool few_bits_do = step_of_depth_m(near_m_, kFar_m) <= kMostDepthStep_m;
  const int64_t depth = few_bits_do
                            ? chosen(formats, {GL_DEPTH_COMPONENT16, GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT24})
                            : chosen(formats, {GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT24, GL_DEPTH_COMPONENT16});
  if (colour == 0) return Error{system_.name() + " has no textures of 8 bits a colour"};
  const auto& size = system_.eye_size();
  width_ = scaled(size.width, size.most_width, options_.scale);
  height_ = scaled(size.height, size.most_height, options_.scale);
  for (int eye = 0; eye < 2; ++eye) {
    auto made = PictureChain::make(system_, session_, colour, XR_SWAPCHAIN_USAGE_COLOR_ATTACHMENT_BIT, width_, height_);
    if (!made) return made.error();
    colour_.push_back(std::move(*made));
    if (!options_.depth || !system_.takes_depth() || depth == 0) continue;
    auto deep = PictureChain::make(system_, session_, depth, XR_SWAPCHAIN_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT,
                                   width_ / 2, height_ / 2);
    if (!deep) return deep.error();
    depth_.push_back(std::move(*deep));
  }
  return ok_status();
}

Result<std::unique_ptr<HeadsetSession>> HeadsetSession::open(const XrSystem& system, const gl::EglContext& context,
                                                             const XrOptions& options, double near_m) {
  std::unique_ptr<HeadsetSession> out(new HeadsetSession(system, options, near_m));
  if (const Status s = out->make_session(context); !s) return s.error();
  if (const Status s = out->make_spaces(); !s) return s.error();
  if (const Status s = out->make_chains(); !s) return s.error();
  auto hands = Hands::make(system, out->session_);
  if (!hands) return hands.error();
  out->hands_ = std::move(*hands);
  return out;
}

HeadsetSession::~HeadsetSession() {
  hands_.reset();
  colour_.clear();
  depth_.clear();
  for (const XrSpace space : {stage_, head_})
    if (space != XR_NULL_HANDLE) xrDestroySpace(space);
  if (session_ != XR_NULL_HANDLE) xrDestroySession(session_);
}

void HeadsetSession::on_state(const XrEventDataSessionStateChanged& event) {
  switch (event.state) {
    case XR_SESSION_STATE_READY: {
      XrSessionBeginInfo info{XR_TYPE_SESSION_BEGIN_INFO};
      info.primaryViewConfigurationType = kTwoEyes;
      running_ = done("xrBeginSession", xrBeginSession(session_, &info));
      return;
    }
    case XR_SESSION_STATE_STOPPING:
      running_ = false;
      done("xrEndSession", xrEndSession(session_));
      return;
    case XR_SESSION_STATE_EXITING:
      quits_ = true;
      return;
    case XR_SESSION_STATE_LOSS_PENDING:
      done(Status(Error{"the runtime lost the headset"}));
      return;
    default:
      return;
  }
}

void HeadsetSession::poll() {
  while (!over_) {
    XrEventDataBuffer event{XR_TYPE_EVENT_DATA_BUFFER};
    const XrResult result = xrPollEvent(system_.instance(), &event);
    if (result == XR_EVENT_UNAVAILABLE || !done("xrPollEvent", result)) return;
    switch (event.type) {
      case XR_TYPE_EVENT_DATA_SESSION_STATE_CHANGED:
        on_state(reinterpret_cast<const XrEventDataSessionStateChanged&>(event));
        break;
      case XR_TYPE_EVENT_DATA_INSTANCE_LOSS_PENDING:
        done(Status(Error{"the runtime goes away"}));
        break;
      case XR_TYPE_EVENT_DATA_REFERENCE_SPACE_CHANGE_PENDING:
        recentres_at_ = reinterpret_cast<const XrEventDataReferenceSpaceChangePending&>(event).changeTime;
        news_.push_back("the headset's space is centred anew");
        break;
      case XR_TYPE_EVENT_DATA_EVENTS_LOST:
        news_.push_back("the runtime dropped events: too many at once");
        break;
      default:
        break;
    }
  }
}

void HeadsetSession::request_exit() {
  if (session_ != XR_NULL_HANDLE && running_ && !over_) done("xrRequestExitSession", xrRequestExitSession(session_));
}

std::optional<HeadsetSession::Frame> HeadsetSession::begin_frame() {
  XrFrameState state{XR_TYPE_FRAME_STATE};
  if (!done("xrWaitFrame", xrWaitFrame(session_, nullptr, &state))) return std::nullopt;
  const XrResult begun = xrBeginFrame(session_, nullptr);
  if (!done("xrBeginFrame", begun)) return std::nullopt;
  if (recentres_at_ && state.predictedDisplayTime >= *recentres_at_) {
    recentred_ = true;
    recentres_at_.reset();
  }
  return Frame{state.predictedDisplayTime, system_.to_monotonic_s(state.predictedDisplayTime),
               1e-9 * double(state.predictedDisplayPeriod), state.shouldRender == XR_TRUE, begun == XR_FRAME_DISCARDED};
}

std::optional<HeadsetSession::Eyes> HeadsetSession::locate_eyes(XrTime time) {
  XrViewLocateInfo info{XR_TYPE_VIEW_LOCATE_INFO};
  info.viewConfigurationType = kTwoEyes;
  info.displayTime = time;
  info.space = stage_;
  XrViewState state{XR_TYPE_VIEW_STATE};
  Eyes out{{}, {XrView{XR_TYPE_VIEW}, XrView{XR_TYPE_VIEW}}};
  uint32_t count = 0;
  if (!done("xrLocateViews", xrLocateViews(session_, &info, &state, 2, &count, out.views.data()))) return std::nullopt;
  if (count != 2 || (state.viewStateFlags & kSeen) != kSeen) return std::nullopt;
  for (size_t eye = 0; eye < 2; ++eye) {
    out.cameras[eye] = eye_camera(out.views[eye], origin_, width_, height_, near_m_);
    if (const Status s = geometry::validate(out.cameras[eye]); !s) {
      done(Status(Error{"the runtime tells an eye that none can be: " + s.error().text}));
      return std::nullopt;
    }
  }
  return out;
}

std::optional<geometry::Pose> HeadsetSession::locate_head(XrTime time) const {
  XrSpaceLocation location{XR_TYPE_SPACE_LOCATION};
  if (XR_FAILED(xrLocateSpace(head_, stage_, time, &location)) ||
      (location.locationFlags & kHeadLocated) != kHeadLocated)
    return std::nullopt;
  return room_pose(location.pose, origin_);
}

HandRays HeadsetSession::locate_hands(XrTime time) {
  auto rays = hands_->locate(stage_, origin_, time);
  if (!rays) done(Status(rays.error()));
  return rays ? *rays : HandRays{};
}

void HeadsetSession::put(int eye, const image::View& picture) {
  if (over_ || !done(colour_[size_t(eye)].put_colour(picture)) || depth_.empty()) return;
  done(depth_[size_t(eye)].put_depth(picture, {near_m_, kFar_m}));
}

void HeadsetSession::end_frame(const Frame& frame, const Eyes* eyes) {
  if (over_) return;
  std::array<XrCompositionLayerDepthInfoKHR, 2> depth;
  std::array<XrCompositionLayerProjectionView, 2> views;
  XrCompositionLayerProjection layer{XR_TYPE_COMPOSITION_LAYER_PROJECTION};
  for (size_t eye = 0; eyes && eye < 2; ++eye) {
    views[eye] = {XR_TYPE_COMPOSITION_LAYER_PROJECTION_VIEW, nullptr, eyes->views[eye].pose, eyes->views[eye].fov,
                  colour_[eye].sub_image()};
    if (depth_.empty()) continue;
    depth[eye] = {XR_TYPE_COMPOSITION_LAYER_DEPTH_INFO_KHR,
                  nullptr,
                  depth_[eye].sub_image(),
                  0,
                  1,
                  float(near_m_),
                  float(kFar_m)};
    views[eye].next = &depth[eye];
  }
  layer.space = stage_;
  layer.viewCount = 2;
  layer.views = views.data();
  const XrCompositionLayerBaseHeader* layers[]{reinterpret_cast<const XrCompositionLayerBaseHeader*>(&layer)};
  XrFrameEndInfo info{XR_TYPE_FRAME_END_INFO};
  info.displayTime = frame.display_time;
  info.environmentBlendMode = system_.blend_mode();
  info.layerCount = eyes ? 1 : 0;
  info.layers = eyes ? layers : nullptr;
  done("xrEndFrame", xrEndFrame(session_, &info));
}

}  // namespace telesplat::viewer
