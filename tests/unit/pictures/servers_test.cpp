// The servers' part of views that come as pictures: cutting a view into tiles, drawing them, passing them on.
#include <gtest/gtest.h>

#include <map>

#include "common/geometry/trajectory.h"
#include "common/image/jpeg.h"
#include "common/image/normal.h"
#include "services/master/master_options.h"
#include "services/master/tiles/frame_tiles.h"
#include "services/packer/pictures/picture_packing.h"
#include "services/sampler/tiles/picture_maker.h"
#include "tests/support/keys/lease_key.h"

namespace telesplat {
namespace {

const geometry::Camera kCamera = geometry::make_camera(geometry::default_pose(), 90, 64, 48);

wire::Welcome welcome(uint64_t quality = 80, EpochId epoch = {4}, InstanceId master = {1}) {
  wire::Welcome w;
  w.master = master, w.epoch = epoch, w.lease_key = test::lease_key();
  w.facts["kind"] = "mesh";
  w.settings.pictures = true, w.settings.picture_quality = quality;
  return w;
}

wire::Lease lease(uint64_t frame, const geometry::Camera& camera = kCamera) {
  wire::Lease l{.lease = {frame}, .frame = {frame}, .epoch = {4}, .viewer = {7}, .request = {frame}};
  l.camera = camera, l.rect = l.block_rect = {0, 0, 64, 48}, l.blocks_in_frame = 1;
  return l;
}

// ---- master --------------------------------------------------------------------------------------------------------

TEST(PictureTiles, AreBandsOfWholeJpegBlocksThatCoverTheView) {
  for (const auto& [width, height, bands] :
       {std::tuple{1280, 800, size_t{1}}, {1280, 800, size_t{3}}, {100, 70, size_t{64}}, {16384, 16384, size_t{1}}}) {
    const auto tiles = master::FrameTiles::of_bands(width, height, bands);
    int y = 0;
    for (size_t i = 0; i < tiles.tiles(); ++i) {
      const geometry::Rect& r = tiles.tile(i).rect;
      EXPECT_EQ(r.x, 0);
      EXPECT_EQ(r.y, y);
      EXPECT_EQ(r.width, width);
      EXPECT_EQ(r.y % 16, 0);
      EXPECT_LE(int64_t{r.width} * r.height, wire::kMaxTilePixels);
      y += r.height;
    }
    EXPECT_EQ(y, height);
    EXPECT_TRUE(tiles.whole_blocks());
    if (width == 1280) {
      EXPECT_EQ(tiles.tiles(), bands);
    }
  }
}

TEST(PictureSettings, AreToldWhereViewsComeAsPicturesAndNothingIsSteered) {
  master::MasterOptions o;
  EXPECT_FALSE(master::settings(o, scene::Kind::kMesh).pictures);
  o.settings.pictures = true;
  const auto told = master::settings(o, scene::Kind::kMesh);
  EXPECT_TRUE(told.pictures);
  EXPECT_FALSE(told.steering);
  EXPECT_FALSE(master::progressive(o, scene::Kind::kJulia));
  wire::Welcome w;
  w.settings = told;
  for (const auto& [kind, pipeline] : {std::pair{"mesh", scene::Pipeline::kPictures},
                                       {"julia", scene::Pipeline::kPictures},
                                       {"volume", scene::Pipeline::kSlices}}) {
    w.facts["kind"] = kind;
    EXPECT_EQ(scene::SessionView(w).pipeline(), pipeline) << kind;
  }
}

// ---- sampler -------------------------------------------------------------------------------------------------------

// A red square in the left half of the picture, facing the head.
image::DepthImage sampled(int side) {
  image::DepthImage out(64 * side, 48 * side);
  const uint16_t towards = image::encode_normal16({0, 0, 1});
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width / 2; ++x) {
      const size_t at = size_t(y) * size_t(out.width) + size_t(x);
      out.depth[at] = 1000, out.colour[at] = 0xff0000, out.normal[at] = towards;
    }
  return out;
}

TEST(PictureMaker, DrawsShadedColoursOverTheBackground) {
  sampler::PictureMaker maker;
  EXPECT_FALSE(maker.on());
  maker.follow(welcome(100));
  ASSERT_TRUE(maker.on());
  const auto rays = maker.rays(lease(1));
  EXPECT_EQ(rays.side, 1);
  EXPECT_FALSE(rays.lease);
  std::vector<uint32_t> to(64 * 48);
  ASSERT_TRUE(image::decode_jpeg(maker.picture(lease(1), rays, sampled(1)), 64, 48, to.data(), 64));
  const image::Shading shading({}, kCamera);
  const uint32_t lit = image::Shading::apply(0xff0000, shading.table()[image::encode_normal16({0, 0, 1})]);
  EXPECT_NEAR(double(to[20 * 64 + 10] >> 16 & 255), double(lit >> 16), 2);
  EXPECT_NEAR(double(to[20 * 64 + 50] >> 16 & 255), 0x14, 2);
  EXPECT_NEAR(double(to[20 * 64 + 50] & 255), 0x20, 2);
}

TEST(PictureMaker, AViewThatIsAskedForAgainIsDrawnFiner) {
  sampler::PictureMaker maker;
  maker.follow(welcome(50));
  EXPECT_EQ(maker.rays(lease(1)).quality, 50);
  geometry::Camera other = kCamera;
  other.pose.position_room.x += 0.1;
  EXPECT_EQ(maker.rays(lease(2, other)).quality, 50) << "the head moved";
  for (int tile = 0; tile < 2; ++tile) {
    const auto finer = maker.rays(lease(3, other));
    EXPECT_EQ(finer.quality, sampler::PictureMaker::kStillQuality);
    EXPECT_EQ(finer.side, 2);
    ASSERT_TRUE(finer.lease);
    EXPECT_EQ(finer.lease->camera.width, 128);
    EXPECT_EQ(finer.lease->rect, (geometry::Rect{0, 0, 128, 96}));
    std::vector<uint32_t> to(64 * 48);
    EXPECT_TRUE(image::decode_jpeg(maker.picture(lease(3, other), finer, sampled(2)), 64, 48, to.data(), 64));
  }
  wire::Lease next = lease(4, other);
  next.epoch = {5};
  EXPECT_EQ(maker.rays(next).quality, 50) << "of another epoch it is another view";
}

// ---- packer --------------------------------------------------------------------------------------------------------

class PicturePackingTest : public testing::Test {
 protected:
  struct Sent {
    std::string peer;
    uint64_t frame, tile, tiles;
  };
  packer::Outlets outlets() {
    packer::Outlets out;
    out.tell = [this](const wire::TileDone& done) { done_.push_back(done); };
    out.to_viewer = [this](std::string_view peer, std::string_view type, const std::string& body) {
      EXPECT_EQ(type, wire::Picture::kName);
      const auto m = wire::decode<wire::Picture>(std::as_bytes(std::span(body)));
      EXPECT_TRUE(m.ok());
      if (m.ok()) sent_.push_back({std::string(peer), m->frame.value, m->tile, m->tiles_in_frame});
      return reachable_;
    };
    out.master_now = [] { return 5.0; };
    out.to_master_s = [](double s) { return s; };
    return out;
  }
  Status sample(uint64_t frame, uint64_t tile = 0, EpochId epoch = {4}, InstanceId sealed_for = {9}) {
    wire::PictureTile m{.sampler = {9}, .lease = lease(frame)};
    m.lease.tile = m.lease.block = tile, m.lease.blocks_in_frame = 2, m.lease.epoch = epoch;
    test::seal_lease(m.lease, sealed_for);
    m.image = std::as_bytes(std::span("jpeg", 4));
    net::Message message;
    message.body = std::as_bytes(std::span("jpeg", 4));
    return packing_.receive(message, m, 1);
  }

