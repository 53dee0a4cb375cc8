// A window in this process; the test chooses when its window system ends.
#include <gtest/gtest.h>

#include "client/displays/window/window.h"
#include "tests/support/virtual_display.h"

namespace telesplat::viewer {
namespace {

// If the connection breaks while a frame is swapped, only the driver finds out, and does not report it. Xlib's next
// request would then be written to no memory ("request 18 length 24 would exceed buffer size").
TEST(Window, IsFoundToBeLostWhereOnlyTheDriverFoundItsDisplayGone) {
  if (!test::VirtualDisplay::installed()) GTEST_SKIP() << "there is no Xvfb";
  test::VirtualDisplay display;
  ASSERT_TRUE(display.ready());
  auto window = Window::open({.width = 320, .height = 200});
  ASSERT_TRUE(window) << window.error().text;
  const image::View frame{320, 200, std::vector<uint32_t>(320 * 200, 0x336699), {}};
  (*window)->present(frame, {});
  ASSERT_FALSE((*window)->lost());
  bool gone = false;
  (*window)->present(frame, {}, [&] {
    display.go_away();
    gone = true;
    return 0.0;
  });
  ASSERT_TRUE(gone) << "a panel was to be built while the frame was drawn";
  (*window)->set_title("something else");
  EXPECT_TRUE((*window)->lost());
  EXPECT_TRUE((*window)->closing());
  (*window)->present(frame, {});
  EXPECT_EQ((*window)->content_scale(), 1.0);
}

}  // namespace
}  // namespace telesplat::viewer
