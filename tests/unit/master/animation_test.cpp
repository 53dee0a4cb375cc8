// Epochs of a Julia set's parameters: messages to each peer and their order. Master without sockets and clocks.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "common/julia/animation.h"
#include "services/master/master_core.h"

namespace telesplat::master {
namespace {

class Animation : public ::testing::Test {
 protected:
  explicit Animation(MasterOptions o = {.schedule = {.frames_in_flight = 2},
                                        .settings = {.steering = false},
                                        .progressive = Progressive::kOff})
      : options(std::move(o)), core(options, {42}, *record) {}

  static wire::Hello hello(const std::string& role, uint64_t instance) {
    wire::Hello h;
    h.role = h.name = role;
    if (role == "viewer" || role == "sampler") h.name += std::to_string(instance);
    h.instance = {instance};
    if (role == "data") {
      h.facts = {{"kind", "julia"}, {"scene", "julia"}};
      h.parameters = julia::to_map(julia::presets()[0].parameters);
      h.parameters["room.x"] = 0.25;
      h.box_room = {{-1, -1, -1}, {1, 1, 1}};
    }
    if (role == "packer") h.endpoints = {{"tiles", "t"}};
    return h;
  }
  void join() {
    core.on("d", hello("data", 1), 0);
    core.on("p", hello("packer", 2), 0);
    core.on("s1", hello("sampler", 3), 0);
    core.on("s2", hello("sampler", 4), 0);
    core.on("v5", hello("viewer", 5), 0);
    core.on("v6", hello("viewer", 6), 0);
    deliver();
  }
  void request(uint64_t viewer, uint64_t id, double now_s) {
    wire::ViewRequest r;
    r.viewer = {viewer};
    r.request = {id};
    r.camera.width = 64;
    r.camera.height = 4;
    core.on("v" + std::to_string(viewer), r, now_s);
  }
  // Sorts all messages since the last call: leases into `leases`, the session into `told`; every lease's epoch must be
  // the newest that its sampler and the packer know.
  void deliver() {
    for (const auto& out : core.take_outgoing()) {
      const auto body = std::as_bytes(std::span(out.body));
      if (out.type == wire::Welcome::kName) {
        told[out.peer] = *wire::decode<wire::Welcome>(body);
      } else if (out.type == wire::Lease::kName) {
        leases.push_back(*wire::decode<wire::Lease>(body));
        EXPECT_EQ(leases.back().epoch, told[out.peer].epoch) << "leased before it was announced";
        EXPECT_EQ(leases.back().epoch, told["p"].epoch);
      } else if (out.type == wire::ControlReply::kName) {
        reply = *wire::decode<wire::ControlReply>(body);
      }
    }
  }
  // Samples and packs all open tiles for s1, and returns the leases.
  std::vector<wire::Lease> work(double now_s, const std::string& packer = "p") {
    std::vector<wire::Lease> all;
    for (;;) {
      core.on("s1", wire::LeaseRequest{}, now_s);
      deliver();
      if (leases.empty()) return all;
      for (const auto& l : std::exchange(leases, {})) {
        all.push_back(l);
        wire::TileDone m;
        m.frame = l.frame;
        m.tile = l.tile;
        m.lease = l.lease;
        m.sampler = {3};
        m.rect = l.rect;
        m.step = l.step;
        core.on(packer, m, now_s);
      }
      deliver();
    }
  }
  wire::ControlReply command(const std::string& name, std::map<std::string, std::string> arguments, double now_s = 1) {
    reply = {};
    core.on("c", wire::Control{name, std::move(arguments)}, now_s);
    deliver();
    return reply;
  }
  nlohmann::json status(double now_s = 1) {
    return nlohmann::json::parse(command("status", {}, now_s).text, nullptr, false);
  }
  uint64_t epoch() { return told["v5"].epoch.value; }
  double parameter(const std::string& name) { return told["s1"].parameters.at(name); }