  metrics::SpanRecorder spans_;
  std::vector<wire::TileDone> done_;
  std::vector<Sent> sent_;
  bool reachable_ = true;
  packer::PicturePacking packing_{outlets(), spans_};
};

TEST_F(PicturePackingTest, TilesGoToWhoAskedOnceEachAndTheMasterIsTold) {
  ASSERT_TRUE(packing_.follow(welcome(), 0));
  packing_.meet("peer", {7});
  ASSERT_TRUE(sample(1, 1));
  ASSERT_TRUE(sample(1, 0));
  ASSERT_TRUE(sample(1, 1)) << "a backup was slower";
  ASSERT_EQ(sent_.size(), 2u);
  EXPECT_EQ(sent_[0].peer, "peer");
  EXPECT_EQ(sent_[0].tile, 1u);
  EXPECT_EQ(sent_[1].tiles, 2u);
  ASSERT_EQ(done_.size(), 3u) << "of the third, too: it is done";
  EXPECT_EQ(done_[0].bytes_sent, 4u);
  EXPECT_EQ(done_[2].bytes_sent, 0u);
  EXPECT_EQ(done_[0].samples, 64u * 48u);
}

TEST_F(PicturePackingTest, WhatComesBeforeItsViewerIsKnownWaitsForIt) {
  ASSERT_TRUE(packing_.follow(welcome(), 0));
  ASSERT_TRUE(sample(1));
  EXPECT_TRUE(sent_.empty());
  packing_.meet("other", {8});
  EXPECT_TRUE(sent_.empty());
  packing_.meet("peer", {7});
  ASSERT_EQ(sent_.size(), 1u);
  EXPECT_EQ(sent_[0].peer, "peer");
  reachable_ = false;
  ASSERT_TRUE(sample(2));
  reachable_ = true;
  ASSERT_TRUE(sample(3));
  EXPECT_EQ(sent_.size(), 2u) << "who is gone must say again that it is here";
  packing_.meet("again", {7});
  ASSERT_EQ(sent_.size(), 3u);
  EXPECT_EQ(sent_[2].peer, "again");
  EXPECT_EQ(sent_[2].frame, 3u);
}

TEST_F(PicturePackingTest, EpochsComeInOrderAndLeasesAreSealed) {
  ASSERT_TRUE(packing_.follow(welcome(), 0));
  packing_.meet("peer", {7});
  EXPECT_FALSE(sample(1, 0, {4}, {10})) << "it was leased to another sampler";
  ASSERT_TRUE(sample(2, 0, {3})) << "of an epoch that is over";
  ASSERT_TRUE(sample(3, 0, {5})) << "of one that is not announced yet";
  EXPECT_TRUE(sent_.empty());
  ASSERT_TRUE(packing_.follow(welcome(80, {5}), 2));
  ASSERT_EQ(sent_.size(), 1u);
  EXPECT_EQ(sent_[0].frame, 3u);
  wire::Welcome points = welcome();
  points.settings.pictures = false;
  EXPECT_FALSE(packing_.follow(points, 3)) << "views come as points there";
}

}  // namespace
}  // namespace telesplat
