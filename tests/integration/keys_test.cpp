// Sockets with keys: peers that are let in, peers that are not, and the messages that each may send.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <chrono>
#include <deque>
#include <thread>

#include "common/core/clock.h"
#include "common/core/descriptor.h"
#include "common/net/control.h"
#include "common/net/master_link.h"
#include "tests/integration/receive.h"
#include "tests/support/keys/key_folder.h"
#include "tests/support/patience.h"
#include "tests/support/raw_peer.h"

namespace telesplat::net {
namespace {

using test::KeyFolder;
using test::receive_until;

constexpr double kDeadline_s = test::patient(20);

// A socket that binds with a folder's keys.
struct Bound {
  Bound(const KeyFolder& keys, Kind kind, std::string_view serves)
      : context(keys.server()), socket(context, kind, "bound", {.serves = serves}) {
    const auto bound = socket.bind("tcp://127.0.0.1:*");
    EXPECT_TRUE(bound.ok()) << (bound ? "" : bound.error().text);
    if (bound) endpoint = *bound;
  }
  // Returns the next message that arrives; nothing if none comes in time.
  std::optional<Message> next() {
    std::vector<Message> got;
    receive_until(
        socket, [&] { return !got.empty(); }, &got);
    return got.empty() ? std::nullopt : std::optional(got.front());
  }
  bool refuses(uint64_t n) {
    return receive_until(socket, [&] { return socket.keys_refused() >= n; });
  }

  Context context;
  Socket socket;
  std::string endpoint;
};

// A process that connects.
struct Peer {
  Peer(Access access, const std::string& endpoint, Kind kind = Kind::kDealer)
      : context(std::move(access)), socket(context, kind, "peer", kControlSocket) {
    const Status s = socket.connect(endpoint);
    EXPECT_TRUE(s.ok()) << (s ? "" : s.error().text);
  }
  Context context;
  Socket socket;
};

const wire::Goodbye kGoodbye{InstanceId{7}};

TEST(Keys, WhoeverIsOnTheListIsServedAndKnown) {
  const KeyFolder keys;
  ASSERT_TRUE(keys.maker().add_person("anna", Role::kOperator).ok());
  Bound master(keys, Kind::kRouter, "control");
  for (const auto& [access, user, role] : {std::tuple{keys.of(Role::kSampler), "sampler", Role::kSampler},
                                           {keys.of(Role::kData), "data", Role::kData},
                                           {keys.named("anna"), "anna", Role::kOperator}}) {
    Peer peer(access, master.endpoint);
    ASSERT_TRUE(peer.socket.send(kGoodbye));
    const auto got = master.next();
    ASSERT_TRUE(got) << user;
    EXPECT_EQ(got->type, wire::Goodbye::kName);
    EXPECT_EQ(got->user, user);
    EXPECT_EQ(got->role, role);
    EXPECT_EQ(peer.socket.refusal().text, "");
    // The master can answer it.
    ASSERT_TRUE(master.socket.send(wire::Shutdown{"test"}, got->peer));
    std::vector<Message> answers;
    ASSERT_TRUE(receive_until(
        peer.socket, [&] { return !answers.empty(); }, &answers));
    EXPECT_EQ(answers[0].type, wire::Shutdown::kName);
    EXPECT_FALSE(answers[0].role) << "of a server: nobody asks who it is";
  }
  EXPECT_EQ(master.socket.rejected(), 0u);
  EXPECT_EQ(master.socket.keys_refused(), 0u);
}

TEST(Keys, WithoutAKeyNobodyComesIn) {
  const KeyFolder keys;
  Bound master(keys, Kind::kRouter, "control");
  Peer peer({}, master.endpoint);
  peer.socket.send(kGoodbye);
  ASSERT_TRUE(master.refuses(1));
  ASSERT_TRUE(receive_until(peer.socket, [&] { return !peer.socket.refusal().text.empty(); }));
  EXPECT_NE(peer.socket.refusal().text.find("wants a key"), std::string::npos) << peer.socket.refusal().text;
  EXPECT_FALSE(master.socket.receive());
  EXPECT_EQ(master.socket.rejected(), 0u);
}

// Listens, and closes each connection as soon as the peer's greeting is complete, before its own names a mechanism: a
// busy server with keys looks like that to a peer.
class HastyServer {
 public:
  HastyServer() {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* const any = reinterpret_cast<sockaddr*>(&address);
    EXPECT_TRUE(::bind(listener_.get(), any, size) == 0 && ::listen(listener_.get(), 16) == 0 &&
                ::getsockname(listener_.get(), any, &size) == 0);
    endpoint = fmt::format("tcp://127.0.0.1:{}", ntohs(address.sin_port));
    thread_ = std::thread([this] {
      for (;;) {
        const Descriptor peer(::accept(listener_.get(), nullptr, nullptr));
        if (!peer.valid()) return;
        greet(peer.get());
      }
    });
  }
  ~HastyServer() {
    ::shutdown(listener_.get(), SHUT_RDWR);
    thread_.join();
  }

