// The common headers, and GoogleTest, for tests.
#pragma once

#include "cmake/common_headers.h"

#include <gtest/gtest.h>
