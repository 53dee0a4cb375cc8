// telesplat-wan-relay: simulates a network link: delay, rate, jitter and stalls between processes of one machine.
#include <csignal>
#include <cstdio>

#include "common/core/log.h"
#include "common/core/version.h"
#include "common/net/service.h"
#include "common/options/complain.h"
#include "common/options/parser.h"
#include "tools/wan_relay/relay.h"

using namespace telesplat;

namespace {

constexpr const char* kProgram = "telesplat-wan-relay";

int relay(wan_relay::Options o) {
  if (const Status s = wan_relay::settle(o); !s) return complain(s.error(), 2, kProgram);
  log::initialise(o.name, o.log_level);
  std::signal(SIGPIPE, SIG_IGN);
  const auto opened = wan_relay::Relay::open(o);
  if (!opened) return complain(opened.error(), 2, kProgram);
  for (const auto& address : (*opened)->addresses()) std::printf("listening on %s\n", address.c_str());
  std::fflush(stdout);
  (*opened)->run([](const std::string& statistics) { log::info("{}", statistics); });
  log::info("{}", (*opened)->statistics());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return net::guarded_main([&] {
    wan_relay::Options o;
    options::Parser parser(
        "telesplat-wan-relay: passes TCP connections on as a link of a network would, with delay, rate, jitter and "
        "stalls; SIGUSR1 tells what passed, and so does the end");
    parser.add(wan_relay::table(o));
    parser.version(version());
    parser.parse_or_exit(kProgram, {argv + 1, argv + argc});
    return relay(o);
  });
}
