#include "client/displays/xr/hands.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <utility>

#include "client/displays/xr/xr_system.h"

namespace telesplat::viewer {
namespace {

constexpr const char* kHands[]{"/user/hand/left", "/user/hand/right"};
constexpr XrSpaceLocationFlags kLocated =
    XR_SPACE_LOCATION_POSITION_VALID_BIT | XR_SPACE_LOCATION_ORIENTATION_VALID_BIT;

// Kinds of controllers, and the control that selects on each. A runtime presents others as one of these.
struct Profile {
  const char *name, *press;
};
constexpr Profile kProfiles[]{
    {"/interaction_profiles/khr/simple_controller", "/input/select/click"},
    {"/interaction_profiles/oculus/touch_controller", "/input/trigger/value"},
    {"/interaction_profiles/valve/index_controller", "/input/trigger/value"},
    {"/interaction_profiles/htc/vive_controller", "/input/trigger/click"},
    {"/interaction_profiles/microsoft/motion_controller", "/input/trigger/value"},
};

constexpr int kSteps = 512;            // steps along a ray
constexpr int kHalvings = 12;          // halvings of the step in which it hits something
constexpr double kThick_m = 0.1;       // thickness behind visible points; a ray farther behind passes them
constexpr double kOnSurface_m = 2e-3;  // a surface does not hide a line that ends on it

struct Pixel {
  size_t at;
  int x, y;
  double depth_m;
};

std::optional<Pixel> pixel_of(const image::View& picture, const geometry::Camera::PixelTransform& t, double near_m,
                              const glm::dvec3& point) {
  const glm::dvec4 p(point, 1);
  const double w = glm::dot(t.w, p);
  if (!(w > near_m)) return std::nullopt;
  const double x = std::floor(glm::dot(t.x, p) / w), y = std::floor(glm::dot(t.y, p) / w);
  if (!(x >= 0 && y >= 0 && x < picture.width && y < picture.height)) return std::nullopt;
  return Pixel{size_t(y) * size_t(picture.width) + size_t(x), int(x), int(y), w};
}

}  // namespace

Result<XrPath> Hands::path(const std::string& text) const {
  XrPath out = XR_NULL_PATH;
  const Status s = system_.check("xrStringToPath", xrStringToPath(system_.instance(), text.c_str(), &out));
  if (!s) return s.error();
  return out;
}

Status Hands::make_action(const char* name, const char* shown, XrActionType type, XrAction& action) {
  XrActionCreateInfo info{XR_TYPE_ACTION_CREATE_INFO};
  std::strncpy(info.actionName, name, XR_MAX_ACTION_NAME_SIZE - 1);
  std::strncpy(info.localizedActionName, shown, XR_MAX_LOCALIZED_ACTION_NAME_SIZE - 1);
  info.actionType = type;
  info.countSubactionPaths = uint32_t(hands_.size());
  info.subactionPaths = hands_.data();
  return system_.check("xrCreateAction", xrCreateAction(set_, &info, &action));
}

Status Hands::make_actions() {
  for (size_t hand = 0; hand < hands_.size(); ++hand) {
    const auto named = path(kHands[hand]);
    if (!named) return named.error();
    hands_[hand] = *named;
  }
  XrActionSetCreateInfo set{XR_TYPE_ACTION_SET_CREATE_INFO};
  std::strncpy(set.actionSetName, "hands", XR_MAX_ACTION_SET_NAME_SIZE - 1);
  std::strncpy(set.localizedActionSetName, "Hands", XR_MAX_LOCALIZED_ACTION_SET_NAME_SIZE - 1);
  if (const Status s = system_.check("xrCreateActionSet", xrCreateActionSet(system_.instance(), &set, &set_)); !s)
    return s;
  if (const Status s = make_action("aim", "Point", XR_ACTION_TYPE_POSE_INPUT, aim_); !s) return s;
  return make_action("press", "Choose", XR_ACTION_TYPE_BOOLEAN_INPUT, press_);
}

Status Hands::suggest(const char* profile, const char* press) {
  const auto of = path(profile);
  if (!of) return of.error();
  XrActionSuggestedBinding bindings[4];
  for (size_t hand = 0; hand < 2; ++hand) {
    const auto aim = path(std::string(kHands[hand]) + "/input/aim/pose");
    const auto pressed = path(std::string(kHands[hand]) + press);
    if (!aim || !pressed) return aim ? pressed.error() : aim.error();
    bindings[2 * hand] = {aim_, *aim};
    bindings[2 * hand + 1] = {press_, *pressed};
  }
  XrInteractionProfileSuggestedBinding info{XR_TYPE_INTERACTION_PROFILE_SUGGESTED_BINDING};
  info.interactionProfile = *of;
  info.countSuggestedBindings = 4;
  info.suggestedBindings = bindings;
  return system_.check("xrSuggestInteractionProfileBindings",
                       xrSuggestInteractionProfileBindings(system_.instance(), &info));
}

Status Hands::attach() {
  for (size_t hand = 0; hand < hands_.size(); ++hand) {
    XrActionSpaceCreateInfo info{XR_TYPE_ACTION_SPACE_CREATE_INFO};
    info.action = aim_;
    info.subactionPath = hands_[hand];
    info.poseInActionSpace = {{0, 0, 0, 1}, {0, 0, 0}};
    if (const Status s = system_.check("xrCreateActionSpace", xrCreateActionSpace(session_, &info, &spaces_[hand])); !s)
      return s;
  }
  XrSessionActionSetsAttachInfo info{XR_TYPE_SESSION_ACTION_SETS_ATTACH_INFO};
  info.countActionSets = 1;
  info.actionSets = &set_;
  return system_.check("xrAttachSessionActionSets", xrAttachSessionActionSets(session_, &info));
}

Result<std::unique_ptr<Hands>> Hands::make(const XrSystem& system, XrSession session) {
  std::unique_ptr<Hands> out(new Hands(system, session));
  if (const Status s = out->make_actions(); !s) return s.error();
  // A runtime need not know all kinds; the first kind must work, because all runtimes know it.
  for (const Profile& profile : kProfiles)
    if (const Status s = out->suggest(profile.name, profile.press); !s && &profile == kProfiles) return s.error();
  if (const Status s = out->attach(); !s) return s.error();
  return out;
}

Hands::~Hands() {
  for (const XrSpace space : spaces_)
    if (space != XR_NULL_HANDLE) xrDestroySpace(space);
  for (const XrAction action : {aim_, press_})
    if (action != XR_NULL_HANDLE) xrDestroyAction(action);
  if (set_ != XR_NULL_HANDLE) xrDestroyActionSet(set_);
}

Result<HandRays> Hands::locate(XrSpace space, const glm::dvec3& origin, XrTime time) {
  HandRays out;
  const XrActiveActionSet active{set_, XR_NULL_PATH};
  XrActionsSyncInfo sync{XR_TYPE_ACTIONS_SYNC_INFO};
  sync.countActiveActionSets = 1;
  sync.activeActionSets = &active;
  const XrResult synced = xrSyncActions(session_, &sync);
  if (const Status s = system_.check("xrSyncActions", synced); !s) return s.error();
  if (synced == XR_SESSION_NOT_FOCUSED) return out;  // another application has the hands
  for (size_t hand = 0; hand < hands_.size(); ++hand) {
    XrActionStateGetInfo get{XR_TYPE_ACTION_STATE_GET_INFO};
    get.subactionPath = hands_[hand];
    get.action = aim_;
    XrActionStatePose pose{XR_TYPE_ACTION_STATE_POSE};
    if (const Status s = system_.check("xrGetActionStatePose", xrGetActionStatePose(session_, &get, &pose)); !s)
      return s.error();
    if (!pose.isActive) continue;
    XrSpaceLocation location{XR_TYPE_SPACE_LOCATION};
    if (const Status s = system_.check("xrLocateSpace", xrLocateSpace(spaces_[hand], space, time, &location)); !s)
      return s.error();
    if ((location.locationFlags & kLocated) != kLocated) continue;
    get.action = press_;
    XrActionStateBoolean press{XR_TYPE_ACTION_STATE_BOOLEAN};
    if (const Status s = system_.check("xrGetActionStateBoolean", xrGetActionStateBoolean(session_, &get, &press)); !s)
      return s.error();
    out[hand] = HandRay{room_pose(location.pose, origin), press.isActive && press.currentState};
  }
  return out;
}

std::optional<glm::dvec3> first_hit(const image::View& picture, const geometry::Camera& camera, const glm::dvec3& from,
                                    const glm::dvec3& direction) {
  const auto transform = camera.room_to_pixel();
  const auto behind = [&](double s) {
    const auto pixel = pixel_of(picture, transform, camera.near_m, from + s * direction);
    if (!pixel) return false;
    const double beyond = pixel->depth_m - double(picture.depth_m[pixel->at]);
    return beyond >= 0 && beyond < kThick_m;
  };
  const double step = kFarthest_m / kSteps;
  for (int i = 1; i <= kSteps; ++i) {
    if (!behind(i * step)) continue;
    double before = (i - 1) * step, after = i * step;
    for (int n = 0; n < kHalvings; ++n) {
      const double middle = 0.5 * (before + after);
      (behind(middle) ? after : before) = middle;
    }
    return from + after * direction;
  }
  return std::nullopt;
}

void draw_line(image::View& picture, const geometry::Camera& camera, const glm::dvec3& from, const glm::dvec3& to,
               uint32_t colour) {
  const auto transform = camera.room_to_pixel();
  const auto w_of = [&](const glm::dvec3& p) { return glm::dot(transform.w, glm::dvec4(p, 1)); };
  // Cuts off the part behind the near plane.
  glm::dvec3 a = from, b = to;
  const double near_m = 1.001 * camera.near_m, wa = w_of(a), wb = w_of(b);
  if (!(wa > near_m) && !(wb > near_m)) return;
  if (!(wa > near_m)) a = glm::mix(a, b, (near_m - wa) / (wb - wa));
  if (!(wb > near_m)) b = glm::mix(b, a, (near_m - wb) / (wa - wb));
  // One step a pixel, as if the line crossed the whole picture: even steps on the picture are uneven ones in the room.
  const int steps = 2 * std::max(picture.width, picture.height);
  const double w0 = w_of(a), w1 = w_of(b);
  const auto place = [&](const glm::dvec3& p, double w) {
    return glm::dvec2(glm::dot(transform.x, glm::dvec4(p, 1)), glm::dot(transform.y, glm::dvec4(p, 1))) / w;
  };
  // Only its part inside the picture is drawn.
  const glm::dvec2 at_a = place(a, w0), along = place(b, w1) - at_a, size(picture.width, picture.height);
  double begin = 0, end = 1;
  for (int axis = 0; axis < 2; ++axis) {
    if (std::abs(along[axis]) < 1e-9) continue;
    const double s0 = -at_a[axis] / along[axis], s1 = (size[axis] - at_a[axis]) / along[axis];
    begin = std::max(begin, std::min(s0, s1)), end = std::min(end, std::max(s0, s1));
  }
  size_t last = ~size_t{0};
  for (int i = 0; i <= steps && begin <= end; ++i) {
    const double s = begin + (end - begin) * i / steps, t = s * w0 / ((1 - s) * w1 + s * w0);
    const auto pixel = pixel_of(picture, transform, camera.near_m, glm::mix(a, b, t));
    if (!pixel || std::exchange(last, pixel->at) == pixel->at) continue;
    for (int y = std::max(pixel->y - 1, 0); y <= std::min(pixel->y + 1, picture.height - 1); ++y)
      for (int x = std::max(pixel->x - 1, 0); x <= std::min(pixel->x + 1, picture.width - 1); ++x) {
        const size_t at = size_t(y) * size_t(picture.width) + size_t(x);
        if (pixel->depth_m > double(picture.depth_m[at]) + kOnSurface_m) continue;
        picture.colour[at] = colour;
        picture.depth_m[at] = std::min(picture.depth_m[at], float(pixel->depth_m));
      }
  }
}

}  // namespace telesplat::viewer