  std::string endpoint;

 private:
  static void greet(int peer) {
    constexpr size_t kBegin = 11, kWhole = 64;
    std::string greeting = "\xff" + std::string(8, '\0') + "\x7f" + std::string("\x03\x00", 2) + "CURVE";
    greeting.resize(kWhole, '\0');
    const timeval patience{0, 200'000};
    ::setsockopt(peer, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    ::send(peer, greeting.data(), kBegin, MSG_NOSIGNAL);
    char theirs[kWhole];
    if (::recv(peer, theirs, kWhole, MSG_WAITALL) == ssize_t(kWhole)) return;
    ::send(peer, greeting.data() + kBegin, kWhole - kBegin, MSG_NOSIGNAL);
  }

  Descriptor listener_{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};
  std::thread thread_;
};

TEST(Keys, WhoIsBrokenOffLearnsThatAKeyIsWanted) {
  HastyServer master;
  Peer peer({}, master.endpoint);
  peer.socket.send(kGoodbye);
  ASSERT_TRUE(receive_until(peer.socket, [&] { return !peer.socket.refusal().text.empty(); }));
  EXPECT_EQ(peer.socket.refusal().text, "it wants a key (--keys DIR)");
  EXPECT_FALSE(peer.socket.refusal().may_pass);
}

TEST(Keys, AKeyThatIsNotOnTheListIsRefused) {
  const KeyFolder keys;
  ASSERT_TRUE(keys.maker().add_person("anna", Role::kOperator).ok());
  const Access anna = keys.named("anna");
  ASSERT_TRUE(keys.maker().revoke("anna").ok());
  Bound master(keys, Kind::kRouter, "control");
  Peer peer(anna, master.endpoint);
  peer.socket.send(kGoodbye);
  ASSERT_TRUE(master.refuses(1));
  ASSERT_TRUE(receive_until(peer.socket, [&] { return !peer.socket.refusal().text.empty(); }));
  EXPECT_EQ(peer.socket.refusal().text, "the key anna of " + keys.path() + " is not let in there");
  EXPECT_FALSE(master.socket.receive());
  EXPECT_EQ(master.socket.rejected(), 0u);
}

TEST(Keys, ARevokedKeyDoesNotComeInAgainWhileTheServerRuns) {
  const KeyFolder keys;
  ASSERT_TRUE(keys.maker().add_person("anna", Role::kOperator).ok());
  const Access anna = keys.named("anna");
  Bound master(keys, Kind::kRouter, "control");
  {
    Peer peer(anna, master.endpoint);
    ASSERT_TRUE(peer.socket.send(kGoodbye));
    ASSERT_TRUE(master.next());
  }
  ASSERT_TRUE(keys.maker().revoke("anna").ok());
  Peer peer(anna, master.endpoint);
  peer.socket.send(kGoodbye);
  EXPECT_TRUE(master.refuses(1));
  EXPECT_FALSE(master.socket.receive());
  // A new person is let in without a restart.
  ASSERT_TRUE(keys.maker().add_person("ben", Role::kViewer).ok());
  Peer ben(keys.named("ben"), master.endpoint);
  ASSERT_TRUE(ben.socket.send(kGoodbye));
  const auto got = master.next();
  ASSERT_TRUE(got);
  EXPECT_EQ(got->user, "ben");
}

// A revoked key ends its connections at all sockets; others stay.
TEST(Keys, WhoIsInWhenTheKeyIsRevokedHasToGo) {
  const KeyFolder keys;
  ASSERT_TRUE(keys.maker().add_person("anna", Role::kViewer).ok());
  ASSERT_TRUE(keys.maker().add_person("ben", Role::kViewer).ok());
  Bound master(keys, Kind::kRouter, "control"), packer(keys, Kind::kPub, "patches");
  Peer anna(keys.named("anna"), master.endpoint), ben(keys.named("ben"), master.endpoint);
  Peer hears(keys.named("anna"), packer.endpoint, Kind::kSub), stays(keys.named("ben"), packer.endpoint, Kind::kSub);
  const auto publish_until = [&](auto&& done, double deadline_s) {
    for (const double until_s = monotonic_s() + deadline_s; !done() && monotonic_s() < until_s;) {
      packer.socket.send(wire::Shutdown{"news"});
      while (master.socket.receive()) {
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return done();
  };
  int to_anna = 0, to_ben = 0;
  const auto count = [](Socket& socket, int& n) {
    while (socket.receive()) ++n;
  };
  ASSERT_TRUE(publish_until(
      [&] { return count(hears.socket, to_anna), count(stays.socket, to_ben), to_anna && to_ben; }, kDeadline_s));
  ASSERT_TRUE(anna.socket.send(kGoodbye) && ben.socket.send(kGoodbye));
  std::vector<Message> got;
  ASSERT_TRUE(receive_until(
      master.socket, [&] { return got.size() == 2; }, &got));

  ASSERT_TRUE(keys.maker().revoke("anna").ok());
  ASSERT_TRUE(keys.maker().add_person("anna", Role::kViewer).ok()) << "another key of the same name";
  const auto turned_away = [&] {
    anna.socket.send(kGoodbye);
    hears.socket.receive();
    return !anna.socket.refusal().text.empty() && !hears.socket.refusal().text.empty();
  };
  EXPECT_TRUE(publish_until(turned_away, kDeadline_s));
  EXPECT_NE(anna.socket.refusal().text.find("the key anna of "), std::string::npos) << anna.socket.refusal().text;
  count(hears.socket, to_anna), count(stays.socket, to_ben);
  const int before = std::exchange(to_anna, 0);
  to_ben = 0;
  EXPECT_GT(before, 0);
  ASSERT_TRUE(ben.socket.send(kGoodbye));
  bool heard = false;
  for (const double until_s = monotonic_s() + kDeadline_s; !heard && monotonic_s() < until_s;) {
    packer.socket.send(wire::Shutdown{"news"});
    anna.socket.send(kGoodbye);
    while (const auto message = master.socket.receive()) {
      EXPECT_EQ(message->user, "ben");
      heard = heard || message->user == "ben";
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    count(hears.socket, to_anna), count(stays.socket, to_ben);
  }
  EXPECT_TRUE(heard);
  EXPECT_GT(to_ben, 0);
  EXPECT_EQ(to_anna, 0);
  EXPECT_EQ(ben.socket.refusal().text, "");
}

TEST(Keys, AnotherServersKeysAreRefusedAndToldSo) {
  const KeyFolder keys, others;
  Bound master(keys, Kind::kRouter, "control");
  Peer peer(others.of(Role::kOperator), master.endpoint);
  peer.socket.send(kGoodbye);
  ASSERT_TRUE(master.refuses(1));
  ASSERT_TRUE(receive_until(peer.socket, [&] { return !peer.socket.refusal().text.empty(); }));
  EXPECT_EQ(peer.socket.refusal().text, "it does not take the keys of " + others.path() + ": it has others, or none");
  EXPECT_TRUE(peer.socket.refusal().may_pass);
  EXPECT_FALSE(master.socket.receive());
}

TEST(Keys, WhoHasKeysTalksToNobodyWithout) {
  const KeyFolder keys;
  Context context;
  Socket open(context, Kind::kRouter, "open");
  const auto endpoint = open.bind("tcp://127.0.0.1:*");
  ASSERT_TRUE(endpoint.ok());
  Peer peer(keys.of(Role::kViewer), *endpoint);
  peer.socket.send(kGoodbye);
  ASSERT_TRUE(receive_until(peer.socket, [&] { return !peer.socket.refusal().text.empty(); }));
  EXPECT_EQ(peer.socket.refusal().text, "it does not take the keys of " + keys.path() + ": it has others, or none");
  EXPECT_FALSE(open.receive());
}

TEST(Keys, ARoleSendsOnlyWhatIsItsOwn) {
  const KeyFolder keys;
  Bound master(keys, Kind::kRouter, "control");
  Peer viewer(keys.of(Role::kViewer), master.endpoint), sampler(keys.of(Role::kSampler), master.endpoint);
  for (const std::string_view type : {"lease_request", "tile_done", "plan", "slice_weights", "slab_ready", "nonsense"})
    viewer.socket.send_frames({}, type, "not even a message");
  viewer.socket.send(kGoodbye);
  auto got = master.next();
  ASSERT_TRUE(got);
  EXPECT_EQ(got->type, wire::Goodbye::kName) << "what came before was refused before it was decoded";
  EXPECT_EQ(master.socket.rejected(), 6u);
  sampler.socket.send_frames({}, "view_request", "");
  sampler.socket.send_frames({}, "lease_request", "body");
  got = master.next();
  ASSERT_TRUE(got);
  EXPECT_EQ(got->type, "lease_request");
  EXPECT_EQ(master.socket.rejected(), 7u);
}

TEST(Keys, ARoleIsNotLetInWhereItHasNothingToSay) {
  const KeyFolder keys;
  Bound tiles(keys, Kind::kPull, "tiles");
  Peer viewer(keys.of(Role::kViewer), tiles.endpoint, Kind::kPush);
  viewer.socket.send_frames({}, "depth_tile", "a tile");
  ASSERT_TRUE(tiles.refuses(1));
  EXPECT_FALSE(tiles.socket.receive());
  Peer sampler(keys.of(Role::kSampler), tiles.endpoint, Kind::kPush);
  ASSERT_TRUE(sampler.socket.send_frames({}, "depth_tile", "a tile"));
  const auto got = tiles.next();
  ASSERT_TRUE(got);
  EXPECT_EQ(got->user, "sampler");
}

TEST(Keys, PatchesAreForWatchersAlone) {
  const KeyFolder keys;
  Bound patches(keys, Kind::kPub, "patches");
  Peer viewer(keys.of(Role::kViewer), patches.endpoint, Kind::kSub),
      sampler(keys.of(Role::kSampler), patches.endpoint, Kind::kSub), nobody({}, patches.endpoint, Kind::kSub);
  std::vector<Message> got;
  for (const double until = monotonic_s() + kDeadline_s; got.empty() && monotonic_s() < until;) {
    patches.socket.send_frames({}, "patch", "points");
    receive_until(
        viewer.socket, [&] { return !got.empty(); }, &got, 0.05);
  }
  EXPECT_FALSE(got.empty());
  ASSERT_TRUE(patches.refuses(2));
  patches.socket.send_frames({}, "patch", "points");
  patches.socket.send_frames({}, "patch", "the last points");
  ASSERT_TRUE(receive_until(
      viewer.socket, [&] { return got.back().body.size() == std::string_view("the last points").size(); }, &got));
  EXPECT_FALSE(sampler.socket.receive());
  EXPECT_FALSE(nobody.socket.receive());
}

TEST(Keys, HundredsOfStrangersCostNobodyAnything) {
  const KeyFolder keys, others;
  Bound master(keys, Kind::kRouter, "control");
  Peer friendly(keys.of(Role::kSampler), master.endpoint);
  std::deque<Peer> strangers;
  for (int i = 0; i < 30; ++i) {
    strangers.emplace_back(Access(), master.endpoint);
    strangers.emplace_back(others.of(Role::kOperator), master.endpoint);
    for (auto s = strangers.end() - 2; s != strangers.end(); ++s) s->socket.send(kGoodbye);
    if (i % 10 == 0) {
      ASSERT_TRUE(friendly.socket.send(kGoodbye));
      const auto got = master.next();
      ASSERT_TRUE(got);
      EXPECT_EQ(got->user, "sampler");
    }
  }
  EXPECT_TRUE(master.refuses(60));
  EXPECT_EQ(master.socket.rejected(), 0u);
}

TEST(Keys, RandomBytesAreCountedAndRefused) {
  const KeyFolder keys;
  Bound master(keys, Kind::kRouter, "control");
  {
    test::RawPeer peer(master.endpoint);
    peer.send(std::string(200, 'x'));
    EXPECT_TRUE(receive_until(
        master.socket, [&] { return master.socket.keys_refused() + master.socket.rejected() >= 1; }, nullptr, 8));
  }
  {
    // A plain peer of our own protocol without a key.
    test::RawPeer peer(master.endpoint);
    EXPECT_FALSE(peer.shake_hands("DEALER"));
  }
  EXPECT_TRUE(receive_until(
      master.socket, [&] { return master.socket.keys_refused() + master.socket.rejected() >= 2; }, nullptr, 8));
  EXPECT_FALSE(master.socket.receive());
}

TEST(Keys, AddressesOfOtherMachinesNeedKeysOrTheWord) {
  const KeyFolder keys;
  Context open, keyed(keys.server());
  Socket without(open, Kind::kRouter, "master"), with(keyed, Kind::kRouter, "master", {.serves = "control"});
  const auto refused = without.bind("tcp://0.0.0.0:*");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().text,
            "master: tcp://0.0.0.0:* is not a loopback or ipc address; others need --keys, or --insecure");
  EXPECT_TRUE(with.bind("tcp://0.0.0.0:*").ok());
}

// The warning comes once: a process that looks for its master connects again and again.
TEST(Keys, WhoSpeaksToOtherMachinesInClearIsWarned) {
  log::initialise("keys", "warn");
  const KeyFolder keys;
  const char* const kFar = "tcp://192.0.2.1:9";
  const auto said = [&](const net::Access& access, const char* endpoint) {
    testing::internal::CaptureStderr();
    {
      Context context(access);
      for (int times = 0; times < 2; ++times) {
        Socket socket(context, Kind::kDealer, "viewer", {.linger_ms = 0, .toward = "data"});
        EXPECT_TRUE(socket.connect(endpoint).ok());
      }
    }
    const std::string text = testing::internal::GetCapturedStderr();
    EXPECT_EQ(text.empty(), text.find(kFar) == text.npos) << text;
    return std::count(text.begin(), text.end(), '\n');
  };
  net::Access wanted;
  wanted.allow_clear();
  EXPECT_EQ(said({}, kFar), 1);
  EXPECT_EQ(said({}, "tcp://127.0.0.1:9"), 0);
  EXPECT_EQ(said(wanted, kFar), 0);
  EXPECT_EQ(said(keys.of(Role::kViewer), kFar), 0);
  EXPECT_EQ(said(*net::Via::parse({"data=127.0.0.1:9"}), kFar), 0) << "the proxy is this machine's";
}

TEST(Keys, ASocketThatIsForNothingIsNotBound) {
  const KeyFolder keys;
  Context keyed(keys.server()), viewers(keys.of(Role::kViewer));
  Socket nothing(keyed, Kind::kRouter, "x"), viewer(viewers, Kind::kRouter, "y", {.serves = "control"});
  EXPECT_EQ(nothing.bind("tcp://127.0.0.1:*").error().text, "x: its keys are not for binding");
  EXPECT_EQ(viewer.bind("tcp://127.0.0.1:*").error().text, "y: its keys are not for binding");
}

TEST(Keys, NobodyIsLetInWhileTheListCannotBeRead) {
  const KeyFolder keys;
  Bound master(keys, Kind::kRouter, "control");
  const std::string list = keys.path() + "/allowed.toml";
  std::filesystem::permissions(list, std::filesystem::perms(0666));
  std::filesystem::last_write_time(list, std::filesystem::file_time_type::clock::now());
  Peer peer(keys.of(Role::kSampler), master.endpoint);
  peer.socket.send(kGoodbye);
  EXPECT_TRUE(master.refuses(1));
  EXPECT_FALSE(master.socket.receive());
  std::filesystem::permissions(list, std::filesystem::perms(0600));
  std::filesystem::last_write_time(list, std::filesystem::file_time_type::clock::now() + std::chrono::seconds(1));
  Peer again(keys.of(Role::kSampler), master.endpoint);
  ASSERT_TRUE(again.socket.send(kGoodbye));
  EXPECT_TRUE(master.next());
}

TEST(Keys, WhoAsksAMasterIsToldWhatIsWrongAtOnce) {
  const KeyFolder keys, others;
  Bound master(keys, Kind::kRouter, "control");
  for (const auto& [access, why] : {std::pair{Access(), std::string("wants a key")},
                                    {others.of(Role::kOperator), "it does not take the keys of " + others.path()}}) {
    const double begin_s = monotonic_s();
    const auto answer = ask_master(master.endpoint, "status", 3 * kDeadline_s, {}, access);
    ASSERT_FALSE(answer.ok());
    EXPECT_TRUE(answer.error().text.starts_with("the master at " + master.endpoint + " refuses: "))
        << answer.error().text;
    EXPECT_NE(answer.error().text.find(why), std::string::npos) << answer.error().text;
    EXPECT_LT(monotonic_s() - begin_s, kDeadline_s) << "it was waited for";
  }
}

TEST(Keys, AProcessThatTheMasterRefusesEnds) {
  const KeyFolder keys;
  Bound master(keys, Kind::kRouter, "control");
  Context context;
  wire::Hello hello;
  hello.role = "sampler";
  MasterLink link(context, master.endpoint, hello);
  for (const double until = monotonic_s() + kDeadline_s; !link.shutdown_requested() && monotonic_s() < until;) {
    link.tick(monotonic_s(), [] { return MasterLink::Values(); });
    wait_readable({&link.socket()}, 20);
    link.receive();
  }
  EXPECT_TRUE(link.shutdown_requested());
  EXPECT_TRUE(link.refused());
}

}  // namespace
}  // namespace telesplat::net
