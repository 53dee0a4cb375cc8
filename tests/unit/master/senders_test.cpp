// Connections that may send messages in a process' name.
#include "services/master/gate/gate.h"

#include <gtest/gtest.h>

namespace telesplat::master {
namespace {

using net::Role;

net::Message from(const std::string& peer, const std::string& user = {}, std::optional<Role> role = {}) {
  net::Message out;
  out.peer = peer;
  out.user = user;
  out.role = role;
  return out;
}

wire::Hello hello(const std::string& role, uint64_t instance) {
  wire::Hello out;
  out.role = role;
  out.instance = {instance};
  return out;
}

TEST(Senders, AHelloIsOfTheRoleOfItsKey) {
  Senders senders;
  EXPECT_TRUE(senders.admit(from("a", "sampler", Role::kSampler), hello("sampler", 1)).ok());
  const Status refused = senders.admit(from("b", "anna", Role::kViewer), hello("sampler", 2));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().text, "the key anna is a viewer's: its owner cannot be a sampler");
  EXPECT_FALSE(senders.admit(from("c", "sampler", Role::kSampler), hello("data", 3)).ok());
  EXPECT_TRUE(senders.admit(from("d", "ben", Role::kOperator), hello("viewer", 4)).ok());
  EXPECT_TRUE(senders.admit(from("e"), hello("data", 5)).ok()) << "without keys anybody may say what they like";
}

TEST(Senders, EveryoneSpeaksForThemselves) {
  Senders senders;
  ASSERT_TRUE(senders.admit(from("a"), hello("sampler", 1)).ok());
  ASSERT_TRUE(senders.admit(from("b"), hello("viewer", 2)).ok());
  const auto all = [&](const std::string& peer, uint64_t id) {
    const InstanceId instance{id};
    std::vector<Status> out;
    out.push_back(senders.admit(from(peer), wire::StatusReport{instance, {}}));
    wire::MetricRows rows;
    rows.instance = instance;
    out.push_back(senders.admit(from(peer), rows));
    wire::LeaseRequest lease;
    lease.sampler = instance;
    out.push_back(senders.admit(from(peer), lease));
    wire::LeaseExtend extend;
    extend.sampler = instance;
    out.push_back(senders.admit(from(peer), extend));
    wire::SlabReady ready;
    ready.sampler = instance;
    out.push_back(senders.admit(from(peer), ready));
    wire::ViewRequest view;
    view.viewer = instance;
    out.push_back(senders.admit(from(peer), view));
    wire::SliceWeights weights;
    weights.data = instance;
    out.push_back(senders.admit(from(peer), weights));
    wire::OrderAnswer answer;
    answer.instance = instance;
    out.push_back(senders.admit(from(peer), answer));
    out.push_back(senders.admit(from(peer), wire::Goodbye{instance}));
    return out;
  };
  for (const Status& s : all("a", 1)) EXPECT_TRUE(s.ok());
  for (const Status& s : all("a", 2)) EXPECT_FALSE(s.ok());
  for (const Status& s : all("a", 77)) EXPECT_FALSE(s.ok()) << "of somebody who never said hello";
  for (const Status& s : all("c", 1)) EXPECT_TRUE(s.ok()) << "the core asks who it is";
  // Messages may name another process.
  wire::TileDone done;
  done.sampler = {1};
  EXPECT_TRUE(senders.admit(from("b"), done).ok());
  wire::LinkReport link;
  link.viewer = {2};
  EXPECT_TRUE(senders.admit(from("a"), link).ok());
}

TEST(Senders, AProcessThatComesBackSpeaksOverItsNewConnection) {
  Senders senders;
  const auto user = [](const char* peer) { return from(peer, "sampler", Role::kSampler); };
  ASSERT_TRUE(senders.admit(user("a"), hello("sampler", 1)).ok());
  ASSERT_TRUE(senders.admit(user("b"), hello("sampler", 1)).ok());
  EXPECT_TRUE(senders.admit(user("b"), wire::StatusReport{{1}, {}}).ok());
  ASSERT_TRUE(senders.admit(user("b"), hello("sampler", 3)).ok()) << "and it may begin a new life there";
  EXPECT_FALSE(senders.admit(user("b"), wire::StatusReport{{1}, {}}).ok());
  EXPECT_TRUE(senders.admit(user("b"), wire::StatusReport{{3}, {}}).ok());
}

TEST(Senders, NobodyTakesAProcessOfAnotherKey) {
  Senders senders;
  ASSERT_TRUE(senders.admit(from("a", "anna", Role::kViewer), hello("viewer", 1)).ok());
  const Status refused = senders.admit(from("b", "ben", Role::kViewer), hello("viewer", 1));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().text, "its instance is another's: the key ben speaks in the name of a process of anna");
  EXPECT_FALSE(senders.admit(from("c", "ben", Role::kViewer), wire::Goodbye{{1}}).ok());
  EXPECT_FALSE(senders.admit(from("c", "ben", Role::kViewer), wire::StatusReport{{1}, {}}).ok());
  EXPECT_TRUE(senders.admit(from("d", "anna", Role::kViewer), wire::StatusReport{{1}, {}}).ok());
  EXPECT_TRUE(senders.admit(from("d", "anna", Role::kViewer), wire::Goodbye{{1}}).ok()) << "over another connection";
  wire::SwapReady swap;
  swap.viewer = {1};
  EXPECT_FALSE(senders.admit(from("e", "ben", Role::kViewer), swap).ok());
  EXPECT_TRUE(senders.admit(from("f", "anna", Role::kViewer), swap).ok());
}

