// The functions of this runtime, listed for entry.cpp.
#pragma once

#include "tests/support/xr/xr.h"

namespace telesplat::xr_test {

// clang-format off
#define TELESPLAT_XR_CALLS(_) \
  _(EnumerateInstanceExtensionProperties) _(CreateInstance) _(DestroyInstance) _(GetInstanceProperties) \
  _(PollEvent) _(ResultToString) _(StructureTypeToString) _(GetSystem) _(GetSystemProperties) \
  _(EnumerateEnvironmentBlendModes) _(EnumerateViewConfigurations) _(GetViewConfigurationProperties) \
  _(EnumerateViewConfigurationViews) _(GetOpenGLGraphicsRequirementsKHR) _(ConvertTimespecTimeToTimeKHR) \
  _(ConvertTimeToTimespecTimeKHR) _(StringToPath) _(PathToString) \
  _(CreateSession) _(DestroySession) _(BeginSession) _(EndSession) _(RequestExitSession) \
  _(EnumerateReferenceSpaces) _(CreateReferenceSpace) _(GetReferenceSpaceBoundsRect) _(CreateActionSpace) \
  _(LocateSpace) _(DestroySpace) \
  _(EnumerateSwapchainFormats) _(CreateSwapchain) _(DestroySwapchain) _(EnumerateSwapchainImages) \
  _(AcquireSwapchainImage) _(WaitSwapchainImage) _(ReleaseSwapchainImage) \
  _(WaitFrame) _(BeginFrame) _(EndFrame) _(LocateViews) \
  _(CreateActionSet) _(DestroyActionSet) _(CreateAction) _(DestroyAction) _(SuggestInteractionProfileBindings) \
  _(AttachSessionActionSets) _(GetCurrentInteractionProfile) _(SyncActions) _(GetActionStateBoolean) \
  _(GetActionStatePose)
// clang-format on

}  // namespace telesplat::xr_test

// Declared with OpenXR's types; in a namespace, apart from the loader's own functions.
namespace telesplat::xr_test::calls {
template <class F>
struct Signature;
template <class... A>
struct Signature<XrResult(XRAPI_PTR*)(A...)> {
  using Type = XrResult(A...);
};
#define TELESPLAT_XR_DECLARE(name) Signature<PFN_xr##name>::Type name;
TELESPLAT_XR_CALLS(TELESPLAT_XR_DECLARE)
#undef TELESPLAT_XR_DECLARE
}  // namespace telesplat::xr_test::calls
