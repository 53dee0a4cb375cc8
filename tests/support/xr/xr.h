// OpenXR's headers with the options of this runtime.
#pragma once

#include <epoxy/egl.h>

#include <ctime>

#define XR_USE_GRAPHICS_API_OPENGL
#define XR_USE_PLATFORM_EGL
#define XR_USE_TIMESPEC
#include <openxr/openxr.h>
#include <openxr/openxr_platform.h>
