// The master without sockets and clocks: its messages to each peer.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/core/log.h"
#include "common/core/utf8.h"
#include "services/master/master_core.h"
#include "services/master/record/measured.h"

namespace telesplat::master {
namespace {

wire::Hello hello(const std::string& role, const std::string& name, uint64_t instance) {
  wire::Hello h;
  h.role = role;
  h.name = name;
  h.instance = {instance};
  h.pid = instance * 10;
  h.sent_s = 0.5;
  if (role == "packer") h.endpoints = {{"tiles", "t" + name}, {"patches", "p" + name}, {"state", "s" + name}};
  if (role == "data")
    h.endpoints = {{"chunks", "c" + name}}, h.facts = {{"scene", "hill"}}, h.box_room = {{-1, -1, -1}, {1, 1, 1}};
  return h;
}

class Master : public ::testing::Test {
 protected:
  // Returns the messages of type M to `peer` since the last call for any peer.
  template <class M>
  std::vector<M> sent(const std::string& peer) {
    for (auto& out : core.take_outgoing()) outbox.push_back(std::move(out));
    std::vector<M> messages;
    std::erase_if(outbox, [&](const Outgoing& o) {
      if (o.peer != peer || o.type != M::kName) return false;
      auto decoded = wire::decode<M>(std::as_bytes(std::span(o.body)));
      EXPECT_TRUE(decoded) << o.type;
      if (decoded) messages.push_back(*decoded);
      return true;
    });
    return messages;
  }
  void join_all() {
    core.on("d", hello("data", "data", 1), 0);
    core.on("p", hello("packer", "packer", 2), 0);
    core.on("s1", hello("sampler", "sampler-1", 3), 0);
    core.on("s2", hello("sampler", "sampler-2", 4), 0);
    core.on("v", hello("viewer", "viewer-1", 5), 0);
  }
  void request(uint64_t id, double now_s = 1) {
    wire::ViewRequest r;
    r.viewer = {5};
    r.request = {id};
    r.camera.width = r.camera.height = 256;
    core.on("v", r, now_s);
  }
  wire::Lease lease_to(const std::string& sampler, uint64_t id = 1, double now_s = 1) {
    core.on(sampler, wire::LeaseRequest{}, now_s);
    request(id, now_s);
    const auto leases = sent<wire::Lease>(sampler);
    EXPECT_EQ(leases.size(), 1u);
    return leases.empty() ? wire::Lease{} : leases[0];
  }
  void done(const wire::Lease& l, const std::string& packer = "p", double now_s = 1.1) {
    wire::TileDone m;
    m.frame = l.frame;
    m.tile = l.tile;
    m.lease = l.lease;
    m.sampler = {3};
    core.on(packer, m, now_s);
  }
  nlohmann::json status() {
    core.on("c", wire::Control{"status", {}}, 2);
    const auto replies = sent<wire::ControlReply>("c");
    EXPECT_EQ(replies.size(), 1u);
    return replies.empty() ? nlohmann::json() : nlohmann::json::parse(replies[0].text, nullptr, false);
  }

