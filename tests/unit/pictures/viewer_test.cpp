// The viewer's part of views that come as pictures: it asks for them, puts tiles together and displays the pictures.
#include <gtest/gtest.h>

#include "client/viewer/coupling/coupling.h"
#include "client/viewer/coupling/view_requester.h"
#include "client/viewer/pictures/received_pictures.h"
#include "common/image/jpeg.h"

namespace telesplat::viewer {
namespace {

using Requests = std::vector<RequestId>;

geometry::Camera camera(double x = 0, int width = 64, int height = 48) {
  return geometry::make_camera({{x, 0, 1}, {1, 0, 0, 0}}, 80, width, height);
}

// ---- credits -------------------------------------------------------------------------------------------------------

TEST(NewestWins, AnUpdateMakesThoseBeforeItVoidAndHoldsNoCredit) {
  Coupling c(3, true);
  for (const uint64_t i : {1, 2, 3}) c.asked({i}, 0);
  EXPECT_FALSE(c.may_ask());
  EXPECT_EQ(c.completed({2}, 0), Requests{{2}}) << "without waiting for the first";
  EXPECT_EQ(c.open(), Requests{{3}});
  EXPECT_TRUE(c.completed({1}, 0).empty()) << "it is older than what is there";
  EXPECT_TRUE(c.may_ask());
  EXPECT_EQ(c.completed({3}, 0), Requests{{3}});
  EXPECT_EQ(c.filled(), 1);
  EXPECT_EQ(c.take(), RequestId{3}) << "the second was never displayed";
  c.asked({4}, 0), c.asked({5}, 0), c.asked({6}, 0);
  EXPECT_FALSE(c.may_ask());
  c.displayed();
  EXPECT_FALSE(c.may_ask()) << "three are on their way";
}

// ---- requests ------------------------------------------------------------------------------------------------------

struct Asking {
  RequestOptions options = [] {
    RequestOptions o;
    o.adaptive = o.pictures = true;
    o.buffers = 3, o.picture_rate_hz = 50;
    return o;
  }();
  ViewRequester requester{options, InstanceId{7}};
  double now_s = 10;

