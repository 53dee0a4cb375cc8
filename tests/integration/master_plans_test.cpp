// The master process in a thread, among a packer, a sampler and a viewer made for the test: plans that come, come late,
// never come, or are invalid.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "common/codec/mask_stream.h"
#include "common/core/clock.h"
#include "common/net/socket.h"
#include "services/master/master_options.h"
#include "services/master/master_service.h"
#include "tests/support/patience.h"

namespace telesplat {
namespace {

constexpr double kDeadline_s = test::patient(20);

struct Peer {
  Peer(net::Context& context, const std::string& role, uint64_t number, const std::string& master)
      : socket(context, net::Kind::kDealer, role), instance{number} {
    EXPECT_TRUE(socket.connect(master));
    wire::Hello hello{.role = role, .name = role, .instance = instance, .pid = number};
    if (role == "data") hello.facts = {{"kind", "mesh"}}, hello.box_room = {{-1, -1, -1}, {1, 1, 1}};
    socket.send(hello);
    EXPECT_TRUE(next<wire::Welcome>());
  }
  // Returns the next message of type M; drops others.
  template <class M>
  std::optional<M> next(double patience_s = kDeadline_s) {
    for (const double until = monotonic_s() + patience_s; monotonic_s() < until;) {
      net::wait_readable({&socket}, 10);
      while (auto message = socket.receive())
        if (message->type == M::kName) return socket.decode<M>(*message);
    }
    return std::nullopt;
  }
  net::Socket socket;
  InstanceId instance;
};

class MasterPlans : public testing::Test {
 protected:
  void SetUp() override {
    folder = std::filesystem::temp_directory_path() / ("telesplat-plans-" + std::to_string(getpid()));
    std::filesystem::create_directories(folder);
    setenv("TELESPLAT_RUNTIME", folder.c_str(), 1);
    options.service.bind = "ipc://" + (folder / "master").string();
    options.service.log_level = "off";
    options.started_by = "run";
    thread = std::thread([this] { code = master::run(options).value(); });
    data.emplace(context, "data", 1, options.service.bind);
    packer.emplace(context, "packer", 2, options.service.bind);
    sampler.emplace(context, "sampler", 3, options.service.bind);
    viewer.emplace(context, "viewer", 5, options.service.bind);
    for (int i = 0; i < 8; ++i) sampler->socket.send(wire::LeaseRequest{sampler->instance});
  }
  void TearDown() override {
    viewer->socket.send(wire::Control{"stop", {}});
    for (auto* p : {&data, &packer, &sampler, &viewer}) (*p)->socket.send(wire::Goodbye{(*p)->instance});
    thread.join();
    EXPECT_EQ(code, 0);
    std::filesystem::remove_all(folder);
  }

  void look(uint64_t id) {
    wire::ViewRequest r{.viewer = viewer->instance, .request = {id}};
    r.camera.pose.position_room.x = 0.01 * double(id);
    r.camera.width = 512, r.camera.height = 256;
    viewer->socket.send(r);
  }
  wire::PlanRequest asked(bool extra = false) {
    for (int i = 0; i < 100; ++i)
      if (const auto question = packer->next<wire::PlanRequest>(); question && question->extra == extra)
        return *question;
    ADD_FAILURE() << "the packer is not asked";
    return {};
  }
  wire::Plan plan_of(const wire::PlanRequest& question, bool with_tile) {
    wire::Plan out{.frame = question.frame, .epoch = question.epoch, .camera = question.camera};
    if (with_tile) out.masks = mask_, out.tiles = {64, 0, 64, 32, 5, uint32_t(mask_.size())};
    return out;
  }
  void done(const wire::Lease& l) {
    packer->socket.send(wire::TileDone{.frame = l.frame,
                                       .tile = l.tile,
                                       .lease = l.lease,
                                       .sampler = sampler->instance,
                                       .step = l.step,
                                       .extra = l.extra,
                                       .rays = l.rays,
                                       .rect = l.rect});
    sampler->socket.send(wire::LeaseRequest{sampler->instance});
  }
  nlohmann::json status() {
    viewer->socket.send(wire::Control{"status", {}});
    const auto reply = viewer->next<wire::ControlReply>();
    return reply ? nlohmann::json::parse(reply->text, nullptr, false) : nlohmann::json();
  }
  bool completed(uint64_t views) {
    for (const double until = monotonic_s() + kDeadline_s; monotonic_s() < until;) {
      const auto s = status();
      if (s.is_object() && s["frames_completed"] == views) return true;
    }
    return false;
  }

