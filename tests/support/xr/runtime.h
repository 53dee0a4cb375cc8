// The runtime's state: one instance, one session at a time. Every call goes through call(), which counts it, notes
// mistakes, and triggers faults.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tests/support/xr/config.h"
#include "tests/support/xr/pacing.h"
#include "tests/support/xr/recorder.h"
#include "tests/support/xr/xr.h"

namespace telesplat::xr_test {

struct Space {
  enum class Kind { kStage, kLocal, kView, kHand } kind = Kind::kStage;
  int hand = 0;
  geometry::Pose offset;  ///< the space's pose in its reference
};

struct Swapchain {
  int width = 0, height = 0;
  bool depth = false;
  std::vector<uint32_t> textures;
  uint32_t next = 0;
  enum class Stage { kFree, kAcquired, kWaited } stage = Stage::kFree;
  std::optional<uint32_t> released;  ///< the image that a layer shows
};

struct Action {
  std::string name;
  XrActionType type;
};

struct Session {
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLContext context = EGL_NO_CONTEXT;
  bool running = false, lost = false, shown = false, attached = false, exits = false;
  XrSessionState state = XR_SESSION_STATE_UNKNOWN;
  std::optional<Pacing> pacing;
  enum class Turn { kWait, kBegin, kEnd } turn = Turn::kWait;
  double display_s = 0;
  bool told_to_render = true;  // result of the last xrWaitFrame
  uint64_t begun = 0;
  std::map<XrSpace, Space> spaces;
  std::map<XrSwapchain, Swapchain> swapchains;
};

class Runtime {
 public:
  static Runtime& get();

  // ---- instance ----
  bool exists = false, gone = false, requirements_asked = false;
  std::set<std::string> enabled;
  Config config;
  std::unique_ptr<Recorder> recorder;
  std::deque<XrEventDataBuffer> events;
  std::vector<std::string> paths{"/"};  ///< XrPath is an index
  std::map<XrActionSet, std::string> action_sets;
  std::map<XrAction, Action> actions;
  std::string profile;  ///< the profile whose bindings apply
  std::unique_ptr<Session> session;
  std::optional<double> began_s;  ///< begin of the first session

  XrInstance instance() const { return reinterpret_cast<XrInstance>(uintptr_t{0x7e1e}); }
  XrSession session_handle() const { return reinterpret_cast<XrSession>(uintptr_t{0x5e55}); }
  template <class Handle>
  Handle new_handle() {
    return reinterpret_cast<Handle>(uintptr_t(++handles_));
  }

  /// Seconds since the first session began; negative: no session has begun.
  double since_begin_s() const;
  /// Triggers the events and faults that are due.
  void tick();
  void go_to(XrSessionState state);
  template <class Event>
  void push(const Event& event);

  /// Runs `body` as the call `name`. `of`: the object that must exist for it.
  enum class Of { kNothing, kInstance, kSession };
  template <class Body>
  XrResult call(const char* name, Of of, Body body);
  /// Notes a mistake of the caller, and returns its result.
  XrResult wrong(XrResult result, const std::string& why);

 private:
  XrResult refusal(const char* name, Of of);
  std::mutex mutex_;
  uintptr_t handles_ = 0x1000;
  std::string calling_;
  bool lost_told_ = false, gone_told_ = false, exit_told_ = false, hidden_told_ = false, shown_told_ = false,
       recentre_told_ = false, failed_ = false;
};

/// Makes the session's context current for a scope.
class WithContext {
 public:
  explicit WithContext(const Session& session);
  ~WithContext();
  WithContext(const WithContext&) = delete;
  WithContext& operator=(const WithContext&) = delete;

 private:
  EGLDisplay display_;
  EGLContext before_;
  EGLSurface draw_, read_;
  bool changed_ = false;
};

inline XrTime to_time(double s) { return XrTime(s * 1e9); }
inline double to_s(XrTime t) { return 1e-9 * double(t); }
XrPosef to_xr(const geometry::Pose& pose);
geometry::Pose from_xr(const XrPosef& pose);
geometry::Pose inverse(const geometry::Pose& pose);
/// Applies first b, then a.
geometry::Pose combined(const geometry::Pose& a, const geometry::Pose& b);

template <class Event>
void Runtime::push(const Event& event) {
  static_assert(sizeof(Event) <= sizeof(XrEventDataBuffer));
  XrEventDataBuffer buffer{};
  *reinterpret_cast<Event*>(&buffer) = event;
  events.push_back(buffer);
}

template <class Body>
XrResult Runtime::call(const char* name, Of of, Body body) {
  const std::lock_guard lock(mutex_);
  calling_ = name;
  if (recorder) recorder->count(name);
  if (of != Of::kNothing) tick();
  if (const XrResult refused = refusal(name, of); refused != XR_SUCCESS) return refused;
  return body();
}

/// Returns a list as OpenXR does: a count, then as many elements as fit.
template <class T, class Source>
XrResult hand_out(const Source& source, uint32_t capacity, uint32_t* count, T* out) {
  if (!count) return XR_ERROR_VALIDATION_FAILURE;
  *count = uint32_t(std::size(source));
  if (capacity == 0) return XR_SUCCESS;
  if (capacity < *count) return XR_ERROR_SIZE_INSUFFICIENT;
  for (uint32_t i = 0; i < *count; ++i) out[i] = source[i];
  return XR_SUCCESS;
}

}  // namespace telesplat::xr_test
