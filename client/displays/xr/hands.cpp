#include "client/displays/xr/hands.h"

#include <cstring>
#include <string>

#include "client/displays/xr/xr_space.h"

namespace telesplat::viewer {
namespace {

constexpr const char* kHands[]{"/user/hand/left", "/user/hand/right"};
constexpr XrSpaceLocationFlags kLocated =
    XR_SPACE_LOCATION_POSITION_VALID_BIT | XR_SPACE_LOCATION_ORIENTATION_VALID_BIT;

// Kinds of controllers, and what of each selects. A runtime shows others as one of these.
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
  // A runtime need not know all kinds; the first, which all know, must work.
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
  if (synced == XR_SESSION_NOT_FOCUSED) return out;  // the hands are somebody else's
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

}  // namespace telesplat::viewer
