// Peers by the thousand, and floods: of messages that make sense, of rubbish, and of one that never ends.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <map>
#include <random>

#include "common/core/clock.h"
#include "common/net/socket.h"
#include "tests/e2e/faults/fault.h"
#include "tests/support/keys/key_folder.h"
#include "tests/support/raw_peer.h"

namespace telesplat::test {
namespace {

constexpr double kFlood_s = 3;

// All sockets that are bound, by what they are called in a hello; "control" is the master's.
std::map<std::string, std::string> endpoints_of(PipelineRun& run) {
  std::map<std::string, std::string> out{{"control", run.master()}};
  const auto status = run.status();
  for (const auto& p : status["processes"])
    if (p.contains("endpoints"))
      for (const auto& [key, address] : p["endpoints"].items()) out[key] = address;
  return out;
}

// Displays like those that people use, and what strangers may cost of their frames a second.
const std::vector<std::string> kDisplay{"--size", "1280x800", "--target-fps", "60"};
constexpr double kLeastRate = 0.9;
constexpr double kUndisturbed_s = 3;
constexpr double kPatience_s = 20;  // until a peer that does not end is hung up on

struct Figures {
  std::map<std::string, pid_t> pids;
  std::map<std::string, double> mb;
  std::map<std::string, int> descriptors;
};
Figures figures_of(Fault& fault) {
  Figures out;
  for (const char* name : {"master", "packer", "data"}) {
    const pid_t pid = out.pids[name] = fault.pid_of(name);
    out.mb[name] = Fault::resident_mb(pid);
    out.descriptors[name] = Fault::descriptors(pid);
  }
  return out;
}
void expect_as_before(Fault& fault, const Figures& before, double most_mb) {
  for (const auto& [name, pid] : before.pids) {
    EXPECT_EQ(fault.pid_of(name), pid) << name << " had to be started again";
    EXPECT_LT(Fault::resident_mb(pid), before.mb.at(name) + most_mb) << name << ": MB";
    EXPECT_TRUE(wait_until(
        [&, &name = name, &pid = pid] { return Fault::descriptors(pid) <= before.descriptors.at(name) + 4; }, 20))
        << name << " keeps " << Fault::descriptors(pid) << " descriptors, had " << before.descriptors.at(name);
  }
}

TEST(Crowd, OfAThousandConnectionsComesAndGoes) {
  Fault fault("1,000 connects and disconnects at each socket, hellos of 1,000 names", kDisplay);
  ASSERT_TRUE(fault.showing());
  const auto endpoints = endpoints_of(fault.run());
  const Figures before = figures_of(fault);
  pass(kUndisturbed_s);
  fault.expect_rate(kLeastRate);
  fault.begins();
  for (int i = 0; i < 1000; ++i)
    for (const auto& [key, address] : endpoints) {
      RawPeer peer(address);
      EXPECT_TRUE(peer.connected()) << key;
      const bool talks = i % 10 == 0 && key != "patches" && key != "tiles";
      EXPECT_TRUE(!talks || peer.shake_hands("DEALER")) << key;
    }
  {
    net::Context context;
    for (int i = 0; i < 1000; ++i) {
      net::Socket peer(context, net::Kind::kDealer, "guest", {.linger_ms = 0});
      ASSERT_TRUE(peer.connect(fault.run().master()).ok());
      wire::Hello hello{.role = "viewer", .name = fmt::format("guest-{}", i), .instance = net::make_instance_id()};
      peer.send(hello);
      if (i % 4 == 0) net::wait_readable({&peer}, 200);
    }
  }
  fault.ends();
  fault.expect_resynchronised();
  expect_as_before(fault, before, 100);
  // A peer that comes now is let in.
  fault.start_guest();
  fault.finish();
}

// Without keys, with the keys of others, and without a word.
TEST(Crowd, OfAThousandStrangersAtASessionWithKeysComesAndGoes) {
  const KeyFolder keys, others;
  std::vector<std::string> arguments = kDisplay;
  arguments.insert(arguments.end(), {"--keys", keys.path()});
  Fault fault("1,000 strangers at a session with keys: without keys, and with those of others", arguments);
  fault.run().use_keys(keys.path(), keys.of(net::Role::kOperator));
  ASSERT_TRUE(fault.showing());
  const auto endpoints = endpoints_of(fault.run());
  const Figures before = figures_of(fault);
  const double refused = fault.run().status().value("keys_refused", 0.0);
  pass(kUndisturbed_s);
  fault.expect_rate(kLeastRate);
  fault.begins();
  {
    net::Context with_others(others.of(net::Role::kViewer));
    std::vector<std::unique_ptr<net::Socket>> strangers;
    for (int i = 0; i < 1000; ++i)
      for (const auto& [key, address] : endpoints) {
        RawPeer peer(address);
        EXPECT_TRUE(peer.connected()) << key;
        if (i % 10 == 0) peer.shake_hands("DEALER");
        if (i % 10 != 5) continue;
        strangers.push_back(std::make_unique<net::Socket>(with_others, net::Kind::kDealer, "stranger",
                                                          net::SocketOptions{.linger_ms = 0}));
        ASSERT_TRUE(strangers.back()->connect(address).ok());
        strangers.back()->send(wire::Hello{.role = "viewer", .name = "stranger", .instance = net::make_instance_id()});
      }
    EXPECT_TRUE(fault.run().wait_status([&](const auto& s) { return s["keys_refused"] >= refused + 100; }));
  }
  fault.ends();
  fault.expect_resynchronised();
  expect_as_before(fault, before, 100);
  fault.finish();
}

class Flood : public ::testing::TestWithParam<const char*> {
 protected:
  // As fast as they are taken.
  static void valid(const std::map<std::string, std::string>& endpoints) {
    net::Context context;
    std::map<std::string, net::Socket> peers;
    for (const auto& [key, address] : endpoints) {
      if (key == "patches") continue;
      auto [peer, made] = peers.try_emplace(key, context, key == "tiles" ? net::Kind::kPush : net::Kind::kDealer,
                                            "flood", net::SocketOptions{.linger_ms = 0});
      ASSERT_TRUE(peer->second.connect(address).ok());
    }
    const InstanceId own = net::make_instance_id();
    peers.at("control").send(wire::Hello{.role = "sampler", .name = "flood", .instance = own});
    uint64_t n = 0;
    for (const double until = monotonic_s() + kFlood_s; monotonic_s() < until; ++n) {
      peers.at("control").send(wire::LeaseExtend{own, LeaseId{1 + n % 1000}});
      peers.at("control").send(wire::StatusReport{own, {{"tiles_sampled", double(n)}}});
      peers.at("control").send(wire::Control{"status", {}});
      peers.at("state").send(wire::StateRequest{own, {}, {}});
      peers.at("state").send(wire::Receipt{own, {}, {}, double(n)});
      if (const auto chunks = peers.find("chunks"); chunks != peers.end())
        chunks->second.send(wire::ChunkRequest{EpochId{1}, ChunkId{n % 4}, {}});
      for (auto& [key, peer] : peers)
        while (key != "tiles" && peer.receive()) {
        }
    }
  }
  static void invalid(const std::map<std::string, std::string>& endpoints) {
    std::mt19937 random(11);
    net::Context context;
    std::map<std::string, net::Socket> peers;
    for (const auto& [key, address] : endpoints) {
      if (key == "patches") continue;
      auto [peer, made] = peers.try_emplace(key, context, key == "tiles" ? net::Kind::kPush : net::Kind::kDealer,
                                            "flood", net::SocketOptions{.linger_ms = 0});
      ASSERT_TRUE(peer->second.connect(address).ok());
    }
    const std::vector<std::string> types{"hello",      "status",        "view_request",  "lease_request",
                                         "depth_tile", "state_request", "chunk_request", "no_such_type"};
    for (const double until = monotonic_s() + kFlood_s; monotonic_s() < until;) {
      std::string body(random() % 3000, '\0');
      for (char& c : body) c = static_cast<char>(random());
      for (auto& [key, peer] : peers) peer.send_frames({}, types[random() % types.size()], body);
      RawPeer(std::next(endpoints.begin(), long(random() % endpoints.size()))->second).send(body);
    }
  }
  // Parts of one message, each with the flag that says that more follow, until it is hung up on.
  static void endless(const std::map<std::string, std::string>& endpoints) {
    const std::string part = zmtp_frame(std::string(65536, 'x'), true);
    std::map<std::string, RawPeer> peers;
    for (const auto& [key, address] : endpoints) {
      if (key == "patches") continue;
      RawPeer& peer = peers.try_emplace(key, address).first->second;
      EXPECT_TRUE(peer.shake_hands(key == "tiles" ? "PUSH" : "DEALER")) << key;
    }
    for (const double until = monotonic_s() + kPatience_s; !peers.empty() && monotonic_s() < until; pass(0.001))
      for (int i = 0; i < 4; ++i)
        for (auto p = peers.begin(); p != peers.end();) p = p->second.send(part) ? std::next(p) : peers.erase(p);
    for (const auto& [key, peer] : peers) ADD_FAILURE() << key << " takes a message without an end";
  }
};

TEST_P(Flood, IsSurvived) {
  const std::string of = GetParam();
  Fault fault(of == "endless" ? "a flood of never-ending (multi-part) messages to every socket, until it is hung up on"
                              : fmt::format("a flood of {} messages to every socket for {:.0f} s", of, kFlood_s),
              kDisplay);
  ASSERT_TRUE(fault.showing());
  const auto endpoints = endpoints_of(fault.run());
  const Figures before = figures_of(fault);
  pass(kUndisturbed_s);
  fault.expect_rate(kLeastRate);
  fault.begins();
  if (of == "valid") valid(endpoints);
  if (of == "invalid") invalid(endpoints);
  if (of == "endless") endless(endpoints);
  fault.ends();
  fault.expect_resynchronised();
  expect_as_before(fault, before, 300);
  fault.finish();
}

INSTANTIATE_TEST_SUITE_P(Of, Flood, ::testing::Values("valid", "invalid", "endless"),
                         [](const auto& info) { return std::string(info.param); });

}  // namespace
}  // namespace telesplat::test