  net::Context context;
  std::filesystem::path folder;
  master::MasterServiceOptions options;
  std::thread thread;
  int code = -1;
  std::optional<Peer> data, packer, sampler, viewer;
  // Five pixels of a tile of 64 x 32.
  const std::vector<uint32_t> mask_ = [] {
    image::PixelMask mask(64, 32);
    for (int i = 0; i < 5; ++i) mask.set(9 * i, 3 * i);
    return codec::encode_mask(mask);
  }();
};

TEST_F(MasterPlans, BecomeMaskedLeases) {
  look(1);
  packer->socket.send(plan_of(asked(), true));
  const auto lease = sampler->next<wire::Lease>();
  ASSERT_TRUE(lease);
  EXPECT_EQ(lease->rays, 5u);
  EXPECT_EQ(lease->mask, mask_);
  EXPECT_EQ(lease->rect, (geometry::Rect{64, 0, 64, 32}));
  done(*lease);
  EXPECT_TRUE(completed(1));
  packer->socket.send(plan_of(asked(true), true));
  const auto extra = sampler->next<wire::Lease>();
  ASSERT_TRUE(extra);
  EXPECT_TRUE(extra->extra);
  look(2);
  packer->socket.send(plan_of(asked(), false));
  EXPECT_TRUE(completed(2)) << "a view that needs nothing, while the sampler is busy with others";
}

TEST_F(MasterPlans, APackerThatNeverAnswersCostsViewsNoMoreThanTheDeadline) {
  look(1);
  const double begin_s = monotonic_s();
  const auto question = asked();
  for (int view = 1; view <= 3; ++view) {
    for (int tile = 0; tile < 2; ++tile) {
      const auto lease = sampler->next<wire::Lease>();
      ASSERT_TRUE(lease) << "view " << view;
      EXPECT_TRUE(lease->mask.empty());
      EXPECT_EQ(lease->rays, 256u * 256u);
      if (view == 1) {
        EXPECT_GT(monotonic_s() - begin_s, 0.9);
      }
      done(*lease);
    }
    EXPECT_TRUE(completed(uint64_t(view)));
    packer->socket.send(plan_of(question, true));  // much too late: it has no effect
    look(uint64_t(view) + 1);
  }
}

TEST_F(MasterPlans, WhatIsNoPlanIsCountedAndTheViewIsSampledWhole) {
  look(1);
  const auto question = asked();
  wire::Plan outside = plan_of(question, true);
  outside.tiles[0] = 500;  // the tile at its right
  packer->socket.send(outside);
  packer->socket.send_frames({}, wire::Plan::kName, "nonsense");
  packer->socket.send_frames({}, wire::Plan::kName, wire::encode(plan_of(question, true)).substr(0, 40));
  viewer->socket.send(plan_of(question, false));  // the viewer is no packer
  for (int tile = 0; tile < 2; ++tile) {
    const auto lease = sampler->next<wire::Lease>();
    ASSERT_TRUE(lease);
    EXPECT_TRUE(lease->mask.empty());
    done(*lease);
  }
  EXPECT_TRUE(completed(1));
  look(2);
  wire::Plan elsewhere = plan_of(asked(), true);
  elsewhere.camera.near_m *= 2;
  packer->socket.send(elsewhere);
  const auto lease = sampler->next<wire::Lease>();
  ASSERT_TRUE(lease);
  EXPECT_TRUE(lease->mask.empty()) << "of another camera";
}

TEST_F(MasterPlans, APlanWithAMaskThatIsNoneIsCountedAndTheViewIsSampledWhole) {
  look(1);
  wire::Plan plan = plan_of(asked(), true);
  for (uint32_t& word : plan.masks) word = ~word;
  packer->socket.send(plan);
  for (int tile = 0; tile < 2; ++tile) {
    const auto lease = sampler->next<wire::Lease>();
    ASSERT_TRUE(lease);
    EXPECT_TRUE(lease->mask.empty());
    done(*lease);
  }
  EXPECT_TRUE(completed(1));
}

TEST_F(MasterPlans, ThePackerMayBeReplacedWhileItPlans) {
  look(1);
  const auto question = asked();
  packer.reset();
  packer.emplace(context, "packer", 20, options.service.bind);
  const auto again = asked();
  EXPECT_EQ(again.request, question.request);
  EXPECT_NE(again.frame, question.frame);
  packer->socket.send(plan_of(again, false));
  EXPECT_TRUE(completed(1));
}

}  // namespace
}  // namespace telesplat
