#include "tests/support/xr/runtime.h"

#include <fmt/format.h>

#include "common/core/clock.h"

namespace telesplat::xr_test {

Runtime& Runtime::get() {
  static Runtime runtime;
  return runtime;
}

double Runtime::since_begin_s() const { return began_s ? monotonic_s() - *began_s : -1; }

XrResult Runtime::wrong(XrResult result, const std::string& why) {
  if (recorder) recorder->mistake(fmt::format("{}: {}", calling_, why));
  return result;
}

XrResult Runtime::refusal(const char* name, Of of) {
  if (of == Of::kNothing) return XR_SUCCESS;
  const bool destroys = std::string_view(name).starts_with("xrDestroy");
  if (!exists) return XR_ERROR_HANDLE_INVALID;
  if (gone && !destroys) return XR_ERROR_INSTANCE_LOST;
  if (config.fails == name && !failed_ && since_begin_s() >= config.fails_s) {
    failed_ = true;
    return XR_ERROR_RUNTIME_FAILURE;
  }
  if (of == Of::kInstance) return XR_SUCCESS;
  if (!session) return wrong(XR_ERROR_HANDLE_INVALID, "there is no session");
  return session->lost && !destroys ? XR_ERROR_SESSION_LOST : XR_SUCCESS;
}

void Runtime::go_to(XrSessionState state) {
  session->state = state;
  XrEventDataSessionStateChanged event{XR_TYPE_EVENT_DATA_SESSION_STATE_CHANGED};
  event.session = session_handle();
  event.state = state;
  event.time = to_time(monotonic_s());
  push(event);
}

void Runtime::tick() {
  const double t_s = since_begin_s();
  const auto due = [&](const std::optional<double>& at, bool& told) {
    return at && t_s >= *at && !std::exchange(told, true);
  };
  if (t_s < 0 || !session || session->lost) return;
  if (due(config.recentre_s, recentre_told_)) {
    XrEventDataReferenceSpaceChangePending event{XR_TYPE_EVENT_DATA_REFERENCE_SPACE_CHANGE_PENDING};
    event.session = session_handle();
    event.referenceSpaceType = config.stage ? XR_REFERENCE_SPACE_TYPE_STAGE : XR_REFERENCE_SPACE_TYPE_LOCAL;
    event.changeTime = to_time(*began_s + *config.recentre_s);
    event.poseValid = XR_TRUE;
    event.poseInPreviousSpace = to_xr({config.recentre_by_m, {1, 0, 0, 0}});
    push(event);
  }
  if (config.hidden_s && session->shown) {
    if (due(config.hidden_s->first, hidden_told_))
      go_to(XR_SESSION_STATE_VISIBLE), go_to(XR_SESSION_STATE_SYNCHRONIZED);
    if (due(config.hidden_s->second, shown_told_)) go_to(XR_SESSION_STATE_VISIBLE), go_to(XR_SESSION_STATE_FOCUSED);
  }
  if (due(config.exit_s, exit_told_)) {
    session->exits = true;
    go_to(XR_SESSION_STATE_STOPPING);
  }
  if (due(config.lost_s, lost_told_)) {
    go_to(XR_SESSION_STATE_LOSS_PENDING);
    session->lost = true;
  }
  if (due(config.gone_s, gone_told_)) {
    XrEventDataInstanceLossPending event{XR_TYPE_EVENT_DATA_INSTANCE_LOSS_PENDING};
    event.lossTime = to_time(monotonic_s());
    push(event);
  }
}

WithContext::WithContext(const Session& s)
    : display_(s.display),
      before_(eglGetCurrentContext()),
      draw_(eglGetCurrentSurface(EGL_DRAW)),
      read_(eglGetCurrentSurface(EGL_READ)) {
  if (before_ == s.context) return;
  changed_ = eglMakeCurrent(s.display, EGL_NO_SURFACE, EGL_NO_SURFACE, s.context);
}

WithContext::~WithContext() {
  if (changed_) eglMakeCurrent(display_, draw_, read_, before_);
}

XrPosef to_xr(const geometry::Pose& p) {
  const auto& q = p.orientation;
  const auto& v = p.position_room;
  return {{float(q.x), float(q.y), float(q.z), float(q.w)}, {float(v.x), float(v.y), float(v.z)}};
}

geometry::Pose from_xr(const XrPosef& p) {
  const auto& q = p.orientation;
  return {{p.position.x, p.position.y, p.position.z}, glm::normalize(glm::dquat(q.w, q.x, q.y, q.z))};
}

geometry::Pose inverse(const geometry::Pose& p) {
  const glm::dquat back = glm::conjugate(p.orientation);
  return {-(back * p.position_room), back};
}

geometry::Pose combined(const geometry::Pose& a, const geometry::Pose& b) {
  return {a.position_room + a.orientation * b.position_room, glm::normalize(a.orientation * b.orientation)};
}

}  // namespace telesplat::xr_test
