// The table of roles: complete, and no wider than necessary.
#include "common/net/keys/roles.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "common/wire/messages.h"

namespace telesplat::net {
namespace {

using enum Role;

const std::vector<std::string> kSockets{"control", "chunks", "voxels", "tiles", "patches", "state"};

TEST(Roles, HaveNamesThatAreFoundAgain) {
  for (const Role role : kRoles) {
    EXPECT_EQ(role_named(name_of(role)), role);
    EXPECT_NE(described(role).find(name_of(role)), std::string::npos);
  }
  for (const char* other : {"", "ctl", "Viewer", "viewer ", "root"}) EXPECT_FALSE(role_named(other)) << other;
}

// Senders of each type of message, written down a second time, from the protocol's text.
TEST(Roles, SendWhatTheProtocolSaysAndNothingElse) {
  const std::set<Role> members{kData, kPacker, kSampler, kViewer, kOperator}, watchers{kViewer, kOperator};
  const std::map<std::pair<std::string, std::string_view>, std::set<Role>> allowed{
      {{"control", wire::Hello::kName}, members},
      {{"control", wire::StatusReport::kName}, members},
      {{"control", wire::MetricRows::kName}, members},
      {{"control", wire::Goodbye::kName}, members},
      {{"control", wire::ClockRequest::kName}, members},
      {{"control", wire::Control::kName}, {kServer, kData, kPacker, kSampler, kViewer, kOperator}},
      {{"control", wire::OrderAnswer::kName}, {kData, kViewer, kOperator}},
      {{"control", wire::ViewRequest::kName}, watchers},
      {{"control", wire::SwapReady::kName}, watchers},
      {{"control", wire::LeaseRequest::kName}, {kSampler}},
      {{"control", wire::LeaseExtend::kName}, {kSampler}},
      {{"control", wire::SlabReady::kName}, {kSampler}},
      {{"control", wire::TileDone::kName}, {kPacker}},
      {{"control", "tile_refused"}, {kPacker}},
      {{"control", wire::Plan::kName}, {kPacker}},
      {{"control", wire::LinkReport::kName}, {kPacker}},
      {{"control", wire::SliceWeights::kName}, {kData}},
      {{"chunks", wire::ChunkListRequest::kName}, {kSampler, kPacker}},
      {{"chunks", wire::ChunkRequest::kName}, {kSampler, kPacker}},
      {{"voxels", wire::VoxelRequest::kName}, {kSampler}},
      {{"tiles", wire::DepthTile::kName}, {kSampler}},
      {{"tiles", wire::SliceImages::kName}, {kSampler}},
      {{"tiles", wire::PictureTile::kName}, {kSampler}},
      {{"state", wire::StateRequest::kName}, watchers},
      {{"state", wire::AccessReport::kName}, watchers},
      {{"state", wire::BaseRequest::kName}, watchers},
      {{"state", wire::Receipt::kName}, watchers},
      {{"state", wire::SliceAck::kName}, watchers}};
  // Answers and announcements of servers: no process sends them to a socket that binds.
  const std::set<std::string_view> answers{
      wire::Welcome::kName,     wire::WhoAreYou::kName,  wire::ClockReply::kName,     wire::Lease::kName,
      wire::SliceLease::kName,  wire::Order::kName,      wire::ControlReply::kName,   wire::Shutdown::kName,
      wire::PlanRequest::kName, wire::FrameEnd::kName,   wire::ChunkList::kName,      wire::Chunk::kName,
      wire::VoxelData::kName,   wire::Patch::kName,      wire::Forget::kName,         wire::EpochBegin::kName,
      wire::StateMark::kName,   wire::SliceFrame::kName, wire::SlabAssignment::kName, wire::Swap::kName,
      wire::Refine::kName,      wire::StateBegin::kName, wire::Picture::kName,        wire::BaseBegin::kName,
      wire::BasePart::kName,    wire::BaseHidden::kName, wire::BaseTree::kName};
  std::set<std::string_view> types{"nonsense"};
  const auto look_at = [&](std::string_view type) {
    types.insert(type);
    const bool has_row = std::ranges::any_of(allowed, [&](const auto& row) { return row.first.second == type; });
    EXPECT_NE(has_row, answers.contains(type)) << type << ": who may send it?";
  };
  std::apply([&](const auto&... message) { (look_at(message.kName), ...); }, wire::Messages());
  for (const std::string& socket : kSockets)
    for (const std::string_view type : types)
      for (const Role role : kRoles) {
        const auto row = allowed.find({socket, type});
        EXPECT_EQ(may_send(role, socket, type), row != allowed.end() && row->second.contains(role))
            << name_of(role) << ": " << type << " to " << socket;
      }
}

TEST(Roles, AreLetInWhereTheyHaveSomethingToSay) {
  const std::map<Role, std::set<std::string>> doors{{kServer, {"control"}},
                                                    {kData, {"control"}},
                                                    {kPacker, {"control", "chunks"}},
                                                    {kSampler, {"control", "chunks", "voxels", "tiles"}},
                                                    {kViewer, {"control", "patches", "state"}},
                                                    {kOperator, {"control", "patches", "state"}}};
  for (const auto& [role, in] : doors)
    for (const std::string& socket : kSockets)
      EXPECT_EQ(may_connect(role, socket), in.contains(socket)) << name_of(role) << " at " << socket;
  EXPECT_FALSE(may_connect(kOperator, ""));
  EXPECT_FALSE(may_connect(kOperator, "other"));
}

TEST(Roles, SayHelloAsWhatTheyAre) {
  for (const Role role : kRoles)
    for (const std::string hello : {"data", "packer", "sampler", "viewer", "ctl", "master", "operator", "server", ""}) {
      const bool right =
          role == kOperator ? hello == "viewer" || hello == "ctl" : role != kServer && hello == name_of(role);
      EXPECT_EQ(may_be(role, hello), right) << name_of(role) << " as " << hello;
    }
}

TEST(Roles, WhatChangesTheSessionForAllIsTheOperators) {
  for (const char* command :
       {"stop", "set", "animate", "tf", "colour", "clip", "play", "epoch", "coupling", "go", "overlay", "anything-new"})
    for (const Role role : kRoles)
      EXPECT_EQ(may_command(role, command), role == kOperator) << name_of(role) << ": " << command;
  for (const Role role : kRoles) EXPECT_TRUE(may_command(role, "status")) << name_of(role);
  for (const char* command : {"pick", "where", "probe"})
    for (const Role role : kRoles)
      EXPECT_EQ(may_command(role, command), role == kOperator || role == kViewer) << name_of(role) << ": " << command;
  EXPECT_EQ(refused_command(kViewer, "anna", "stop"),
            "refused: stop changes the session for everyone, which needs an operator's key, and the key anna is a "
            "viewer's");
  EXPECT_TRUE(refused_command(kViewer, "anna", "\x1b[2J\nst op" + std::string(100, 'x'))
                  .starts_with("refused: ??2J?st?op" + std::string(54, 'x') + " changes"))
      << "what a peer sends steers no terminal";
  EXPECT_EQ(refused_command(kSampler, "sampler", "pick"),
            "refused: pick is for viewers and operators, and the key sampler is a sampler's");
}

}  // namespace
}  // namespace telesplat::net
