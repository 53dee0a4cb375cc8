// Spaces, and the poses of the head, its eyes and the hands in them.
#include "tests/support/xr/spaces.h"

#include <array>
#include <cmath>

#include "tests/support/xr/calls.h"
#include "tests/support/xr/runtime.h"

namespace telesplat::xr_test {
namespace {

constexpr double kRadians = 3.14159265358979323846 / 180;
constexpr double kAsymmetry_rad = 4 * kRadians;  // an eye sees farther outwards than to the nose
const glm::dvec3 kHandFromHead[]{{-0.2, -0.25, -0.2}, {0.2, -0.25, -0.2}};

}  // namespace

geometry::Pose head_at(const Runtime& r, double t_s) {
  geometry::Pose out = r.config.head.at(r.began_s ? t_s - *r.began_s : 0);
  if (r.config.recentre_s && r.began_s && t_s >= *r.began_s + *r.config.recentre_s)
    out.position_room -= r.config.recentre_by_m;
  return out;
}

geometry::Pose hand_at(const Runtime& r, int hand, double t_s) {
  const geometry::Pose head = head_at(r, t_s);
  const geometry::Pose at = combined(head, {kHandFromHead[hand], {1, 0, 0, 0}});
  // It points at the place straight before the head, 0.7 m away.
  const glm::dvec3 target = head.position_room + head.orientation * glm::dvec3(0, 0, -0.7);
  return geometry::look_at(at.position_room, target);
}

XrView eye_at(const Runtime& r, int eye, const geometry::Pose& head) {
  const auto& c = r.config;
  const double side = eye == 0 ? -1 : 1, half = 0.5 * c.fov_deg * kRadians;
  XrView out{XR_TYPE_VIEW};
  const glm::dquat outwards = glm::angleAxis(-side * c.cant_deg * kRadians, glm::dvec3(0, 1, 0));
  out.pose = to_xr(combined(head, {{side * 0.5 * c.eye_distance_m, 0, 0}, outwards}));
  out.fov = {float(-half + side * kAsymmetry_rad), float(half + side * kAsymmetry_rad), float(half), float(-half)};
  return out;
}

bool tracked(const Runtime& r) {
  const auto& span = r.config.untracked_s;
  const double t_s = r.since_begin_s();
  return !span || t_s < span->first || t_s >= span->second;
}

namespace calls {
namespace {

using Of = Runtime::Of;
Runtime& runtime() { return Runtime::get(); }

// Returns a space's pose in the stage.
geometry::Pose pose_of(const Runtime& r, const Space& space, double t_s) {
  switch (space.kind) {
    case Space::Kind::kView:
      return combined(head_at(r, t_s), space.offset);
    case Space::Kind::kHand:
      return combined(hand_at(r, space.hand, t_s), space.offset);
    default:
      return space.offset;
  }
}

}  // namespace

XrResult EnumerateReferenceSpaces(XrSession, uint32_t capacity, uint32_t* count, XrReferenceSpaceType* out) {
  Runtime& r = runtime();
  return r.call("xrEnumerateReferenceSpaces", Of::kSession, [&] {
    std::vector<XrReferenceSpaceType> types{XR_REFERENCE_SPACE_TYPE_VIEW, XR_REFERENCE_SPACE_TYPE_LOCAL};
    if (r.config.stage) types.push_back(XR_REFERENCE_SPACE_TYPE_STAGE);
    return hand_out(types, capacity, count, out);
  });
}

XrResult CreateReferenceSpace(XrSession, const XrReferenceSpaceCreateInfo* info, XrSpace* space) {
  Runtime& r = runtime();
  return r.call("xrCreateReferenceSpace", Of::kSession, [&] {
    Space made{.offset = from_xr(info->poseInReferenceSpace)};
    if (info->referenceSpaceType == XR_REFERENCE_SPACE_TYPE_VIEW)
      made.kind = Space::Kind::kView;
    else if (info->referenceSpaceType == XR_REFERENCE_SPACE_TYPE_LOCAL)
      made.kind = Space::Kind::kLocal;
    else if (info->referenceSpaceType != XR_REFERENCE_SPACE_TYPE_STAGE || !r.config.stage)
      return XR_ERROR_REFERENCE_SPACE_UNSUPPORTED;
    *space = r.new_handle<XrSpace>();
    r.session->spaces[*space] = made;
    return XR_SUCCESS;
  });
}

XrResult GetReferenceSpaceBoundsRect(XrSession, XrReferenceSpaceType, XrExtent2Df* bounds) {
  return runtime().call("xrGetReferenceSpaceBoundsRect", Of::kSession, [&] {
    *bounds = {3, 3};
    return XR_SUCCESS;
  });
}

XrResult CreateActionSpace(XrSession, const XrActionSpaceCreateInfo* info, XrSpace* space) {
  Runtime& r = runtime();
  return r.call("xrCreateActionSpace", Of::kSession, [&] {
    const auto action = r.actions.find(info->action);
    if (action == r.actions.end()) return r.wrong(XR_ERROR_HANDLE_INVALID, "no such action");
    if (action->second.type != XR_ACTION_TYPE_POSE_INPUT) return r.wrong(XR_ERROR_ACTION_TYPE_MISMATCH, "not a pose");
    if (info->subactionPath >= r.paths.size()) return r.wrong(XR_ERROR_PATH_INVALID, "no such path");
    *space = r.new_handle<XrSpace>();
    r.session->spaces[*space] = {Space::Kind::kHand, r.paths[info->subactionPath] == "/user/hand/right",
                                 from_xr(info->poseInActionSpace)};
    return XR_SUCCESS;
  });
}

XrResult LocateSpace(XrSpace space, XrSpace base, XrTime time, XrSpaceLocation* out) {
  Runtime& r = runtime();
  return r.call("xrLocateSpace", Of::kSession, [&] {
    const auto a = r.session->spaces.find(space), b = r.session->spaces.find(base);
    if (a == r.session->spaces.end() || b == r.session->spaces.end())
      return r.wrong(XR_ERROR_HANDLE_INVALID, "no such space");
    if (time <= 0) return r.wrong(XR_ERROR_TIME_INVALID, "no time");
    const bool hand = a->second.kind == Space::Kind::kHand;
    out->locationFlags = 0;
    if (!tracked(r) || (hand && !r.config.hands)) return XR_SUCCESS;
    const double t_s = to_s(time);
    out->pose = to_xr(combined(inverse(pose_of(r, b->second, t_s)), pose_of(r, a->second, t_s)));
    out->locationFlags = XR_SPACE_LOCATION_POSITION_VALID_BIT | XR_SPACE_LOCATION_ORIENTATION_VALID_BIT |
                         XR_SPACE_LOCATION_POSITION_TRACKED_BIT | XR_SPACE_LOCATION_ORIENTATION_TRACKED_BIT;
    return XR_SUCCESS;
  });
}

XrResult DestroySpace(XrSpace space) {
  Runtime& r = runtime();
  return r.call("xrDestroySpace", Of::kSession, [&] {
    return r.session->spaces.erase(space) == 1 ? XR_SUCCESS : r.wrong(XR_ERROR_HANDLE_INVALID, "no such space");
  });
}

XrResult LocateViews(XrSession, const XrViewLocateInfo* info, XrViewState* state, uint32_t capacity, uint32_t* count,
                     XrView* views) {
  Runtime& r = runtime();
  return r.call("xrLocateViews", Of::kSession, [&] {
    const auto base = r.session->spaces.find(info->space);
    if (base == r.session->spaces.end()) return r.wrong(XR_ERROR_HANDLE_INVALID, "no such space");
    if (info->displayTime <= 0) return r.wrong(XR_ERROR_TIME_INVALID, "no time");
    const double t_s = to_s(info->displayTime);
    const geometry::Pose head = combined(inverse(pose_of(r, base->second, t_s)), head_at(r, t_s));
    state->viewStateFlags = tracked(r) ? XR_VIEW_STATE_POSITION_VALID_BIT | XR_VIEW_STATE_ORIENTATION_VALID_BIT |
                                             XR_VIEW_STATE_POSITION_TRACKED_BIT | XR_VIEW_STATE_ORIENTATION_TRACKED_BIT
                                       : 0;
    return hand_out(std::array{eye_at(r, 0, head), eye_at(r, 1, head)}, capacity, count, views);
  });
}

}  // namespace calls
}  // namespace telesplat::xr_test
