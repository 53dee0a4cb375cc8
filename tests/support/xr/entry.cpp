// Gives the loader the runtime's functions. Debian's headers lack the structs of the negotiation; these follow the
// loader's specification, interface version 1.
#include <cstring>
#include <string_view>

#include "tests/support/xr/calls.h"

namespace telesplat::xr_test {
namespace {

enum InterfaceStruct : int { kLoaderInfo = 1, kRuntimeRequest = 3 };

struct NegotiateLoaderInfo {
  InterfaceStruct type;
  uint32_t version;
  size_t size;
  uint32_t least_interface, most_interface;
  XrVersion least_api, most_api;
};

struct NegotiateRuntimeRequest {
  InterfaceStruct type;
  uint32_t version;
  size_t size;
  uint32_t interface_version;
  XrVersion api_version;
  PFN_xrGetInstanceProcAddr get_instance_proc_addr;
};

XrResult XRAPI_CALL get_instance_proc_addr(XrInstance, const char* name, PFN_xrVoidFunction* function) {
  static const struct {
    const char* name;
    PFN_xrVoidFunction function;
  } kFunctions[]{
#define TELESPLAT_XR_ROW(call) {"xr" #call, reinterpret_cast<PFN_xrVoidFunction>(calls::call)},
      TELESPLAT_XR_CALLS(TELESPLAT_XR_ROW)
#undef TELESPLAT_XR_ROW
          {"xrGetInstanceProcAddr", reinterpret_cast<PFN_xrVoidFunction>(get_instance_proc_addr)}};
  *function = nullptr;
  for (const auto& row : kFunctions)
    if (std::strcmp(row.name, name) == 0) *function = row.function;
  return *function ? XR_SUCCESS : XR_ERROR_FUNCTION_UNSUPPORTED;
}

}  // namespace
}  // namespace telesplat::xr_test

extern "C" __attribute__((visibility("default"))) XrResult XRAPI_CALL xrNegotiateLoaderRuntimeInterface(
    const telesplat::xr_test::NegotiateLoaderInfo* loader, telesplat::xr_test::NegotiateRuntimeRequest* request) {
  using namespace telesplat::xr_test;
  if (!loader || !request || loader->type != kLoaderInfo || request->type != kRuntimeRequest ||
      loader->least_interface > 1 || loader->most_interface < 1)
    return XR_ERROR_INITIALIZATION_FAILED;
  request->interface_version = 1;
  request->api_version = XR_MAKE_VERSION(1, 0, 0);
  request->get_instance_proc_addr = get_instance_proc_addr;
  return XR_SUCCESS;
}