TEST(Senders, CommandsNeedTheirRole) {
  Senders senders;
  EXPECT_TRUE(senders.admit(from("a", "anna", Role::kViewer), wire::Control{"status", {}}).ok());
  EXPECT_FALSE(senders.admit(from("a", "anna", Role::kViewer), wire::Control{"stop", {}}).ok());
  EXPECT_TRUE(senders.admit(from("b", "ben", Role::kOperator), wire::Control{"stop", {}}).ok());
  EXPECT_TRUE(senders.admit(from("c"), wire::Control{"stop", {}}).ok());
}

TEST(Senders, NoGuestIsForgottenForWhatAnotherKeySays) {
  Senders senders;
  ASSERT_TRUE(senders.admit(from("a", "anna", Role::kViewer), hello("viewer", 1)).ok());
  const auto takes_anna = [&](const std::string& peer) {
    return senders.admit(from(peer, "ben", Role::kViewer), hello("viewer", 1)).ok();
  };
  for (uint64_t i = 2; i <= 3 * Senders::kMost; ++i)
    ASSERT_TRUE(senders.admit(from("one", "ben", Role::kViewer), hello("viewer", i)).ok());
  EXPECT_FALSE(takes_anna("one")) << "many lives over one connection";
  for (uint64_t i = 2; i <= 3 * Senders::kMost; ++i)
    ASSERT_TRUE(
        senders.admit(from("p" + std::to_string(i), "ben", Role::kViewer), hello("viewer", 1'000'000 + i)).ok());
  EXPECT_FALSE(takes_anna("one")) << "many connections";
  EXPECT_TRUE(senders.admit(from("a", "anna", Role::kViewer), wire::StatusReport{{1}, {}}).ok());
}

TEST(Senders, RemembersSoManyAndNoMore) {
  Senders senders;
  for (uint64_t i = 1; i <= Senders::kMost + 10; ++i)
    ASSERT_TRUE(senders.admit(from("p" + std::to_string(i)), hello("viewer", i)).ok());
  EXPECT_TRUE(senders.admit(from("p1"), wire::StatusReport{{2}, {}}).ok()) << "forgotten: the core asks who it is";
  EXPECT_FALSE(senders.admit(from("p11"), wire::StatusReport{{2}, {}}).ok());
}

}  // namespace
}  // namespace telesplat::master
