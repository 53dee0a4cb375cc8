// An exception in a thread ends the thread's work, not the process.
#include "common/core/guarded.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <thread>

namespace telesplat {
namespace {

TEST(Guarded, AnExceptionEndsTheWorkAndNotTheProcess) {
  Status thrown = ok_status(), odd = ok_status(), good = Error{"not done"};
  testing::internal::CaptureStderr();
  log::initialise("test", "info");
  std::thread([&] {
    thrown = guarded("work", [] { throw std::runtime_error("no memory"); });
    odd = guarded("work", [] { throw 3; });
    good = guarded("work", [] {});
  }).join();
  const std::string said = testing::internal::GetCapturedStderr();
  ASSERT_FALSE(thrown.ok() || odd.ok());
  EXPECT_EQ(thrown.error().text, "no memory");
  EXPECT_EQ(odd.error().text, "an unknown exception");
  EXPECT_TRUE(good.ok());
  EXPECT_NE(said.find("work failed: no memory"), std::string::npos) << said;
}

}  // namespace
}  // namespace telesplat
