// Controllers, as far as an application needs them for pointing and choosing.
#include <algorithm>
#include <string_view>

#include "tests/support/xr/calls.h"
#include "tests/support/xr/runtime.h"

namespace telesplat::xr_test::calls {
namespace {

using Of = Runtime::Of;
Runtime& runtime() { return Runtime::get(); }

constexpr std::string_view kProfile = "/interaction_profiles/khr/simple_controller";

bool focused(const Runtime& r) { return r.session->state == XR_SESSION_STATE_FOCUSED; }
bool active(const Runtime& r) { return focused(r) && r.config.hands && r.session->attached && r.profile == kProfile; }

template <class State>
XrResult state_of(const char* name, const XrActionStateGetInfo* info, XrActionType type, State* out) {
  Runtime& r = runtime();
  return r.call(name, Of::kSession, [&] {
    const auto found = r.actions.find(info->action);
    if (found == r.actions.end()) return r.wrong(XR_ERROR_HANDLE_INVALID, "no such action");
    if (found->second.type != type) return r.wrong(XR_ERROR_ACTION_TYPE_MISMATCH, found->second.name);
    if (!r.session->attached) return r.wrong(XR_ERROR_ACTIONSET_NOT_ATTACHED, found->second.name);
    out->isActive = active(r) ? XR_TRUE : XR_FALSE;
    return XR_SUCCESS;
  });
}

}  // namespace

XrResult CreateActionSet(XrInstance, const XrActionSetCreateInfo* info, XrActionSet* set) {
  Runtime& r = runtime();
  return r.call("xrCreateActionSet", Of::kInstance, [&] {
    if (info->actionSetName[0] == 0) return r.wrong(XR_ERROR_NAME_INVALID, "no name");
    if (info->localizedActionSetName[0] == 0) return r.wrong(XR_ERROR_LOCALIZED_NAME_INVALID, "no name for people");
    *set = r.new_handle<XrActionSet>();
    r.action_sets[*set] = info->actionSetName;
    return XR_SUCCESS;
  });
}

XrResult DestroyActionSet(XrActionSet set) {
  Runtime& r = runtime();
  return r.call("xrDestroyActionSet", Of::kInstance, [&] {
    return r.action_sets.erase(set) == 1 ? XR_SUCCESS : r.wrong(XR_ERROR_HANDLE_INVALID, "no such set");
  });
}

XrResult CreateAction(XrActionSet set, const XrActionCreateInfo* info, XrAction* action) {
  Runtime& r = runtime();
  return r.call("xrCreateAction", Of::kInstance, [&] {
    if (!r.action_sets.contains(set)) return r.wrong(XR_ERROR_HANDLE_INVALID, "no such set");
    if (info->actionName[0] == 0) return r.wrong(XR_ERROR_NAME_INVALID, "no name");
    if (info->localizedActionName[0] == 0) return r.wrong(XR_ERROR_LOCALIZED_NAME_INVALID, "no name for people");
    for (uint32_t i = 0; i < info->countSubactionPaths; ++i)
      if (info->subactionPaths[i] == XR_NULL_PATH || info->subactionPaths[i] >= r.paths.size())
        return r.wrong(XR_ERROR_PATH_INVALID, "no such path");
    *action = r.new_handle<XrAction>();
    r.actions[*action] = {info->actionName, info->actionType};
    return XR_SUCCESS;
  });
}

XrResult DestroyAction(XrAction action) {
  Runtime& r = runtime();
  return r.call("xrDestroyAction", Of::kInstance, [&] {
    return r.actions.erase(action) == 1 ? XR_SUCCESS : r.wrong(XR_ERROR_HANDLE_INVALID, "no such action");
  });
}

// Knows only the simple kind of controllers.
XrResult SuggestInteractionProfileBindings(XrInstance, const XrInteractionProfileSuggestedBinding* info) {
  Runtime& r = runtime();
  return r.call("xrSuggestInteractionProfileBindings", Of::kInstance, [&] {
    if (r.session && r.session->attached) return r.wrong(XR_ERROR_ACTIONSETS_ALREADY_ATTACHED, "too late");
    if (info->interactionProfile >= r.paths.size()) return r.wrong(XR_ERROR_PATH_INVALID, "no such path");
    if (r.paths[info->interactionProfile] != kProfile) return XR_ERROR_PATH_UNSUPPORTED;
    for (uint32_t i = 0; i < info->countSuggestedBindings; ++i) {
      const auto& [action, path] = info->suggestedBindings[i];
      if (!r.actions.contains(action) || path >= r.paths.size())
        return r.wrong(XR_ERROR_PATH_UNSUPPORTED, "a binding of no action or path");
      const bool hand =
          r.paths[path].starts_with("/user/hand/left/input/") || r.paths[path].starts_with("/user/hand/right/input/");
      if (!hand) return r.wrong(XR_ERROR_PATH_UNSUPPORTED, r.paths[path]);
    }
    r.profile = kProfile;
    return XR_SUCCESS;
  });
}

XrResult AttachSessionActionSets(XrSession, const XrSessionActionSetsAttachInfo* info) {
  Runtime& r = runtime();
  return r.call("xrAttachSessionActionSets", Of::kSession, [&] {
    if (r.session->attached) return r.wrong(XR_ERROR_ACTIONSETS_ALREADY_ATTACHED, "twice");
    for (uint32_t i = 0; i < info->countActionSets; ++i)
      if (!r.action_sets.contains(info->actionSets[i])) return r.wrong(XR_ERROR_HANDLE_INVALID, "no such set");
    r.session->attached = true;
    return XR_SUCCESS;
  });
}

XrResult GetCurrentInteractionProfile(XrSession, XrPath, XrInteractionProfileState* out) {
  Runtime& r = runtime();
  return r.call("xrGetCurrentInteractionProfile", Of::kSession, [&] {
    const auto found = std::find(r.paths.begin(), r.paths.end(), r.profile);
    out->interactionProfile = r.profile.empty() ? XR_NULL_PATH : XrPath(found - r.paths.begin());
    return XR_SUCCESS;
  });
}

XrResult SyncActions(XrSession, const XrActionsSyncInfo* info) {
  Runtime& r = runtime();
  return r.call("xrSyncActions", Of::kSession, [&] {
    if (!r.session->attached) return r.wrong(XR_ERROR_ACTIONSET_NOT_ATTACHED, "before they are attached");
    for (uint32_t i = 0; i < info->countActiveActionSets; ++i)
      if (!r.action_sets.contains(info->activeActionSets[i].actionSet))
        return r.wrong(XR_ERROR_HANDLE_INVALID, "no such set");
    return focused(r) ? XR_SUCCESS : XR_SESSION_NOT_FOCUSED;
  });
}

XrResult GetActionStateBoolean(XrSession, const XrActionStateGetInfo* info, XrActionStateBoolean* out) {
  const XrResult result = state_of("xrGetActionStateBoolean", info, XR_ACTION_TYPE_BOOLEAN_INPUT, out);
  const Runtime& r = runtime();
  const auto& span = r.config.pressed_s;
  const double t_s = r.since_begin_s();
  // The right hand presses.
  const bool right = info->subactionPath < r.paths.size() && r.paths[info->subactionPath] == "/user/hand/right";
  out->currentState =
      result == XR_SUCCESS && out->isActive && right && span && t_s >= span->first && t_s < span->second;
  return result;
}

XrResult GetActionStatePose(XrSession, const XrActionStateGetInfo* info, XrActionStatePose* out) {
  return state_of("xrGetActionStatePose", info, XR_ACTION_TYPE_POSE_INPUT, out);
}

}  // namespace telesplat::xr_test::calls
