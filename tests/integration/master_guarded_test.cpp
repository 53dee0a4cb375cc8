// A message whose handling fails counts as its sender's fault, and the loop goes on.
#include <gtest/gtest.h>

#include <new>
#include <stdexcept>

#include "common/wire/messages.h"
#include "services/master/guarded.h"

namespace telesplat::master {
namespace {

TEST(GuardedMessages, AreCountedAndEndNothing) {
  net::Context context;
  net::Socket control(context, net::Kind::kRouter, "control");
  const net::Message message{.peer = "somebody", .type = "hello"};
  int handled = 0;
  guarded(control, message, [&] { ++handled; });
  EXPECT_EQ(control.rejected(), 0u);
  guarded(control, message, [&] { throw std::length_error("a list that is too long"); });
  guarded(control, message, [&] { throw std::bad_alloc(); });
  EXPECT_EQ(control.rejected(), 2u);
  guarded(control, message, [&] { ++handled; });
  EXPECT_EQ(handled, 2);
  EXPECT_EQ(control.rejected(), 2u);
}

}  // namespace
}  // namespace telesplat::master
