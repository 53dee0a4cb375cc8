// telesplat-health: exit code 0 if a session's master answers and, where one is asked for, a process takes part in it; 1 if not.
#include <CLI/CLI.hpp>
#include <cstdio>

#include "common/net/control.h"
#include "common/net/service.h"
#include "tools/health/health.h"

int main(int argc, char** argv) {
  using namespace telesplat;
  std::string master = "tcp://127.0.0.1:7700";
  health::Subject subject;
  bool this_host = false, show = false;
  double timeout_s = 1.2;  // the answer to a health check is due within 2 s, ends of sockets included
  CLI::App app{"telesplat-health: tells by its exit code whether a session and a process in it are well"};
  app.add_option("--master", master, "address of the master")->capture_default_str()->envname("TELESPLAT_MASTER");
  app.add_option("--role", subject.role, "a process of this role must be well: data, sampler, packer or viewer")
      ->check(CLI::IsMember({"data", "sampler", "packer", "viewer"}));
  app.add_option("--name", subject.name, "a process of this name must be well");
  app.add_flag("--host", this_host, "it must run on this host (in this container)");
  app.add_flag("--status", show, "print the master's answer: who takes part and what they count");
  app.add_option("--timeout", timeout_s, "seconds to wait for the master")
      ->capture_default_str()
      ->check(CLI::Range(0.05, 60.0));
  return net::guarded_main([&] {
    net::parse_or_exit(app, argc, argv);
    log::initialise("health", "error");
    if (this_host) subject.host = net::host_name();
    const auto status = net::ask_master(master, "status", timeout_s);
    const Status well = status ? health::check(*status, subject) : Status(status.error());
    if (status && show) std::printf("%s\n", status->c_str());
    if (!well) std::fprintf(stderr, "telesplat-health: %s\n", well.error().text.c_str());
    return well.ok() ? 0 : 1;
  });
}
