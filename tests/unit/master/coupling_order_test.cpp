// `telesplat ctl coupling` at the master: messages to viewers, refusals, and the requests that wait after a change.
#include <gtest/gtest.h>

#include "services/master/master_core.h"

namespace telesplat::master {
namespace {

using Mode = wire::CouplingOrder;

class CouplingOrders : public testing::Test {
 protected:
  CouplingOrders() {
    for (const auto& [role, name, instance] :
         {std::tuple{"viewer", "viewer-1", 5}, {"viewer", "viewer-2", 6}, {"sampler", "sampler-1", 7}}) {
      wire::Hello h;
      h.role = role;
      h.name = name;
      h.instance = {uint64_t(instance)};
      core.on(name, h, 0);
    }
    core.take_outgoing();
  }

  wire::ControlReply order(const std::map<std::string, std::string>& arguments) {
    core.on("ctl", wire::Control{"coupling", arguments}, 1);
    wire::ControlReply reply;
    told.clear();
    for (const auto& out : core.take_outgoing()) {
      const auto bytes = std::as_bytes(std::span(out.body));
      if (out.type == wire::ControlReply::kName) reply = *wire::decode<wire::ControlReply>(bytes);
      if (out.type == wire::Welcome::kName) told[out.peer] = wire::decode<wire::Welcome>(bytes)->settings;
    }
    return reply;
  }

  std::unique_ptr<metrics::RunRecord> record = std::move(metrics::RunRecord::open("")).value();
  MasterCore core{MasterOptions{}, {42}, *record};
  std::map<std::string, wire::SessionSettings> told;  // settings, by viewer
};

TEST_F(CouplingOrders, AreToldToTheViewersThatAreHere) {
  const auto reply = order({{"coupling", "loose"}, {"buffers", "4"}});
  EXPECT_TRUE(reply.ok);
  EXPECT_EQ(reply.text, "2 viewers: loose, 4 buffers");
  ASSERT_EQ(told.size(), 2u) << "nobody else's business";
  for (const auto& [viewer, settings] : told) {
    EXPECT_EQ(settings.coupling, Mode::kLoose) << viewer;
    EXPECT_EQ(settings.buffers, 4u);
  }
  EXPECT_EQ(order({{"coupling", "sync"}, {"viewer", "viewer-2"}}).text, "viewer-2: sync");
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told["viewer-2"].coupling, Mode::kSync);

  // Later announcements repeat it, to each viewer its own.
  core.on("ctl", wire::Control{"epoch", {}}, 2);
  std::map<std::string, Mode> again;
  for (const auto& out : core.take_outgoing())
    if (out.type == wire::Welcome::kName)
      again[out.peer] = wire::decode<wire::Welcome>(std::as_bytes(std::span(out.body)))->settings.coupling;
  EXPECT_EQ(again, (std::map<std::string, Mode>{
                       {"viewer-1", Mode::kLoose}, {"viewer-2", Mode::kSync}, {"sampler-1", Mode::kOwn}}));
}

TEST_F(CouplingOrders, AViewerThatComesLaterBeginsWithItsOwn) {
  order({{"coupling", "sync"}});
  wire::Hello h;
  h.role = "viewer";
  h.name = "viewer-1";
  h.instance = {99};
  core.on("another", h, 2);
  for (const auto& out : core.take_outgoing())
    if (out.type == wire::Welcome::kName && out.peer == "another") {
      EXPECT_EQ(wire::decode<wire::Welcome>(std::as_bytes(std::span(out.body)))->settings.coupling, Mode::kOwn);
    }
}

TEST_F(CouplingOrders, ThatMakeNoSenseAreRefused) {
  for (const auto& [arguments, why] :
       {std::pair{std::map<std::string, std::string>{}, "not async, sync or loose"},
        {{{"coupling", "tight"}}, "\"tight\", not async, sync or loose"},
        {{{"coupling", "loose"}, {"buffers", "0"}}, "1 to 8"},
        {{{"coupling", "loose"}, {"buffers", "9"}}, "1 to 8"},
        {{{"coupling", "loose"}, {"buffers", "2.5"}}, "1 to 8"},
        {{{"coupling", "loose"}, {"buffers", "nan"}}, "not a finite number"},
        {{{"coupling", "sync"}, {"buffers", "3"}}, "buffers are of loose coupling"},
        {{{"coupling", "sync"}, {"viewer", "nobody"}}, "no viewer is called \"nobody\"; here is viewer-1, viewer-2"}}) {
    const auto reply = order(arguments);
    EXPECT_FALSE(reply.ok);
    EXPECT_NE(reply.text.find(why), std::string::npos) << reply.text;
    EXPECT_TRUE(told.empty());
  }
  core.on("viewer-1", wire::Goodbye{{5}}, 2);
  core.on("viewer-2", wire::Goodbye{{6}}, 2);
  EXPECT_EQ(order({{"coupling", "sync"}}).text, "no viewer is here");
}

wire::ViewRequest request(uint64_t id, uint64_t buffers) {
  wire::ViewRequest r;
  r.viewer = {1};
  r.request = {id};
  r.buffers = buffers;
  return r;
}

TEST(ChangedQueue, ARequestInOrderTakesThePlaceOfAnAsynchronousOne) {
  ViewQueue q;
  q.add(request(1, 0));
  q.add(request(2, 1));
  EXPECT_EQ(q.waiting(), 1u);
  EXPECT_EQ(q.take({1}).request.value, 2u) << "else it would be dropped, and missed for as long as the patience";
  q.add(request(3, 2));
  q.add(request(4, 2));
  q.add(request(5, 0));
  EXPECT_EQ(q.waiting(), 1u);
  EXPECT_EQ(q.take({1}).request.value, 5u);
}

}  // namespace
}  // namespace telesplat::master