  std::optional<wire::ViewRequest> at(double s, double x) {
    now_s = s;
    requester.on_pose(s, camera(x));
    return requester.next(s);
  }
  void answer(const wire::ViewRequest& r) {
    requester.on_part({.viewer = {7}, .request = r.request, .complete = true, .points = 1, .camera = r.camera}, now_s);
  }
};

TEST(PictureRequests, AreOfTheHeadAsItIsWithoutMarginAtTheDisplaysSizeAndRate) {
  Asking a;
  a.at(10, 0);
  const auto second = a.at(10.021, 0.1);
  ASSERT_TRUE(second);
  EXPECT_FALSE(a.at(10.03, 0.2)) << "fifty a second";
  const auto third = a.at(10.041, 0.3);
  ASSERT_TRUE(third);
  const geometry::Camera seen = camera(0.3);
  EXPECT_NEAR(third->camera.pose.position_room.x, 0.3, 1e-5) << "where it is, not where it may be";
  EXPECT_NEAR(third->camera.right, seen.right, 1e-5);
  EXPECT_EQ(third->camera.width, seen.width);
  EXPECT_EQ(third->camera.height, seen.height);
  EXPECT_EQ(third->buffers, 3u);
}

TEST(PictureRequests, AHeadThatRestsIsAskedForOnceMoreAndThenNoMore) {
  Asking a;
  const auto first = a.at(10, 0);
  ASSERT_TRUE(first);
  EXPECT_FALSE(a.at(10.5, 0)) << "it is on its way";
  a.answer(*first);
  const auto finer = a.at(10.8, 0);
  ASSERT_TRUE(finer);
  EXPECT_EQ(finer->camera, first->camera);
  a.answer(*finer);
  for (int i = 0; i < 20; ++i) EXPECT_FALSE(a.at(11 + i, 0)) << i;
  EXPECT_TRUE(a.at(40, 0.01)) << "it moves";
}

TEST(PictureRequests, AnotherEpochIsAskedForByAHeadThatRests) {
  Asking a;
  a.answer(*a.at(10, 0));
  a.answer(*a.at(11, 0));
  ASSERT_FALSE(a.at(12, 0));
  a.requester.on_new_epoch(12.5);
  const auto again = a.at(13, 0);
  ASSERT_TRUE(again);
  a.answer(*again);
  EXPECT_TRUE(a.at(14, 0)) << "and its finer picture";
  EXPECT_FALSE(a.at(15, 0));
}

// ---- tiles ---------------------------------------------------------------------------------------------------------

struct Tile {
  std::vector<std::byte> jpeg;
  wire::Picture message;
};
// Band n of two.
Tile band(uint64_t request, uint64_t frame, uint64_t n, uint32_t colour) {
  Tile t{image::encode_jpeg(std::vector<uint32_t>(64 * 24, colour), 64, 24, 100), {}};
  t.message = {.epoch = {1}, .frame = {frame}, .viewer = {7}, .request = {request}, .tile = n, .tiles_in_frame = 2};
  t.message.camera = camera(), t.message.rect = {0, int(24 * n), 64, 24};
  t.message.image = t.jpeg;
  return t;
}

TEST(PictureGatherer, TilesBecomeAPictureInAnyOrder) {
  PictureGatherer gatherer;
  const Tile upper = band(1, 5, 0, 0xff0000), lower = band(1, 5, 1, 0x0000ff);
  auto first = gatherer.add(lower.message);
  ASSERT_TRUE(first);
  EXPECT_EQ(*first, nullptr);
  auto again = gatherer.add(lower.message);
  ASSERT_TRUE(again);
  EXPECT_EQ(*again, nullptr) << "the same tile twice is one";
  auto last = gatherer.add(upper.message);
  ASSERT_TRUE(last);
  ASSERT_NE(*last, nullptr);
  EXPECT_EQ((*last)->request, RequestId{1});
  EXPECT_GE((*last)->view.colour[10 * 64 + 10] >> 16 & 255, 0xfdu);
  EXPECT_GE((*last)->view.colour[40 * 64 + 10] & 255, 0xfdu);
}

TEST(PictureGatherer, TheNewestWins) {
  PictureGatherer gatherer;
  ASSERT_TRUE(gatherer.add(band(1, 5, 0, 0).message));
  ASSERT_TRUE(gatherer.add(band(2, 6, 0, 0).message));
  const auto newest = gatherer.add(band(2, 6, 1, 0).message);
  ASSERT_TRUE(newest);
  ASSERT_NE(*newest, nullptr);
  const auto late = gatherer.add(band(1, 5, 1, 0).message);
  ASSERT_TRUE(late);
  EXPECT_EQ(*late, nullptr) << "it is older than what is complete";
}

TEST(PictureGatherer, WhatMakesNoSenseIsRefused) {
  PictureGatherer gatherer;
  Tile tile = band(1, 5, 0, 0);
  tile.message.image = tile.message.image.first(tile.message.image.size() / 2);
  EXPECT_FALSE(gatherer.add(tile.message)) << "cut off";
  ASSERT_TRUE(gatherer.add(band(1, 5, 0, 0).message));
  EXPECT_FALSE(gatherer.add(band(2, 5, 1, 0).message)) << "another view's tile in the same frame";
  Tile huge = band(3, 8, 0, 0);
  huge.message.camera.width = huge.message.camera.height = 16384;
  const auto refused = gatherer.add(huge.message);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().text.find("limit 67108864"), std::string::npos) << refused.error().text;
}

// ---- display -------------------------------------------------------------------------------------------------------

DisplayedPicture picture(uint64_t request, uint32_t colour, double x = 0) {
  auto out = std::make_shared<ShownPicture>();
  out->epoch = {1}, out->frame = {request}, out->request = {request}, out->camera = camera(x);
  out->view = {64, 48, std::vector<uint32_t>(64 * 48, 0xff000000u | colour), {}};
  return {out, {{request}, 3.5, out->camera.pose}};
}

TEST(PictureSource, ShowsThePictureThatTheDisplayWentOnToWithItsOwnPose) {
  PictureShelf shelf;
  PictureSource source(shelf);
  image::View view{64, 48, std::vector<uint32_t>(64 * 48, 5), {}};
  FrameInput input{.camera = camera(2), .even_empty = false};
  EXPECT_TRUE(source.draw(input, view).empty);
  EXPECT_EQ(view.colour[0], 5u);
  shelf.put(picture(1, 0x111111));
  shelf.put(picture(2, 0x222222, 0.5));
  shelf.put(picture(3, 0x333333));
  source.advance({2});
  const DrawnFrame drawn = source.draw(input, view);
  EXPECT_FALSE(drawn.empty);
  EXPECT_TRUE(drawn.changed);
  EXPECT_EQ(view.colour[100], 0x222222u);
  EXPECT_EQ(drawn.update.request, RequestId{2});
  EXPECT_EQ(drawn.update.requested_s, 3.5);
  ASSERT_TRUE(drawn.picture_of);
  EXPECT_EQ(drawn.picture_of->pose.position_room.x, 0.5) << "not where the head is by now";
  input.intact = true;
  EXPECT_FALSE(source.draw(input, view).changed);
  source.advance({3});
  EXPECT_TRUE(source.draw(input, view).changed);
  EXPECT_EQ(view.colour[100], 0x333333u);
}

TEST(PictureSource, APictureOfAnotherSizeIsScaled) {
  image::View from{2, 1, {0x000000, 0xff00ff}, {}}, to{8, 3, std::vector<uint32_t>(24), {}};
  scale_into(from, to);
  for (int y = 0; y < 3; ++y)
    for (int x = 0; x < 8; ++x) {
      const uint32_t c = to.colour[size_t(y * 8 + x)];
      EXPECT_EQ(c >> 16 & 255, c & 255);
      EXPECT_EQ(c >> 8 & 255, 0u);
      EXPECT_NEAR(double(c & 255), 255 * std::clamp((x + 0.5) / 4 - 0.5, 0.0, 1.0), 1.0) << x;
    }
}

}  // namespace
}  // namespace telesplat::viewer
