// The client side of the master, on a master's socket: says hello until welcomed, and again after the master restarts.
#include <gtest/gtest.h>

#include "common/core/clock.h"
#include "common/net/dispatch.h"
#include "common/net/master_link.h"
#include "tests/integration/receive.h"
#include "tests/support/patience.h"

namespace telesplat::net {
namespace {

constexpr double kDeadline_s = test::patient(20);

// A master's socket, and the messages that a process sent it.
struct FakeMaster {
  FakeMaster(const std::string& address, InstanceId instance)
      : socket(context, Kind::kRouter, "master"), instance(instance) {
    const auto bound = socket.bind(address);
    EXPECT_TRUE(bound) << bound.error().text;
    if (bound) endpoint = *bound;
  }
  // Answers hellos; asks unknown peers to introduce themselves.
  void serve() {
    while (const auto m = socket.receive()) {
      if (m->type == wire::Hello::kName) {
        const auto hello = socket.decode<wire::Hello>(*m);
        ASSERT_TRUE(hello);
        ++hellos;
        if (instances.empty() || instances.back() != hello->instance) instances.push_back(hello->instance);
        if (int(instances.size()) <= refused) {
          socket.send(wire::Shutdown{std::string(wire::kInstanceTaken) + ": eve has it"}, m->peer);
          continue;
        }
        known = true;
        wire::Welcome w;
        w.master = instance;
        w.hello_sent_s = hello->sent_s;
        w.master_s = monotonic_s() + clock_ahead_s;
        w.facts = facts;
        socket.send(w, m->peer);
      } else if (!known) {
        socket.send(wire::WhoAreYou{instance}, m->peer);
      } else if (m->type == wire::ClockRequest::kName) {
        const auto asked = socket.decode<wire::ClockRequest>(*m);
        ASSERT_TRUE(asked);
        ++clock_requests;
        const double now_s = monotonic_s() + clock_ahead_s;
        socket.send(wire::ClockReply{instance, asked->sent_s, now_s, now_s, clock}, m->peer);
      } else if (const auto report = socket.decode<wire::StatusReport>(*m)) {
        reports.push_back(report->values);
      }
      peer = m->peer;
    }
  }

