// Peers that send rubbish to every socket of a running pipeline: dropped, counted, the run goes on.
#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <random>
#include <vector>

#include "common/net/socket.h"
#include "tests/support/pipeline_run.h"
#include "tests/support/raw_peer.h"

namespace telesplat::test {
namespace {

constexpr int kPerSocket = 6;  // offences that every socket is to count

// kPerSocket offences against a socket that talks to peers of this kind.
void offend(const std::string& endpoint, net::Kind kind, const char* zmtp_type, std::mt19937& random) {
  for (int i = 0; i < 3; ++i) {  // random bytes
    std::string bytes(1 + random() % 2000, '\0');
    for (char& c : bytes) c = static_cast<char>(random());
    RawPeer(endpoint).send(bytes);
  }
  {
    RawPeer peer(endpoint);  // a frame larger than memory
    EXPECT_TRUE(peer.shake_hands(zmtp_type));
    peer.send(zmtp_claim(uint64_t(1) << 62));
    EXPECT_TRUE(peer.wait_hung_up(20000)) << endpoint;
  }
  {
    RawPeer peer(endpoint);  // half a frame
    EXPECT_TRUE(peer.shake_hands(zmtp_type));
    peer.send(zmtp_frame(std::string(1000, 'x'), true).substr(0, 500));
  }
  if (kind == net::Kind::kPub) {
    RawPeer peer(endpoint);
    EXPECT_TRUE(peer.shake_hands("SUB"));
    peer.send(zmtp_frame("\x01some_topic", false));
    return;
  }
  net::Context context;
  net::Socket peer(context, kind == net::Kind::kPull ? net::Kind::kPush : net::Kind::kDealer, "hostile");
  EXPECT_TRUE(peer.connect(endpoint).ok());
  peer.send_frames({}, "no_such_type", "x");
  // Beyond what every socket is to count, what each knows.
  for (const std::string_view type : {"hello", "chunk_request", "depth_tile", "state_request"}) {
    std::string body = wire::encode(wire::WhoAreYou{InstanceId{1}});
    peer.send_frames({}, type, body);               // fields are missing
    peer.send_frames({}, type, body.substr(0, 7));  // cut short
    body[body.find("\xa1v") + 2] = 9;
    peer.send_frames({}, type, body);                          // another version
    peer.send_frames({}, type, std::string(2 << 20, '\xc1'));  // too large for most, and no msgpack for all
  }
}

TEST(Hostile, RubbishOnEverySocketIsCountedAndTheRunGoesOn) {
  // Without keys: these strangers shall get in.
  PipelineRun run({"--duration", "0", "--samplers", "2", "--keys", "none"});
  ASSERT_TRUE(run.wait_showing()) << run.program().err();
  const auto before = run.status();
  std::map<std::string, std::string> endpoints;
  for (const auto& p : before["processes"])
    if (p.contains("endpoints"))
      for (const auto& [key, address] : p["endpoints"].items()) endpoints[key] = address;
  ASSERT_EQ(endpoints.size(), 4u) << before.dump(1);
  endpoints["control"] = run.master();

  std::mt19937 random(3);
  for (const auto& [key, endpoint] : endpoints) {
    const auto kind = key == "tiles" ? net::Kind::kPull : key == "patches" ? net::Kind::kPub : net::Kind::kRouter;
    offend(endpoint, kind, kind == net::Kind::kPull ? "PUSH" : kind == net::Kind::kPub ? "SUB" : "DEALER", random);
  }
  EXPECT_TRUE(run.wait_status([&](const auto& s) {
    return value(s, "data", "messages_rejected") >= kPerSocket &&
           value(s, "packer", "messages_rejected") >= 3 * kPerSocket;
  })) << run.status().dump(1);
  // All processes still serve: frames are displayed, views updated, and no process was started again.
  const auto now = run.status();
  EXPECT_TRUE(run.wait_status([&](const auto& s) {
    return value(s, "viewer-1", "frames") > value(now, "viewer-1", "frames") &&
           value(s, "viewer-1", "updates") > value(now, "viewer-1", "updates");
  }));
  EXPECT_EQ(run.stop(), 0) << run.program().err();
  EXPECT_EQ(run.program().err().find("died"), std::string::npos) << run.program().err();
  EXPECT_GE(run.summary()["errors"]["messages_rejected"], 5 * kPerSocket);
  EXPECT_TRUE(run.all_gone());
}

TEST(Hostile, ConnectionsBeyondTheLimitAreRefusedAndTold) {
  constexpr int kMost = 10, kStrangers = 40;
  PipelineRun run({"--duration", "0", "--max-connections", std::to_string(kMost), "--keys", "none"});
  ASSERT_TRUE(run.wait_showing()) << run.program().err();
  const auto before = run.status();
  EXPECT_EQ(before["limits"]["max_connections"], kMost);
  EXPECT_EQ(before["limits"]["connections_refused"], 0);
  std::vector<std::string> endpoints{run.master()};
  for (const auto& p : before["processes"])
    if (p.contains("endpoints"))
      for (const auto& [key, address] : p["endpoints"].items()) endpoints.push_back(address);
  ASSERT_EQ(endpoints.size(), 5u) << before.dump(1);
  std::vector<std::unique_ptr<RawPeer>> strangers;
  for (const auto& endpoint : endpoints)
    for (int i = 0; i < kStrangers; ++i) strangers.push_back(std::make_unique<RawPeer>(endpoint));
  const double refused = kStrangers - kMost;  // each socket refuses at least these
  EXPECT_TRUE(run.wait_status([&](const auto& s) {
    return value(s, "data", "connections_refused") >= refused &&
           value(s, "packer", "connections_refused") >= 3 * refused &&
           s["limits"]["connections_refused"].template get<double>() >= 5 * refused;
  })) << run.status().dump(1);
  const auto now = run.status();
  EXPECT_TRUE(run.wait_status([&](const auto& s) {
    return value(s, "viewer-1", "frames") > value(now, "viewer-1", "frames") &&
           value(s, "viewer-1", "updates") > value(now, "viewer-1", "updates");
  })) << "those who are known stay";
  EXPECT_EQ(run.stop(), 0) << run.program().err();
  EXPECT_EQ(run.program().err().find("died"), std::string::npos) << run.program().err();
  EXPECT_GE(run.summary()["limits"]["connections_refused"], 5 * refused);
}

}  // namespace
}  // namespace telesplat::test