  std::unique_ptr<metrics::RunRecord> record = std::move(metrics::RunRecord::open("")).value();
  MasterOptions options;
  MasterCore core;
  std::vector<wire::Lease> leases;
  std::map<std::string, wire::Welcome> told;
  wire::ControlReply reply;
};

TEST_F(Animation, JuliaSetsAreLeasedByRows) {
  join();
  request(5, 1, 1);
  const auto all = work(1);
  ASSERT_EQ(all.size(), 4u);
  for (const auto& l : all) {
    EXPECT_EQ(l.rect.width, 64);
    EXPECT_EQ(l.blocks_in_frame, 1u);
    EXPECT_EQ(l.block_rect.height, 4);
  }
}

TEST_F(Animation, SetBeginsAnEpochThatEveryoneIsToldOf) {
  core.on("d", hello("data", 1), 0);
  join();
  core.on("s1", wire::LeaseRequest{}, 1);
  request(5, 1, 1);
  const auto answer = command("set", {{"c.y", "0.125"}, {"iterations", "17"}}, 2);
  leases.clear();  // those of epoch 1
  EXPECT_TRUE(answer.ok) << answer.text;
  EXPECT_EQ(answer.text, "epoch 2");
  for (const char* peer : {"d", "p", "s1", "s2", "v5", "v6"}) {
    EXPECT_EQ(told[peer].epoch.value, 2u) << peer;
    EXPECT_EQ(told[peer].parameters.at("c.y"), 0.125);
    EXPECT_EQ(told[peer].parameters.at("iterations"), 17);
    EXPECT_EQ(told[peer].parameters.at("room.x"), 0.25) << "the placement stays";
  }
  // The view in progress is sampled anew.
  const auto all = work(2);
  ASSERT_FALSE(all.empty());
  for (const auto& l : all) EXPECT_EQ(l.epoch.value, 2u);
  EXPECT_EQ(core.counters().at("frames_completed"), 1);
  EXPECT_EQ(status()["parameters"]["c.y"], 0.125);
  EXPECT_EQ(status()["epoch"], 2);
}

TEST_F(Animation, WhatCannotBeSetIsRefusedAndChangesNothing) {
  join();
  const auto before = status();
  for (const auto& [name, value, named] :
       std::vector<std::array<std::string, 3>>{{"c.q", "1", "c.q"},
                                               {"c.x", "nan", "c.x"},
                                               {"c.x", "", "c.x"},
                                               {"c.x", "0.5m", "0.5m"},
                                               {"c.x", "1e999", "c.x"},
                                               {"c.x", "5", "-4..4"},
                                               {"iterations", "0", "1..4096"},
                                               {"iterations", "1000000000", "1..4096"},
                                               {"iterations", "2.5", "whole"},
                                               {"slice.offset", "4", "empty"},
                                               {"bound", "1", "fixed"},
                                               {"room.x", "1", "room.x"}}) {
    const auto answer = command("set", {{"c.y", "0.1"}, {name, value}});
    EXPECT_FALSE(answer.ok) << name << "=" << value;
    EXPECT_NE(answer.text.find(named), std::string::npos) << answer.text;
  }
  EXPECT_FALSE(command("set", {}).ok);
  for (const char* bad : {"", "c.y", "c.y=1:2:0s", "c.y=0:9:3s", "c.q=0:1:3s", "iterations=1:9:3s", "bound=1:2:3s"})
    EXPECT_FALSE(command("animate", {{"timeline", bad}}).ok) << bad;
  EXPECT_FALSE(command("animate", {}).ok);
  EXPECT_EQ(status()["parameters"], before["parameters"]);
  EXPECT_EQ(status()["epoch"], 1);
  EXPECT_EQ(status()["animation"], "off");
}

TEST_F(Animation, OtherScenesHaveNoParameters) {
  EXPECT_NE(command("set", {{"c.y", "0"}}).text.find("no data server"), std::string::npos);
  auto mesh = hello("data", 1);
  mesh.facts["kind"] = "mesh";
  mesh.parameters.clear();
  core.on("d", mesh, 0);
  for (const char* name : {"set", "animate"}) {
    const auto answer = command(name, {{"c.y", "0"}, {"timeline", "c.y=0:1:1s"}});
    EXPECT_FALSE(answer.ok);
    EXPECT_NE(answer.text.find("\"mesh\""), std::string::npos) << answer.text;
  }
  EXPECT_EQ(status()["epoch"], 1);
}

TEST_F(Animation, EachViewHasAnEpochOfItsOwnAndItsClockBeginsWithTheFirst) {
  join();
  const std::string text = "c.y=-0.25:0.25:10s";
  EXPECT_TRUE(command("animate", {{"timeline", text}}, 1).ok);
  EXPECT_EQ(status()["animation"], text);
  deliver();
  EXPECT_LE(epoch(), 1u) << "nobody looks";
  const auto timeline = *julia::parse_timeline(text);
  uint64_t last = 1;
  for (uint64_t i = 1; i <= 20; ++i) {
    const double now = 100 + 0.7 * double(i - 1);
    request(5, i, now);
    const auto all = work(now);
    ASSERT_EQ(all.size(), 4u);
    for (const auto& l : all) EXPECT_EQ(l.epoch, all[0].epoch) << "one epoch a frame";
    EXPECT_EQ(all[0].epoch.value, last + 1);
    last = all[0].epoch.value;
    EXPECT_DOUBLE_EQ(parameter("c.y"), timeline.values(now - 100).at("c.y"));
  }
  EXPECT_EQ(core.counters().at("frames_completed"), 20);
  // Nothing changes while time stands still.
  request(5, 21, 100 + 0.7 * 19);
  EXPECT_EQ(work(100 + 0.7 * 19)[0].epoch.value, last);
  EXPECT_TRUE(command("animate", {{"timeline", "off"}}, 200).ok);
  request(5, 22, 300);
  EXPECT_EQ(work(300)[0].epoch.value, last) << "values stay";
}

TEST_F(Animation, OneViewIsInFlightAtATime) {
  join();
  command("animate", {{"timeline", "c.y=-0.25:0.25:10s"}});
  request(5, 1, 10);
  core.on("s1", wire::LeaseRequest{}, 10);
  deliver();
  ASSERT_EQ(leases.size(), 1u);
  request(5, 2, 10.1);
  for (int i = 0; i < 10; ++i) core.on("s2", wire::LeaseRequest{}, 10.2);
  deliver();
  for (const auto& l : leases) EXPECT_EQ(l.frame, leases[0].frame);
  EXPECT_EQ(leases.size(), 2u) << "the last rows are kept for who is idle; the other view waits";
}

TEST_F(Animation, AllWhoWaitAreServedFromAnEpochInTurn) {
  join();
  command("animate", {{"timeline", "c.y=-0.25:0.25:10s"}});
  for (uint64_t round = 1; round <= 5; ++round) {
    const double now = 10.0 * double(round) + 0.123 * double(round);
    for (const uint64_t v : {5, 6}) request(v, round, now);
    std::map<uint64_t, uint64_t> epochs;  // by viewer
    for (const auto& l : work(now)) epochs[l.viewer.value] = l.epoch.value;
    ASSERT_EQ(epochs.size(), 2u);
    EXPECT_EQ(epochs[5], epochs[6]);
    EXPECT_EQ(epochs[5], round + 1);
  }
}

TEST_F(Animation, RestartsInTheMiddleDoNotWedgeIt) {
  join();
  command("animate", {{"timeline", "c.y=-0.25:0.25:10s"}});
  request(5, 1, 10);
  ASSERT_EQ(work(10).size(), 4u);
  // The packer dies with a frame in flight; the view is sampled again for the next one.
  request(5, 2, 11);
  core.on("s2", wire::LeaseRequest{}, 11);
  core.undeliverable("p");
  deliver();
  leases.clear();
  const uint64_t before = epoch();
  core.on("p", hello("packer", 20), 12);
  auto all = work(12);
  ASSERT_FALSE(all.empty());
  for (const auto& l : all) EXPECT_GT(l.epoch.value, before);
  // So does the data server: its second hello changes nothing, values and animation go on.
  core.undeliverable("d");
  request(5, 3, 13);
  ASSERT_FALSE(work(13).empty());
  const double value = parameter("c.y");
  const uint64_t now_epoch = epoch();
  EXPECT_FALSE(told["s1"].box_room.empty()) << "the scene stays while its server is away";
  core.on("d2", hello("data", 10), 14);
  deliver();
  EXPECT_EQ(epoch(), now_epoch);
  EXPECT_EQ(parameter("c.y"), value);
  request(5, 4, 15);
  ASSERT_FALSE(work(15).empty());
  EXPECT_EQ(epoch(), now_epoch + 1);
  // Neither does a sampler that dies in mid-frame.
  request(5, 5, 16);
  core.on("s2", wire::LeaseRequest{}, 16);
  core.undeliverable("s2");
  EXPECT_FALSE(work(16.1).empty());
  request(5, 6, 17);
  EXPECT_FALSE(work(17).empty());
  EXPECT_EQ(core.counters().at("frames_completed"), 6);
}

TEST_F(Animation, AnotherSceneIsAnotherEpoch) {
  join();
  auto other = hello("data", 10);
  other.parameters["c.x"] = 0.01;
  core.on("d2", other, 1);
  deliver();
  EXPECT_EQ(epoch(), 2u);
  EXPECT_EQ(parameter("c.x"), 0.01);
}

TEST_F(Animation, TheDataServersTimelineRuns) {
  auto data = hello("data", 1);
  data.facts["animate"] = "c.y=-0.25:0.25:10s";
  core.on("d", data, 0);
  EXPECT_EQ(status()["animation"], "c.y=-0.25:0.25:10s");
  EXPECT_FALSE(command("set", {{"c.y", "0"}}).ok) << "it is animated";
  EXPECT_TRUE(command("set", {{"c.x", "0"}}).ok);
}

class BadTimeline : public Animation {
 protected:
  BadTimeline() : Animation({.settings = {.steering = false}, .animation = *julia::parse_timeline("c.y=0:99:1s")}) {}
};
TEST_F(BadTimeline, OfTheCommandLineIsNotBegun) {
  join();
  EXPECT_EQ(status()["animation"], "off");
  request(5, 1, 1);
  EXPECT_FALSE(work(1).empty());
}

class ProgressiveAnimation : public Animation {
 protected:
  ProgressiveAnimation() : Animation({.settings = {.steering = false}}) {}
};
TEST_F(ProgressiveAnimation, CoarseAndFineShareAnEpoch) {
  join();
  command("animate", {{"timeline", "c.y=-0.25:0.25:10s"}});
  for (uint64_t i = 1; i <= 3; ++i) {
    request(5, i, double(i));
    const auto all = work(double(i));
    ASSERT_EQ(all.size(), 5u) << "one row of every 4th, then four";
    EXPECT_EQ(all[0].step, 4u);
    EXPECT_EQ(all[1].step, 1u);
    for (const auto& l : all) EXPECT_EQ(l.epoch.value, i + 1);
  }
}

TEST_F(ProgressiveAnimation, PackingEliminatesUnlessToldOtherwise) {
  MasterOptions o;
  MasterCore other(o, {1}, *record);
  other.on("d", hello("data", 1), 0);
  EXPECT_FALSE(other.settings().keep_redundant);
  o.settings.keep_redundant = true;
  MasterCore keeping(o, {1}, *record);
  keeping.on("d", hello("data", 1), 0);
  EXPECT_TRUE(keeping.settings().keep_redundant);
}

}  // namespace
}  // namespace telesplat::master