  Context context;
  Socket socket;
  InstanceId instance;
  std::string endpoint, peer;
  bool known = false;
  int hellos = 0, clock_requests = 0;
  int refused = 0;  // number of first instances to refuse, as if another key had them
  std::vector<InstanceId> instances;
  std::string clock = "another";
  std::map<std::string, std::string> facts;
  double clock_ahead_s = 0;
  std::vector<std::map<std::string, double>> reports;
};

class Link : public ::testing::Test {
 protected:
  MasterLink make_link(const std::string& endpoint, double give_up_after_s = 0) {
    wire::Hello hello;
    hello.role = "sampler";
    hello.name = "sampler-1";
    return MasterLink(context, endpoint, hello, give_up_after_s);
  }
  // Lets link and master exchange messages until `done`. The link's clock runs fast: reports come soon.
  template <class Done>
  bool talk(MasterLink& link, FakeMaster* master, Done done) {
    for (const double until = monotonic_s() + kDeadline_s; monotonic_s() < until;) {
      link.tick(link_s += step_s, [] { return MasterLink::Values{{"answer", 42}}; });
      if (master) master->serve();
      wait_readable({&link.socket()}, 2);
      while (const auto m = link.socket().receive()) EXPECT_TRUE(link.handle(*m));
      if (done()) return true;
    }
    return false;
  }
  Context context;
  double link_s = monotonic_s(), step_s = 0.02;
};

TEST_F(Link, SaysHelloUntilWelcomedThenReports) {
  FakeMaster master("tcp://127.0.0.1:*", {1});
  MasterLink link = make_link(master.endpoint);
  EXPECT_NE(link.instance().value, 0u);
  ASSERT_TRUE(talk(link, &master, [&] { return link.session().has_value(); }));
  EXPECT_EQ(link.version(), 1);
  const int hellos = master.hellos;
  ASSERT_TRUE(talk(link, &master, [&] { return master.reports.size() >= 2; }));
  EXPECT_EQ(master.hellos, hellos) << "once welcomed, hello is said no more";
  EXPECT_EQ(master.reports[0].at("answer"), 42);
  EXPECT_EQ(master.reports[0].at("messages_rejected"), 0);
  EXPECT_FALSE(link.shutdown_requested());
  master.socket.send(wire::Shutdown{"enough"}, master.peer);
  EXPECT_TRUE(talk(link, &master, [&] { return link.shutdown_requested(); }));
}

TEST_F(Link, SaysHelloAgainToARestartedMaster) {
  auto first = std::make_unique<FakeMaster>("tcp://127.0.0.1:*", InstanceId{1});
  const std::string endpoint = first->endpoint;
  MasterLink link = make_link(endpoint);
  ASSERT_TRUE(talk(link, first.get(), [&] { return link.session().has_value(); }));
  first.reset();
  FakeMaster second(endpoint, {2});
  ASSERT_TRUE(talk(link, &second, [&] { return link.session()->master == InstanceId{2}; }));
  EXPECT_GE(second.hellos, 1);
  EXPECT_EQ(link.version(), 2);
  ASSERT_TRUE(talk(link, &second, [&] { return !second.reports.empty(); }));
}

// Log lines of a process that waits: the link's clock runs fast, so a minute is short.
class WaitingLink : public Link {
 protected:
  void SetUp() override {
    log::initialise("link", "info");
    step_s = 0.4;
  }
  // Returns the log lines while link and master exchange messages until `done`.
  template <class Done>
  std::string said(MasterLink& link, FakeMaster* master, Done done) {
    testing::internal::CaptureStderr();
    EXPECT_TRUE(talk(link, master, done));
    return testing::internal::GetCapturedStderr();
  }
};

TEST_F(WaitingLink, SaysThatNoMasterIsThereAndGivesUpWhereItShould) {
  MasterLink link = make_link("tcp://127.0.0.1:9", 130);
  const std::string log = said(link, nullptr, [&] { return link.shutdown_requested(); });
  const std::string what = "no master is at tcp://127.0.0.1:9";
  int lines = 0;
  for (size_t at = 0; (at = log.find(what + "; waiting", at)) != log.npos; ++at) ++lines;
  EXPECT_EQ(lines, 3) << "at 3, 63 and 123 s: " << log;
  EXPECT_NE(log.find(what + "; gives up after 130 s (--give-up-after)"), log.npos) << log;
  EXPECT_EQ(link.exit_code(), 1);
  EXPECT_FALSE(link.refused());
}

TEST_F(WaitingLink, SaysThatAHostIsNotFound) {
  MasterLink link = make_link("tcp://nohost.invalid:7700");
  const std::string log = said(link, nullptr, [&, until = monotonic_s() + 2, seen = link_s + 70] {
    return monotonic_s() > until && link_s > seen;
  });
  EXPECT_NE(log.find("no master is at tcp://nohost.invalid:7700: no host called nohost.invalid is found: "), log.npos)
      << log;
}

TEST_F(WaitingLink, SaysThatTheMasterIsGone) {
  auto master = std::make_unique<FakeMaster>("tcp://127.0.0.1:*", InstanceId{1});
  MasterLink link = make_link(master->endpoint);
  ASSERT_TRUE(talk(link, master.get(), [&] { return !master->reports.empty(); }));
  const std::string endpoint = master->endpoint;
  master.reset();
  const std::string log = said(link, nullptr, [&, until_s = link_s + 200] { return link_s > until_s; });
  EXPECT_NE(log.find("the master of the session is gone: no master is at " + endpoint), log.npos) << log;
}

TEST_F(WaitingLink, SaysThatWhatIsThereDoesNotAnswer) {
  Context others;
  Socket silent(others, Kind::kRouter, "silent");
  const auto endpoint = silent.bind("tcp://127.0.0.1:*");
  ASSERT_TRUE(endpoint);
  MasterLink link = make_link(*endpoint, 100);
  const std::string log = said(link, nullptr, [&] { return link.shutdown_requested(); });
  EXPECT_NE(log.find("what takes connections at " + *endpoint +
                     " does not answer: it is no master, is busy, or speaks "
                     "another version of the protocol than " +
                     std::to_string(wire::kProtocolVersion)),
            log.npos)
      << log;
}

TEST_F(WaitingLink, SaysWhatTheSessionLacks) {
  FakeMaster master("tcp://127.0.0.1:*", {1});
  master.facts = {{"lacks", "data,packer"}};
  MasterLink link = make_link(master.endpoint, 70);
  const std::string log = said(link, &master, [&] { return link.shutdown_requested(); });
  EXPECT_NE(log.find("the session has no data server and no packer; waiting ("), log.npos) << log;
  EXPECT_EQ(link.exit_code(), 1);
}

TEST_F(WaitingLink, TellsTheEndFromARefusal) {
  for (const bool welcomed : {true, false}) {
    FakeMaster master("tcp://127.0.0.1:*", {1});
    MasterLink link = make_link(master.endpoint);
    if (welcomed) {
      ASSERT_TRUE(talk(link, &master, [&] { return link.session().has_value(); }));
    } else {
      ASSERT_TRUE(talk(link, nullptr, [&] {
        const auto hello = master.socket.receive();
        if (hello) master.socket.send(wire::Shutdown{"it speaks version 15"}, hello->peer);
        return hello.has_value();
      }));
    }
    if (welcomed) master.socket.send(wire::Shutdown{"the session was ended by ada"}, master.peer);
    const std::string log = said(link, nullptr, [&] { return link.shutdown_requested(); });
    EXPECT_EQ(link.exit_code(), welcomed ? 0 : 2);
    EXPECT_EQ(link.shutdown_reason(), welcomed ? "the session was ended by ada" : "it speaks version 15");
    EXPECT_NE(log.find(welcomed ? "info the session was ended by ada" : "refuses sampler-1: it speaks version 15"),
              log.npos)
        << log;
  }
}

TEST_F(Link, BecomesAnotherInstanceWhereItsOwnIsTaken) {
  FakeMaster master("tcp://127.0.0.1:*", {1});
  master.refused = 2;
  MasterLink link = make_link(master.endpoint);
  std::vector<InstanceId> instances{link.instance()};
  link.on_renewed([&](InstanceId instance) { instances.push_back(instance); });
  ASSERT_TRUE(talk(link, &master, [&] { return link.session().has_value() || link.shutdown_requested(); }));
  EXPECT_FALSE(link.shutdown_requested());
  EXPECT_EQ(instances.size(), 3u);
  EXPECT_EQ(instances, master.instances) << "each was said hello as";
  EXPECT_EQ(link.instance(), instances.back());
}

// Hellos that were under way when the first one was refused are refused, too.
TEST_F(Link, BecomesAnotherInstanceOnceForAllItsHellos) {
  auto master = std::make_unique<FakeMaster>("tcp://127.0.0.1:*", InstanceId{1});
  MasterLink link = make_link(master->endpoint);
  int renewed = 0;
  link.on_renewed([&](InstanceId) { ++renewed; });
  std::vector<Message> hellos;
  ASSERT_TRUE(talk(link, nullptr, [&] {
    while (auto m = master->socket.receive()) hellos.push_back(std::move(*m));
    return hellos.size() >= 3;
  }));
  for (const Message& hello : hellos)
    master->socket.send(wire::Shutdown{std::string(wire::kInstanceTaken)}, hello.peer);
  ASSERT_TRUE(talk(link, master.get(), [&] { return link.session().has_value() || link.shutdown_requested(); }));
  EXPECT_FALSE(link.shutdown_requested());
  EXPECT_EQ(renewed, 1);
}

TEST_F(Link, IsRefusedWhereEveryInstanceIsTaken) {
  FakeMaster master("tcp://127.0.0.1:*", {1});
  master.refused = 100;
  MasterLink link = make_link(master.endpoint);
  int renewed = 0;
  link.on_renewed([&](InstanceId) { ++renewed; });
  ASSERT_TRUE(talk(link, &master, [&] { return link.shutdown_requested(); }));
  EXPECT_EQ(renewed, 3);
  EXPECT_EQ(link.exit_code(), 2);
}

TEST_F(Link, OutlivesADamagedWelcome) {
  FakeMaster master("tcp://127.0.0.1:*", {1});
  MasterLink link = make_link(master.endpoint);
  ASSERT_TRUE(talk(link, &master, [&] { return link.session().has_value(); }));
  master.socket.send_frames(master.peer, wire::Welcome::kName, wire::encode(wire::Welcome{}).substr(0, 20));
  master.socket.send_frames(master.peer, wire::Shutdown::kName, "");
  EXPECT_TRUE(talk(link, &master, [&] { return link.socket().rejected() == 2; }));
  EXPECT_EQ(link.version(), 1);
  EXPECT_FALSE(link.shutdown_requested());
}

TEST_F(Link, LearnsTheMastersClock) {
  FakeMaster master("tcp://127.0.0.1:*", {1});
  master.clock_ahead_s = 1000;
  MasterLink link = make_link(master.endpoint);
  ASSERT_TRUE(talk(link, &master, [&] { return link.session().has_value(); }));
  EXPECT_NEAR(link.to_master_s(monotonic_s()), monotonic_s() + 1000, 0.5) << "from the hello alone";
  ASSERT_TRUE(talk(link, &master, [&] { return master.reports.size() >= 3; }));
  EXPECT_GE(master.clock_requests, 8);
  const double error_s = link.clock().error_s(monotonic_s());
  EXPECT_LT(error_s, 0.01);
  EXPECT_NEAR(link.to_master_s(monotonic_s()), monotonic_s() + 1000, error_s + 1e-4);
  EXPECT_NEAR(master.reports.back().at("clock_offset_ms"), 1e6, 10);
  EXPECT_LT(master.reports.back().at("clock_error_ms"), 10);
}

TEST_F(Link, ProcessesOfOneMachineShareAClock) {
  FakeMaster master("tcp://127.0.0.1:*", {1});
  master.clock = clock_id();
  ASSERT_FALSE(master.clock.empty());
  MasterLink link = make_link(master.endpoint);
  ASSERT_TRUE(talk(link, &master, [&] { return master.reports.size() >= 2; }));
  EXPECT_EQ(link.to_master_s(5), 5);
  EXPECT_EQ(master.reports.back().at("clock_offset_ms"), 0);
  EXPECT_EQ(master.reports.back().at("clock_error_ms"), 0);
}

// A message that waits for its reader keeps its time of arrival.
TEST_F(Link, ArrivalsAreStampedWhileNobodyReads) {
  FakeMaster master("tcp://127.0.0.1:*", {1});
  MasterLink link = make_link(master.endpoint);
  ASSERT_TRUE(talk(link, &master, [&] { return link.session().has_value(); }));
  std::vector<Message> got;
  master.socket.send(wire::Shutdown{"soon"}, master.peer);  // no later message is under way
  ASSERT_TRUE(test::receive_until(
      link.socket(), [&] { return !got.empty() && got.back().type == wire::Shutdown::kName; }, &got));
  const double before_s = monotonic_s();
  master.socket.send(wire::Shutdown{"now"}, master.peer);
  ASSERT_TRUE(wait_readable({&link.socket()}, int(kDeadline_s * 1e3)));
  const double there_s = monotonic_s();
  const auto message = link.socket().receive();
  ASSERT_TRUE(message);
  EXPECT_EQ(message->type, wire::Shutdown::kName);
  EXPECT_GE(message->arrived_s, before_s);
  EXPECT_LE(message->arrived_s, there_s);
}

// From any master: a message of the control plane has at most 1 MiB.
TEST_F(Link, AControlMessageBeyondItsLimitIsDropped) {
  FakeMaster master("tcp://127.0.0.1:*", InstanceId{7});
  MasterLink link = make_link(master.endpoint);
  ASSERT_TRUE(talk(link, &master, [&] { return link.session().has_value(); }));
  const int version = link.version();
  master.socket.send_frames(master.peer, "of any type", std::string(wire::kMaxControlBytes + 1, 'x'));
  ASSERT_TRUE(talk(link, &master, [&] { return link.socket().rejected() > 0; })) << "nobody was given it";
  EXPECT_EQ(link.version(), version);
}

// A sampler may need seconds for a slab, and does not call tick() meanwhile.
TEST_F(Link, AProcessThatWorksForSecondsIsHeardOf) {
  FakeMaster master("tcp://127.0.0.1:*", InstanceId{7});
  MasterLink link = make_link(master.endpoint);
  ASSERT_TRUE(talk(link, &master, [&] { return !master.reports.empty(); }));
  master.reports.clear();
  std::vector<double> came_s;
  for (const double until = monotonic_s() + kDeadline_s; came_s.size() < 2 && monotonic_s() < until;) {
    wait_readable({&master.socket}, 5);
    master.serve();
    came_s.resize(master.reports.size(), monotonic_s());
  }
  ASSERT_EQ(came_s.size(), 2u);
  EXPECT_GT(came_s[1] - came_s[0], 0.5) << "about one a second";
  for (const auto& values : master.reports) EXPECT_TRUE(values.empty());
  ASSERT_TRUE(talk(link, &master, [&] { return !master.reports.back().empty(); })) << "and it reports again";
}

}  // namespace
}  // namespace telesplat::net
