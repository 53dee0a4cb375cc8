// The same for tests, with GoogleTest.
#pragma once

#include "cmake/common_headers.h"

#include <gtest/gtest.h>
