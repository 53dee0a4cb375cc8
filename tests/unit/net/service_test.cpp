// Names and addresses that processes give themselves: other processes must be able to use them, on other machines and
// in other containers.
#include <gtest/gtest.h>
#include <unistd.h>

#include "common/net/local_endpoint.h"
#include "common/net/master_address.h"
#include "common/net/service.h"
#include "common/options/parser.h"

namespace telesplat::net {
namespace {

TEST(Service, NamesTellRoleHostAndProcess) {
  ASSERT_FALSE(host_name().empty());
  EXPECT_EQ(unique_name("sampler"), "sampler-" + host_name() + "-" + std::to_string(getpid()));
}

TEST(Service, AnnouncesWhatItIsToldOrIsBoundTo) {
  EXPECT_EQ(announced("tcp://127.0.0.1:7000", ""), "tcp://127.0.0.1:7000");
  EXPECT_EQ(announced("tcp://192.168.1.5:7000", ""), "tcp://192.168.1.5:7000");
  EXPECT_EQ(announced("tcp://192.168.1.5:7000", "lab.example"), "tcp://lab.example:7000");
  EXPECT_EQ(announced("tcp://0.0.0.0:7000", "10.0.0.7"), "tcp://10.0.0.7:7000");
  EXPECT_EQ(announced("tcp://0.0.0.0:7000", "fe80::1"), "tcp://[fe80::1]:7000");
  EXPECT_EQ(announced("tcp://0.0.0.0:7000", "[fe80::1]"), "tcp://[fe80::1]:7000");
  EXPECT_EQ(announced("ipc:///run/telesplat/tiles", "lab.example"), "ipc:///run/telesplat/tiles");
  EXPECT_EQ(announced("inproc://tiles", ""), "inproc://tiles");
}

TEST(Service, NeverAnnouncesAWildcard) {
  for (const char* bound : {"tcp://0.0.0.0:7000", "tcp://[::]:7000", "tcp://*:7000"})
    EXPECT_EQ(announced(bound, ""), "tcp://" + host_name() + ":7000") << bound;
}

TEST(Service, RefusesHostsThatNobodyCanConnectTo) {
  for (const char* host : {"lab-3.example.org", "10.0.0.7", "fe80::1", "[fe80::1%eth0]", "a_container"})
    EXPECT_EQ(complain_about_host(host), "") << host;
  for (const std::string& host : {std::string("0.0.0.0"), std::string("*"), std::string("::"), std::string("[::]"),
                                  std::string(""), std::string("tcp://lab"), std::string("a b"), std::string(254, 'a')})
    EXPECT_NE(complain_about_host(host), "") << host;
}

TEST(Service, AMasterThatIsNoAddressIsRefused) {
  for (const char* text : {"foo", "tcp://", "tcp://x", "tcp://:7700", "tcp://x:0", "tcp://x:70000", "tcp://x:77y",
                           "tcp://a b:7700", "ipc://", "http://x:1"}) {
    const auto search = find_master(text);
    EXPECT_EQ(search.address, "") << text;
    EXPECT_EQ(search.problem, std::string("--master ") + text + ": is no address such as tcp://127.0.0.1:7700");
    EXPECT_EQ(search.exit_code(), 2);
  }
  for (const char* text : {"tcp://127.0.0.1:7700", "tcp://[::1]:7700", "tcp://lab:1", "ipc:///tmp/x"})
    EXPECT_EQ(find_master(text).address, text);
  setenv(kMasterVariable, "foo", 1);
  EXPECT_EQ(find_master("foo").problem, "TELESPLAT_MASTER foo: is no address such as tcp://127.0.0.1:7700");
  unsetenv(kMasterVariable);
}

TEST(Service, FlagsTakeTheMasterFromTheEnvironment) {
  const auto parse = [](std::vector<std::string> arguments, Ends ends) {
    ServiceOptions options;
    options::Parser parser("about");
    parser.add(service_table(options, ends));
    parser.parse_or_exit("program", std::move(arguments));
    return options;
  };
  setenv("TELESPLAT_MASTER", "tcp://leader:7700", 1);
  EXPECT_EQ(parse({}, Ends::kConnects).master, "tcp://leader:7700");
  EXPECT_EQ(parse({"--master", "tcp://other:1"}, Ends::kBoth).master, "tcp://other:1");
  unsetenv("TELESPLAT_MASTER");
  EXPECT_EQ(parse({}, Ends::kBoth).master, "tcp://127.0.0.1:7700");
  EXPECT_EQ(parse({"--advertise", "lab"}, Ends::kBoth).advertise, "lab");
  EXPECT_EXIT(parse({"--advertise", "0.0.0.0"}, Ends::kBoth), testing::ExitedWithCode(2), "--advertise 0.0.0.0");
  EXPECT_EXIT(parse({"--advertise", "lab"}, Ends::kConnects), testing::ExitedWithCode(2), "--advertise");
}

TEST(LocalEndpoints, AreOnesThatOthersCannotReach) {
  for (const char* local : {"tcp://127.0.0.1:7700", "tcp://127.3.2.1:*", "tcp://localhost:1", "tcp://[::1]:7",
                            "ipc:///tmp/x", "inproc://x"})
    EXPECT_TRUE(is_local(local)) << local;
  for (const char* other :
       {"tcp://127.evil:1", "tcp://127.0.0.1.example.org:1", "tcp://localhost.evil:1", "tcp://128.0.0.1:1", "tcp://*:1",
        "tcp://0.0.0.0:1", "tcp://[::]:1", "tcp://", "udp://127.0.0.1:1"})
    EXPECT_FALSE(is_local(other)) << other;
}

}  // namespace
}  // namespace telesplat::net