  std::unique_ptr<metrics::RunRecord> record = std::move(metrics::RunRecord::open("")).value();
  MasterCore core{MasterOptions{.schedule = {.tile_size = 256, .frames_in_flight = 1, .lease_timeout_s = 2},
                                .settings = {.max_points = 5, .steering = false}},
                  {42},
                  *record};
  std::vector<Outgoing> outbox;
};

TEST_F(Master, WelcomesEveryoneAndAnnouncesNewEndpoints) {
  core.on("v", hello("viewer", "viewer-1", 5), 3);
  auto welcomes = sent<wire::Welcome>("v");
  ASSERT_EQ(welcomes.size(), 1u);
  EXPECT_EQ(welcomes[0].hello_sent_s, 0.5);
  EXPECT_EQ(welcomes[0].master_s, 3);
  EXPECT_EQ(welcomes[0].master.value, 42u);
  EXPECT_EQ(welcomes[0].settings.max_points, 5u);
  EXPECT_TRUE(welcomes[0].box_room.empty());
  core.on("d", hello("data", "data", 1), 4);
  core.on("p", hello("packer", "packer", 2), 4);
  welcomes = sent<wire::Welcome>("v");
  ASSERT_EQ(welcomes.size(), 2u);
  EXPECT_EQ(welcomes[1].endpoints.size(), 4u);
  EXPECT_EQ(welcomes[1].endpoints.at("tiles"), "tpacker");
  EXPECT_EQ(welcomes[1].hello_sent_s, 0);
  EXPECT_FALSE(welcomes[1].box_room.empty());
  EXPECT_EQ(welcomes[1].facts.at("scene"), "hill");
}

// Any peer that reaches the port could cause these lines as often as it likes.
TEST_F(Master, LinesAboutWhoComesAreNotMoreThanAPersonReads) {
  log::initialise("master", "info");
  testing::internal::CaptureStderr();
  for (uint64_t i = 0; i < 400; ++i) {
    wire::Hello bad = hello("data", fmt::format("data-{}", i), 1000 + i);
    bad.box_room = {{0, 0, 0}, {1e30, 1, 1}};
    core.on(fmt::format("d{}", i), bad, 1);
    core.on(fmt::format("d{}", i), wire::Goodbye{{1000 + i}}, 1);
  }
  for (uint64_t i = 0; i < 400; ++i)
    core.on(i % 2 ? "a" : "b", hello("sampler", "twin", 2000 + i % 2), 1 + double(i) * 0.01);
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_NE(said.find("the scene of data-0 is refused"), std::string::npos) << said.substr(0, 500);
  EXPECT_LE(std::count(said.begin(), said.end(), '\n'), 200 + 4 * 10 + 1);
}

TEST_F(Master, AsksStrangersWhoTheyAre) {
  core.on("x", wire::StatusReport{}, 0);
  core.on("x", wire::LeaseRequest{}, 0);
  core.on("x", wire::ViewRequest{}, 0);
  core.on("x", wire::TileDone{}, 0);
  EXPECT_TRUE(core.on("x", wire::MetricRows{}, 0));
  EXPECT_EQ(sent<wire::WhoAreYou>("x").size(), 5u);
  // A silent process becomes unknown, too.
  join_all();
  core.tick(100);
  core.on("v", wire::StatusReport{}, 101);
  EXPECT_EQ(sent<wire::WhoAreYou>("v").size(), 1u);
}

TEST_F(Master, LeasesArePulled) {
  join_all();
  request(1);
  EXPECT_TRUE(sent<wire::Lease>("s1").empty()) << "nobody asked";
  core.on("s1", wire::LeaseRequest{}, 1);
  const auto leases = sent<wire::Lease>("s1");
  ASSERT_EQ(leases.size(), 1u);
  core.on("s2", wire::LeaseRequest{}, 1);
  request(2);
  EXPECT_TRUE(sent<wire::Lease>("s2").empty()) << "one frame is in flight at most";
  done(leases[0]);
  const auto next = sent<wire::Lease>("s2");
  ASSERT_EQ(next.size(), 1u);
  EXPECT_EQ(next[0].request.value, 2u);
}

TEST_F(Master, SealsLeasesWithAKeyThatThePackerAloneIsTold) {
  join_all();
  const auto told = sent<wire::Welcome>("p");
  ASSERT_FALSE(told.empty());
  const auto key = told.back().lease_key;
  EXPECT_EQ(key.size(), wire::kLeaseKeyWords);
  for (const auto& peer : {"s1", "v", "d"})
    for (const auto& welcome : sent<wire::Welcome>(peer)) EXPECT_TRUE(welcome.lease_key.empty()) << peer;
  request(1);
  core.on("s1", wire::LeaseRequest{}, 1);
  const auto leases = sent<wire::Lease>("s1");
  ASSERT_EQ(leases.size(), 1u);
  EXPECT_EQ(leases[0].master.value, 42u);
  EXPECT_TRUE(wire::is_sealed(leases[0], {3}, key));
  EXPECT_FALSE(wire::is_sealed(leases[0], {4}, key)) << "it is s1's";
}

TEST_F(Master, TilesThatThePackerRefusesAreLeasedAgainAtOnce) {
  join_all();
  request(1);
  core.on("s1", wire::LeaseRequest{}, 1);
  const auto leases = sent<wire::Lease>("s1");
  ASSERT_EQ(leases.size(), 1u);
  core.on("s2", wire::LeaseRequest{}, 1);
  EXPECT_TRUE(sent<wire::Lease>("s2").empty());
  const wire::TileRefused refused{leases[0].frame, leases[0].tile, leases[0].lease, {3}, "no image"};
  core.on("v", refused, 1.1);
  EXPECT_TRUE(sent<wire::Lease>("s2").empty()) << "that is the packer's to say";
  core.on("p", refused, 1.1);
  EXPECT_EQ(sent<wire::Lease>("s2").size(), 1u);
}

TEST_F(Master, NothingIsLeasedBeforeTheSceneIsKnown) {
  core.on("p", hello("packer", "packer", 2), 0);
  core.on("s1", hello("sampler", "sampler-1", 3), 0);
  core.on("v", hello("viewer", "viewer-1", 5), 0);
  core.on("s1", wire::LeaseRequest{}, 1);
  request(1);
  EXPECT_TRUE(sent<wire::Lease>("s1").empty());
  core.on("d", hello("data", "data", 1), 1);
  core.tick(1.1);
  EXPECT_EQ(sent<wire::Lease>("s1").size(), 1u);
}

TEST_F(Master, NothingIsLeasedWithoutAPacker) {
  core.on("d", hello("data", "data", 1), 0);
  core.on("s1", hello("sampler", "sampler-1", 3), 0);
  core.on("v", hello("viewer", "viewer-1", 5), 0);
  core.on("s1", wire::LeaseRequest{}, 1);
  request(1);
  EXPECT_TRUE(sent<wire::Lease>("s1").empty());
  core.on("p", hello("packer", "packer", 2), 1);
  core.tick(1.1);
  EXPECT_EQ(sent<wire::Lease>("s1").size(), 1u);
}

TEST_F(Master, RolesAreKeptApart) {
  join_all();
  wire::ViewRequest forged;
  forged.viewer = {99};
  core.on("v", forged, 1);
  core.on("s1", wire::LeaseRequest{}, 1);
  EXPECT_TRUE(sent<wire::Lease>("s1").empty()) << "a view was asked for in another's name";
  core.on("v", wire::LeaseRequest{}, 1);  // viewers sample nothing
  request(1);
  EXPECT_TRUE(sent<wire::Lease>("v").empty());
  const auto leases = sent<wire::Lease>("s1");
  ASSERT_EQ(leases.size(), 1u);
  done(leases[0], "s1");  // only the packer can know
  EXPECT_EQ(core.counters().at("frames_completed"), 0);
  done(leases[0]);
  EXPECT_EQ(core.counters().at("frames_completed"), 1);
}

TEST_F(Master, ALeaseThatRunsOutIsCountedAndGoesToAnother) {
  join_all();
  const auto l = lease_to("s1");
  core.on("s2", wire::LeaseRequest{}, 1);
  core.tick(2.9);
  EXPECT_TRUE(sent<wire::Lease>("s2").empty());
  core.on("s1", wire::LeaseExtend{{3}, l.lease}, 2.9);
  core.tick(4.8);
  EXPECT_TRUE(sent<wire::Lease>("s2").empty());
  core.tick(5.0);
  const auto again = sent<wire::Lease>("s2");
  ASSERT_EQ(again.size(), 1u);
  EXPECT_EQ(again[0].tile, l.tile);
  EXPECT_EQ(again[0].frame, l.frame);
  EXPECT_EQ(core.counters().at("leases_expired"), 1);
  EXPECT_EQ(core.counters().at("tiles_released"), 1);
}

TEST_F(Master, ADeadSamplersLeasesCountAsExpired) {
  join_all();
  lease_to("s1");
  core.on("s2", wire::LeaseRequest{}, 1);
  core.undeliverable("s1");
  core.tick(1.05);
  EXPECT_EQ(sent<wire::Lease>("s2").size(), 1u);
  EXPECT_EQ(core.counters().at("leases_expired"), 1);
  // Its next life replaces the one that holds a lease now.
  core.on("new s2", hello("sampler", "sampler-2", 40), 1.1);
  EXPECT_EQ(core.counters().at("leases_expired"), 2);
  core.undeliverable("s2");  // its end is known already
  core.undeliverable("never seen");
  EXPECT_EQ(core.counters().at("leases_expired"), 2);
  core.on("new s2", wire::LeaseRequest{}, 1.2);
  ASSERT_EQ(sent<wire::Lease>("new s2").size(), 1u);
  // A process that says goodbye has not failed.
  core.on("new s2", wire::Goodbye{}, 1.3);
  EXPECT_EQ(core.counters().at("leases_expired"), 2);
  EXPECT_EQ(core.counters().at("tiles_released"), 3);
}

TEST_F(Master, AGoodbyeOverAnotherConnectionReleasesItsSendersLeases) {
  join_all();
  const wire::Lease lease = lease_to("s1");
  core.on("s1", wire::LeaseRequest{}, 1.1);  // it waits for another one, too
  core.on("some other socket", wire::Goodbye{{3}}, 1.2);
  core.on("s2", wire::LeaseRequest{}, 1.3);
  const auto again = sent<wire::Lease>("s2");
  ASSERT_EQ(again.size(), 1u);
  EXPECT_EQ(again[0].tile, lease.tile);
  EXPECT_TRUE(sent<wire::Lease>("s1").empty());
}

TEST_F(Master, AViewWhoseCoarsePassNobodyCouldReadIsNotSampled) {
  join_all();
  core.on("s1", wire::LeaseRequest{}, 1);
  wire::ViewRequest r;
  r.viewer = {5};
  r.request = {1};
  r.camera.left = -1000, r.camera.right = 1000, r.camera.width = 1;
  ASSERT_TRUE(geometry::validate(r.camera));
  core.on("v", r, 1);
  EXPECT_TRUE(sent<wire::Lease>("s1").empty());
}

TEST_F(Master, ASilentSamplerIsTakenForDead) {
  join_all();
  lease_to("s1", 1, 1);
  core.on("p", wire::StatusReport{}, 5.9);
  core.tick(6.1);
  EXPECT_GE(core.counters().at("leases_expired"), 1);
  const auto now = status();
  for (const auto& p : now["processes"]) EXPECT_EQ(p["alive"], p["name"] == "packer") << p["name"];
}

TEST_F(Master, AnEmptyStatusIsASignOfLife) {
  join_all();
  wire::StatusReport report;
  report.values = {{"tiles_sampled", 7}};
  core.on("s1", report, 1);
  for (double now_s = 2; now_s <= 30; now_s += 1.5) {
    core.on("s1", wire::StatusReport{{3}, {}}, now_s);
    core.tick(now_s);
  }
  const auto told = status();
  for (const auto& p : told["processes"]) {
    EXPECT_EQ(p["alive"], p["name"] == "sampler-1") << p["name"];
    if (p["name"] == "sampler-1") {
      EXPECT_EQ(p["values"]["tiles_sampled"], 7) << "as it said before";
    }
  }
}

// The other processes' messages of that time are still unread.
TEST_F(Master, AMasterThatStoodStillTakesNobodyForDead) {
  join_all();
  const auto lease = lease_to("s1", 1, 1);
  core.tick(1.1);
  core.stood_still(10, 11.1);
  core.tick(11.1);
  const auto told = status();
  for (const auto& p : told["processes"]) EXPECT_EQ(p["alive"], true) << p["name"];
  EXPECT_EQ(core.counters().at("leases_expired"), 0);
  done(lease, "p", 11.2);
  EXPECT_EQ(core.counters().at("frames_completed"), 1) << "its tile had come";
  const auto next = lease_to("s1", 2, 11.3);
  core.tick(12);
  EXPECT_EQ(core.counters().at("leases_expired"), 0);
  core.on("p", wire::StatusReport{}, 16.3);
  core.tick(16.5);
  const auto later = status();
  for (const auto& p : later["processes"]) EXPECT_EQ(p["alive"], p["name"] == "packer") << "silent since";
}

TEST_F(Master, ANewPackerStartsWithNewFrames) {
  join_all();
  const auto old = lease_to("s1");
  core.on("p2", hello("packer", "packer", 20), 1.2);
  done(old, "p2", 1.3);
  EXPECT_EQ(core.counters().at("frames_completed"), 0) << "a tile of a dropped frame";
  const auto next = lease_to("s2", 2, 1.4);
  EXPECT_GT(next.frame, old.frame);
  done(next, "p", 1.5);
  EXPECT_EQ(core.counters().at("frames_completed"), 0) << "from the packer before";
  done(next, "p2", 1.5);
  EXPECT_EQ(core.counters().at("frames_completed"), 1);
  // A second hello of the same packer drops nothing.
  const auto kept = lease_to("s1", 3, 1.6);
  core.on("p2", hello("packer", "packer", 20), 1.7);
  done(kept, "p2", 1.8);
  EXPECT_EQ(core.counters().at("frames_completed"), 2);
}

// A row of a viewer's table.
wire::MetricRows rows_of(const std::string& table, InstanceId viewer) {
  const auto& columns = metrics::viewer_columns(table);
  return {viewer, table, columns, std::vector<double>(columns.size(), 150)};
}

TEST_F(Master, LiveFiguresGoOnHoweverManyViewersCameAndLeft) {
  const auto name = [](uint64_t i) { return "viewer-" + std::to_string(i); };
  for (uint64_t i = 1; i <= 3 * LiveFigures::kMostNames; ++i) {
    core.on(name(i), hello("viewer", name(i), 100 + i), 1);
    ASSERT_TRUE(core.on(name(i), rows_of("updates", {100 + i}), 1));
    ASSERT_TRUE(core.live().viewers().contains(name(i))) << i;
    EXPECT_LE(core.live().viewers().size(), LiveFigures::kMostNames);
    if (i > 1) core.on(name(i), wire::Goodbye{{100 + i}}, 1);
  }
  EXPECT_TRUE(core.live().viewers().contains(name(1))) << "it is still here";
}

TEST_F(Master, AReplacedProcessIsMarked) {
  join_all();
  core.undeliverable("p");
  core.on("p2", hello("packer", "packer", 20), 1);
  int replaced = 0;
  for (const auto& p : core.processes()) {
    replaced += p.replaced;
    if (p.replaced) {
      EXPECT_EQ(p.pid, 20u);
    }
  }
  EXPECT_EQ(replaced, 1);
}

TEST_F(Master, TwoLivingProcessesOfOneNameStay) {
  join_all();
  sent<wire::Welcome>("p");
  core.on("p2", hello("packer", "packer", 20), 1);
  EXPECT_EQ(status()["processes"].size(), 6u);
  // The packer that was taken for a former life of the other is alive: the master asks for its hello and gets it.
  core.on("p", wire::StatusReport{}, 1.5);
  ASSERT_EQ(sent<wire::WhoAreYou>("p").size(), 1u);
  core.on("p", hello("packer", "packer", 2), 1.6);
  sent<wire::Welcome>("v");
  for (double now_s = 2; now_s < 30; now_s += 1) {
    for (const auto& [peer, instance] : {std::pair{"p", 2}, {"p2", 20}}) {
      core.on(peer, wire::StatusReport{}, now_s);
      if (int(now_s) % 7 == 0) core.on(peer, hello("packer", "packer", uint64_t(instance)), now_s);
      EXPECT_TRUE(sent<wire::WhoAreYou>(peer).empty()) << peer << " at " << now_s;
    }
    for (const char* other : {"d", "s1", "s2", "v"}) core.on(other, wire::StatusReport{}, now_s);
    core.tick(now_s);
    for (const auto& w : sent<wire::Welcome>("v")) EXPECT_EQ(w.endpoints.at("state"), "spacker");
  }
  // The packer in use stays until it leaves.
  done(lease_to("s1", 1, 30), "p2", 30.1);
  EXPECT_EQ(core.counters().at("frames_completed"), 1) << "it was there first since the other was taken for dead";
  core.on("p2", wire::Goodbye{{20}}, 31);
  EXPECT_FALSE(sent<wire::Welcome>("v").empty()) << "the other one packs now";
}

// Two packers with different names: the first stays in use until it leaves.
TEST_F(Master, ASecondPackerWaitsForTheFirstToLeave) {
  join_all();
  sent<wire::Welcome>("v");
  core.on("another", hello("packer", "packer-2", 20), 1);
  for (const auto& w : sent<wire::Welcome>("v")) EXPECT_EQ(w.endpoints.at("state"), "spacker");
  const auto kept = lease_to("s1", 1, 1.1);
  core.on("another", hello("packer", "packer-2", 20), 1.2);
  done(kept, "p", 1.3);
  EXPECT_EQ(core.counters().at("frames_completed"), 1) << "nothing was dropped";
  core.undeliverable("p");
  core.tick(1.4);
  const auto welcomes = sent<wire::Welcome>("v");
  ASSERT_FALSE(welcomes.empty());
  EXPECT_EQ(welcomes.back().endpoints.at("state"), "spacker-2");
}

TEST_F(Master, StatusTellsWhoIsWhere) {
  join_all();
  wire::StatusReport report;
  report.values = {{"points", 123}};
  core.on("p", report, 1);
  lease_to("s1");
  const auto s = status();
  ASSERT_TRUE(s.is_object());
  for (const char* key : {"epoch", "frames_completed", "frames_in_flight", "leases_expired", "tiles_released"})
    EXPECT_TRUE(s[key].is_number()) << key;
  EXPECT_EQ(s["frames_in_flight"], 1);
  ASSERT_EQ(s["processes"].size(), 5u);
  for (const auto& p : s["processes"]) {
    EXPECT_EQ(p["alive"], true);
    if (p["name"] == "packer") {
      EXPECT_EQ(p["values"]["points"], 123);
      EXPECT_EQ(p["endpoints"]["state"], "spacker");
      EXPECT_EQ(p["pid"], 20);
    }
    if (p["role"] == "sampler") {
      EXPECT_EQ(p["leases"], p["name"] == "sampler-1" ? 1 : 0);
    }
  }
}

TEST_F(Master, CommandsAreObeyedOrRefused) {
  join_all();
  core.on("c", wire::Control{"dance", {}}, 1);
  auto replies = sent<wire::ControlReply>("c");
  ASSERT_EQ(replies.size(), 1u);
  EXPECT_FALSE(replies[0].ok);
  EXPECT_NE(replies[0].text.find("dance"), std::string::npos);
  sent<wire::Welcome>("v");
  core.on("c", wire::Control{"epoch", {}}, 1);
  EXPECT_EQ(sent<wire::Welcome>("v").back().epoch.value, 2u);
  EXPECT_FALSE(core.stop_requested());
  core.on("c", wire::Control{"stop", {}}, 1);
  EXPECT_TRUE(core.stop_requested());
  core.shut_down("done");
  EXPECT_FALSE(core.everyone_left());
  for (const char* peer : {"d", "p", "s1", "s2", "v"}) {
    EXPECT_EQ(sent<wire::Shutdown>(peer).size(), 1u) << peer;
    core.on(peer, wire::Goodbye{}, 2);
  }
  EXPECT_TRUE(core.everyone_left());
}

TEST_F(Master, WhoEndsTheSessionIsToldToAll) {
  join_all();
  core.on("c", wire::Control{"stop", {{"by", "ada of node7"}}}, 1);
  EXPECT_EQ(core.stop_reason(), "the session was ended by ada of node7");
  // The sender chooses the text.
  core.on("c", wire::Control{"stop", {{"by", std::string(5000, '\xff')}}}, 1);
  EXPECT_TRUE(valid_utf8(core.stop_reason()));
  EXPECT_LT(core.stop_reason().size(), 500u);
}

TEST_F(Master, AViewerThatEndsWithoutAGoodbyeIsKnownToBeLost) {
  join_all();
  const auto lost = [&] {
    const auto all = core.processes();
    return std::count_if(all.begin(), all.end(), [](const auto& p) { return p.role == "viewer" && p.lost; });
  };
  core.undeliverable("v");
  EXPECT_EQ(lost(), 1);
  core.on("v", hello("viewer", "v", 5), 2);  // only its link was broken
  EXPECT_EQ(lost(), 0);
  core.on("v", wire::Goodbye{{5}}, 3);
  EXPECT_EQ(lost(), 0);
}

TEST_F(Master, EveryoneIsToldWhatTheSessionLacks) {
  const auto lacks = [&](const char* peer) {
    const auto welcomes = sent<wire::Welcome>(peer);
    if (welcomes.empty()) return std::string("not told");
    const auto fact = welcomes.back().facts.find("lacks");
    return fact == welcomes.back().facts.end() ? std::string() : fact->second;
  };
  core.on("v", hello("viewer", "viewer-1", 5), 0);
  EXPECT_EQ(lacks("v"), "data,packer,sampler");
  join_all();
  core.tick(1);
  EXPECT_EQ(lacks("v"), "");
  EXPECT_EQ(status()["lacks"], "");
  core.tick(2);
  EXPECT_EQ(lacks("v"), "not told") << "nothing has changed";
  core.on("s1", wire::Goodbye{}, 3);
  core.on("s2", wire::Goodbye{}, 3);
  core.tick(3);
  EXPECT_EQ(lacks("v"), "sampler");
  EXPECT_EQ(status()["lacks"], "sampler");
}

TEST_F(Master, TheKeyOfWhoEndsTheSessionIsTold) {
  using Arguments = std::map<std::string, std::string>;
  for (const auto& [arguments, key, told] :
       {std::tuple{Arguments{{"by", "ada of lab"}}, "", "the session was ended by ada of lab"},
        {Arguments{{"by", "ada of lab"}}, "operator", "the session was ended by ada of lab (key operator)"},
        {Arguments{}, "ben", "the session was ended (key ben)"},
        {Arguments{{"by", "a\nb"}}, "", "the session was ended by a\uFFFDb"},
        {Arguments{}, "", "the session was ended"}}) {
    MasterCore master{MasterOptions{}, {42}, *record};
    master.on("c", wire::Control{"stop", arguments}, 1, key);
    EXPECT_EQ(master.stop_reason(), told);
  }
}

TEST_F(Master, RowsThatWereUnderWayWhenALinkBrokeAreCounted) {
  join_all();
  const auto tells = [&](const std::string& peer, double rows, double now_s) {
    core.on(peer, wire::StatusReport{{5}, {{metrics::kUpdateRows, rows}}}, now_s);
  };
  const auto lost = [&] { return record->summary({}, {})["errors"]["record_lost"]; };
  tells("v", 0, 1);
  EXPECT_TRUE(core.on("v", rows_of("updates", {5}), 1));
  tells("v", 1, 2);
  EXPECT_TRUE(lost().is_null());
  core.on("v over another", hello("viewer", "viewer-1", 5), 20);
  tells("v over another", 4, 20);
  EXPECT_EQ(lost()["updates.csv"], 3);
}

TEST_F(Master, RowsThatDoNotFitAreTheSendersFault) {
  join_all();
  wire::MetricRows rows{{5}, "no_such_table", {"a"}, {1}};
  EXPECT_FALSE(core.on("v", rows, 1));
  for (const char* table : {"frames", "updates", "stages"}) {
    // The first rows decide which columns there are: all other viewers' rows would be refused.
    EXPECT_FALSE(core.on("s1", rows_of(table, {2}), 1)) << "samplers display nothing";
    rows.table = table;
    rows.columns = {"a"}, rows.values = {1};
    EXPECT_FALSE(core.on("v", rows, 1)) << table;
    EXPECT_TRUE(core.on("v", rows_of(table, {5}), 1)) << table;
    rows = rows_of(table, {5});
    std::swap(rows.columns[0], rows.columns[1]);
    EXPECT_FALSE(core.on("v", rows, 1)) << table;
  }
}

TEST_F(Master, AFullHouseIsToldAndCounted) {
  join_all();
  const uint64_t most = Limits{}.max_peers;
  for (uint64_t i = 5; i < most; ++i)
    core.on("x" + std::to_string(i), hello("viewer", "x" + std::to_string(i), 100 + i), 1);
  core.on("late", hello("viewer", "late", 99), 1);
  const auto told = sent<wire::Shutdown>("late");
  ASSERT_EQ(told.size(), 1u) << "it is not left to wait";
  EXPECT_NE(told[0].reason.find("--max-peers"), std::string::npos) << told[0].reason;
  EXPECT_TRUE(sent<wire::Welcome>("late").empty());
  EXPECT_EQ(status()["limits"]["hellos_refused"], 1);
  EXPECT_EQ(core.counters().at("limits.hellos_refused"), 1);
  core.on("v", hello("viewer", "viewer-1", 5), 1);
  EXPECT_FALSE(sent<wire::Welcome>("v").empty()) << "who is here may say hello again";
  core.on("x5", wire::Goodbye{{105}}, 1);
  core.on("late", hello("viewer", "late", 99), 1);
  EXPECT_EQ(sent<wire::Welcome>("late").size(), 1u) << "somebody left";
}

TEST_F(Master, HellosOfStrangeRolesAndNamesAreRefused) {
  const std::pair<const char*, std::string> bad[] = {{"x", "name"},
                                                     {"master", "name"},
                                                     {"viewer", ""},
                                                     {"viewer", "\x1b[2J"},
                                                     {"viewer", "a\nb"},
                                                     {"viewer", "a\xc2\x9b"},
                                                     {"viewer", "a\xe2\x80\xae"},
                                                     {"viewer", std::string(129, 'x')}};
  for (const auto& [role, name] : bad) {
    core.on("x", hello(role, name, 9), 0);
    EXPECT_EQ(sent<wire::Shutdown>("x").size(), 1u) << role;
    EXPECT_TRUE(sent<wire::Welcome>("x").empty()) << role;
  }
  EXPECT_EQ(core.limits_hit().hellos_refused, std::size(bad));
  EXPECT_TRUE(core.processes().empty());
  core.on("v", hello("viewer", "J\xc3\xbcrgen, \"the first\"", 5), 0);
  EXPECT_EQ(sent<wire::Welcome>("v").size(), 1u) << "anything that can be read is a name";
}

TEST_F(Master, AFloodOfOnePeerIsDroppedAndOthersAreHeard) {
  join_all();
  int heard = 0, others = 0, packers = 0;
  for (int i = 0; i < 100'000; ++i) {
    heard += core.admit("v", 1 + 1e-6 * i);
    if (i % 100 == 0) others += core.admit("s1", 1 + 1e-6 * i);
    packers += core.admit("p", 1 + 1e-6 * i);
  }
  const double most = Limits{}.max_messages;
  EXPECT_LE(heard, 2.2 * most);
  EXPECT_GE(heard, 2 * most);
  EXPECT_EQ(others, 1000);
  EXPECT_EQ(packers, 100'000) << "it tells of every tile";
  EXPECT_EQ(status()["limits"]["messages_refused"], 100'000 - heard);
  EXPECT_TRUE(core.admit("v", 5)) << "later it is heard again";
  for (int i = 0; i < 20'000; ++i) core.admit("stranger" + std::to_string(i), 6);  // the list is bounded
  EXPECT_TRUE(core.admit("v", 7));
}

TEST_F(Master, LimitsAreCountedOverAllProcesses) {
  join_all();
  core.tell_door({.connections_refused = 3, .queue_refused = 1, .max_connections = 64, .queue_limit_mb = 32});
  core.on("p", wire::StatusReport{{2}, {{"connections_refused", 20}, {"messages_refused", 5}, {"queue_refused", 2}}},
          1);
  core.on("d", wire::StatusReport{{1}, {{"connections_refused", 100}, {"messages_refused", 1e300}}}, 1);
  core.on("s1", wire::StatusReport{{3}, {{"connections_refused", std::nan("")}, {"queue_refused", -7}}}, 1);
  const auto limits = status()["limits"];
  EXPECT_EQ(limits["max_connections"], 64);
  EXPECT_EQ(limits["queue_limit_mb"], 32);
  EXPECT_EQ(limits["connections_refused"], 123);
  EXPECT_EQ(limits["messages_refused"], 5) << "a number that nobody can have counted to";
  EXPECT_EQ(limits["queue_refused"], 3);
}

TEST_F(Master, AViewBeyondTheLimitIsSampledCoarser) {
  join_all();
  wire::ViewRequest r;
  r.viewer = {5};
  r.request = {1};
  r.camera.width = r.camera.height = 16384;
  r.footprint = 1e-4;
  core.on("v", r, 1);
  core.on("s1", wire::LeaseRequest{}, 1);
  const auto leases = sent<wire::Lease>("s1");
  ASSERT_EQ(leases.size(), 1u);
  const auto& camera = leases[0].camera;
  EXPECT_LE(uint64_t(camera.width) * uint64_t(camera.height), Limits{}.max_sampling_pixels);
  EXPECT_EQ(camera.width, 4096);
  EXPECT_NEAR(camera.right - camera.left, r.camera.right - r.camera.left, 1e-3) << "all of the view";
  EXPECT_EQ(leases[0].footprint, 1e-4);
  EXPECT_EQ(status()["limits"]["views_coarser"], 1);
  EXPECT_EQ(sent<wire::Welcome>("v").back().settings.max_sampling_pixels, Limits{}.max_sampling_pixels)
      << "so that its viewer can tell";
}

TEST_F(Master, FloodsOfPeersAndRequestsAreBounded) {
  join_all();
  for (int i = 0; i < 1000; ++i) core.on("s1", wire::LeaseRequest{}, 1);
  for (uint64_t i = 0; i < 200; ++i) {
    request(i + 1);
    for (const auto& l : sent<wire::Lease>("s1")) done(l);
  }
  EXPECT_EQ(core.counters().at("frames_completed"), 64);
  for (uint64_t i = 0; i < 6000; ++i)
    core.on("x" + std::to_string(i), hello("viewer", "x" + std::to_string(i), 1000 + i), 1);
  EXPECT_LE(core.processes().size(), 4096u);
}

// Each hello may change the session that all are sent.
TEST_F(Master, AFloodOfHellosIsToldOnce) {
  join_all();
  core.tick(1);
  for (const char* peer : {"d", "p", "s1", "s2", "v"}) sent<wire::Welcome>(peer);
  wire::Hello m = hello("packer", "flood", 50);
  for (int i = 0; i < 1000; ++i) {
    m.endpoints["tiles"] = "tcp://" + std::to_string(i);
    core.on("f", m, 1 + 0.05 * i / 1000);
  }
  core.tick(1.05);
  for (const char* peer : {"d", "p", "s1", "s2", "v"}) EXPECT_LE(sent<wire::Welcome>(peer).size(), 9u) << peer;
  EXPECT_LE(sent<wire::Welcome>("f").size(), 18u) << "answers, and what all are told";
  // The newest one counts, a little later.
  for (double now_s = 1.06; now_s < 3; now_s += 0.02) core.tick(now_s);
  bool there = false;
  auto told = status();
  for (auto& p : told["processes"]) there |= p["name"] == "flood" && p["endpoints"]["tiles"] == "tcp://999";
  EXPECT_TRUE(there);
  // Many processes that say hello once each.
  for (const char* peer : {"d", "p", "s1", "s2", "v"}) sent<wire::Welcome>(peer);
  for (uint64_t i = 0; i < 1000; ++i)
    core.on("f" + std::to_string(i), hello("packer", "f" + std::to_string(i), 1000 + i), 3 + 0.05 * double(i) / 1000);
  core.tick(3.05);
  for (const char* peer : {"d", "p", "s1", "s2", "v"}) EXPECT_LE(sent<wire::Welcome>(peer).size(), 9u) << peer;
}

TEST_F(Master, AHelloOfManyEndpointsKeepsNobodyOut) {
  join_all();
  wire::Hello m = hello("viewer", "many", 50);
  for (int i = 0; i < 4095; ++i) m.endpoints["e" + std::to_string(i)] = "tcp://nowhere";
  core.on("m", m, 1);
  m = hello("sampler", "large", 51);
  for (int i = 0; i < 16; ++i) m.facts["f" + std::to_string(i)] = std::string(wire::kMaxFact, 'x');
  core.on("l", m, 1);
  m = hello("none", "stranger", 52);
  core.on("r", m, 1);
  m = hello("viewer", "nobody", 0);
  core.on("n", m, 1);
  m = hello("viewer", std::string(wire::kMaxString, 'n'), 53);
  core.on("o", m, 1);
  EXPECT_EQ(core.counters().at("limits.hellos_refused"), 5);
  for (const char* peer : {"m", "l", "r", "n", "o"}) EXPECT_TRUE(sent<wire::Welcome>(peer).empty()) << peer;
  core.on("v2", hello("viewer", "viewer-2", 6), 1);
  ASSERT_EQ(sent<wire::Welcome>("v2").size(), 1u);
  EXPECT_EQ(status()["limits"]["hellos_refused"], 5);
}

TEST_F(Master, OnlyThePackerTellsWherePatchesAre) {
  join_all();
  for (const char* role : {"viewer", "sampler", "data", "ctl"}) {
    wire::Hello m = hello(role, "hijacker", 60);
    m.facts.clear();
    m.endpoints = {
        {"patches", "tcp://evil"}, {"state", "tcp://evil"}, {"tiles", "tcp://evil"}, {"chunks", "tcp://evil"}};
    if (m.role == "data") m.box_room = {{-1e9f, -1, -1}, {1, 1, 1}}, m.endpoints.erase("chunks");
    core.on("a", m, 1);  // its name sorts before all others
    core.tick(1.1);
    core.on("v2", hello("viewer", "viewer-2", 6), 1.2);
    const auto welcomes = sent<wire::Welcome>("v2");
    ASSERT_FALSE(welcomes.empty());
    const std::map<std::string, std::string> right{
        {"tiles", "tpacker"}, {"patches", "ppacker"}, {"state", "spacker"}, {"chunks", "cdata"}};
    EXPECT_EQ(welcomes.back().endpoints, right) << role;
  }
}

TEST_F(Master, StatusFitsAMessageHoweverManyCameAndLeft) {
  join_all();
  for (uint64_t i = 0; i < 2000; ++i) {
    const std::string peer = "x" + std::to_string(i);
    wire::Hello m = hello("sampler", peer, 1000 + i);
    m.facts = {{"command", std::string(2000, 'c')}, {"arrays", std::string(60000, 'a')}};
    core.on(peer, m, 1 + double(i) * 0.01);
    wire::StatusReport report;
    for (int k = 0; k < 40; ++k) report.values["value_" + std::to_string(k)] = k + 0.5;
    core.on(peer, report, 1 + double(i) * 0.01);
    if (i % 2) core.on(peer, wire::Goodbye{{1000 + i}}, 1 + double(i) * 0.01);
    if (i % 100 == 0) core.tick(1 + double(i) * 0.01);
    core.take_outgoing();
  }
  core.on("c", wire::Control{"status", {}}, 21);
  for (const auto& out : core.take_outgoing()) {
    if (out.type != wire::ControlReply::kName) continue;
    const auto reply = wire::decode<wire::ControlReply>(std::as_bytes(std::span(out.body)));
    ASSERT_TRUE(reply) << reply.error().text;
    const auto json = nlohmann::json::parse(reply->text, nullptr, false);
    ASSERT_TRUE(json.is_object());
    EXPECT_EQ(json["processes"][0]["alive"], true) << "those who are here come first";
    EXPECT_GT(json["processes_left_out"], 0);
  }
  core.on("c", wire::Control{"status", {{"all", ""}}}, 21);
  for (const auto& out : core.take_outgoing())
    if (out.type == wire::ControlReply::kName) {
      EXPECT_TRUE(wire::decode<wire::ControlReply>(std::as_bytes(std::span(out.body))));
    }
  // After a minute, processes that left appear only in the record.
  core.tick(100);
  const auto later = status();
  EXPECT_GE(later["departed"].get<int>(), 1000);
  EXPECT_LE(core.processes().size(), 4096u);
}

// Containers ask every ten seconds, over a new connection each time.
TEST_F(Master, TenThousandPastHealthChecksCostNothing) {
  join_all();
  const auto ask = [&](int i, double now_s) {
    const std::string peer = "h" + std::to_string(i);
    if (i % 2) core.on(peer, hello("ctl", "health", 5000 + uint64_t(i)), now_s);
    core.on(peer, wire::Control{"status", {}}, now_s);
    if (i % 4 == 1) core.on(peer, wire::Goodbye{{5000 + uint64_t(i)}}, now_s);
    if (i % 4 == 3) core.undeliverable(peer);
    core.take_outgoing();
  };
  ask(0, 1);
  const auto before = status();
  for (int i = 0; i < 10000; ++i) {
    ask(i, 1 + 0.0001 * i);
    if (i % 100 == 0) core.tick(1 + 0.0001 * i);
  }
  core.tick(2.1);
  EXPECT_EQ(core.remembered(), 5u) << "those who take part";
  EXPECT_EQ(status()["processes"].size(), before["processes"].size());
  EXPECT_EQ(status()["departed"], 0);
  EXPECT_EQ(core.processes().size(), 5u);
}

TEST_F(Master, AWelcomeThatNobodyCouldReadIsNotSent) {
  Outbox outbox({1}, [](const std::string&) { return InstanceId{}; });
  wire::Welcome w;
  for (int i = 0; i < 17; ++i) w.facts["f" + std::to_string(i)] = std::string(wire::kMaxFact, 'x');
  outbox.send("v", w);
  EXPECT_EQ(outbox.size(), 0u);
  w.facts.erase("f16"), w.facts.erase("f15");
  outbox.send("v", w);
  EXPECT_EQ(outbox.size(), 1u);
}

TEST_F(Master, StatusTellsTheSessionAsSoonAsItIsKnown) {
  core.introduce({.address = "tcp://127.0.0.1:4711",
                  .pid = 77,
                  .scene = {},
                  .kind = {},
                  .run_folder = "/data/run",
                  .started_at_s = 1795377266,
                  .started_by = "view",
                  .keys = {}});
  EXPECT_EQ(core.session().scene, "");
  const auto before = status()["session"];
  EXPECT_EQ(before, (nlohmann::json{{"address", "tcp://127.0.0.1:4711"},
                                    {"pid", 77},
                                    {"scene", ""},
                                    {"kind", ""},
                                    {"started_at", "2026-11-22T19:54:26Z"},
                                    {"started_by", "view"},
                                    {"run_folder", "/data/run"},
                                    {"keys", ""}}));
  auto data = hello("data", "data", 1);
  data.facts["kind"] = "mesh";
  core.on("d", data, 0);
  EXPECT_EQ(core.session().scene, "hill");
  EXPECT_EQ(core.session().kind, "mesh");
  EXPECT_EQ(status()["session"]["scene"], "hill");
}

TEST_F(Master, StatusCountsInWholeNumbersAndTellsRates) {
  join_all();
  const auto report = [&](double at_s, double frames) {
    core.on("v", wire::StatusReport{{5}, {{"reported_s", at_s}, {"frames", frames}, {"rss_mb", 12.5}}}, at_s);
  };
  const auto viewer = [&] {
    const auto now = status();
    for (const auto& p : now["processes"])
      if (p["name"] == "viewer-1") return p;
    return nlohmann::json();
  };
  report(10, 300);
  EXPECT_TRUE(viewer()["rates"].empty()) << "of one report nothing follows";
  EXPECT_EQ(viewer()["values"]["frames"].dump(), "300");
  EXPECT_EQ(viewer()["values"]["rss_mb"].dump(), "12.5");
  report(12, 420);
  EXPECT_EQ(viewer()["rates"], (nlohmann::json{{"frames", 60.0}}));
  // The rate is that of the last five reports.
  for (int i = 1; i <= 4; ++i) report(12 + i, 420 + 10 * i);
  EXPECT_EQ(viewer()["rates"]["frames"], 10.0);
  report(17, 0);  // it counts from 0 again
  EXPECT_EQ(viewer()["rates"]["frames"], 0.0);
}

// Viewer 5 comes back on another connection; another viewer then takes its old one.
TEST_F(Master, AViewerThatMovedKeepsItsViews) {
  join_all();
  core.on("w", hello("viewer", "viewer-1", 5), 0.2);
  wire::ViewRequest r;
  r.viewer = {5};
  r.request = {1};
  r.camera.width = r.camera.height = 256;
  core.on("w", r, 0.3);
  core.on("v", hello("viewer", "viewer-2", 6), 0.4);
  core.on("s1", wire::LeaseRequest{}, 0.5);
  ASSERT_EQ(sent<wire::Lease>("s1").size(), 1u);
}

}  // namespace
}  // namespace telesplat::master
