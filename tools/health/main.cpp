// telesplat-health: the health check of a container. Exit code 0 if a session's master answers and, if a process is
// named, it takes part in the session; 1 if not.
#include <cstdio>
#include <map>

#include "common/core/version.h"
#include "common/net/control.h"
#include "common/net/master_address.h"
#include "common/net/service.h"
#include "common/options/complain.h"
#include "common/options/parser.h"

using namespace telesplat;

namespace {

struct Options {
  std::string master = "tcp://127.0.0.1:7700";
  std::string role, name, keys;
  bool this_host = false, show = false, may_be_away = false;
  double timeout_s = 1.2;  // the answer to a health check is due within 2 s, ends of sockets included
};

options::Table table(Options& o) {
  return {
      {.flag = "--master",
       .value = &o.master,
       .help = "address of the master; auto: of the one session of yours that runs on this machine",
       .environment = net::kMasterVariable},
      {.flag = "--role",
       .value = &o.role,
       .help = "a process of this role must be well: data, sampler, packer or viewer",
       .limits = options::Names{"data", "sampler", "packer", "viewer"}},
      {.flag = "--name", .value = &o.name, .help = "a process of this name must be well"},
      {.flag = "--host", .value = &o.this_host, .help = "it must run on this host (in this container)"},
      {.flag = "--master-may-be-away",
       .value = &o.may_be_away,
       .help = "0 as well while no master answers: this process waits for it, and need not be started anew"},
      {.flag = "--status", .value = &o.show, .help = "print the master's status: who takes part and what they count"},
      {.flag = "--timeout",
       .value = &o.timeout_s,
       .help = "seconds to wait for the master",
       .limits = options::Range{0.05, 60}},
      net::keys_row(o.keys)};
}

// Returns an Error if no answer comes, and a refusal if a bad one comes.
Result<wire::ControlReply> ask(const net::Access& access, const std::string& master, const std::string& command,
                               double timeout_s, const std::map<std::string, std::string>& about = {}) {
  net::Context context(access);
  net::Socket socket(context, net::Kind::kDealer, "health", net::kControlSocket);
  if (const Status s = socket.connect(master); !s) return s.error();
  return net::reply_of_master(socket, master, command, timeout_s, about);
}

int check(const Options& o) {
  log::initialise("health", "error");
  const auto master = net::find_master(o.master);
  if (master.address.empty()) return complain({master.problem}, master.exit_code(), "telesplat-health");
  const auto access = net::Access::open({}, o.keys.empty() ? master.keys : o.keys, net::any_role());
  if (!access) return complain(access.error(), 2, "telesplat-health");
  std::map<std::string, std::string> about;
  if (!o.role.empty()) about["role"] = o.role;
  if (!o.name.empty()) about["name"] = o.name;
  if (o.this_host) about["host"] = net::host_name();
  const auto well = ask(*access, master.address, "health", o.timeout_s, about);
  if (!well) return o.may_be_away ? 0 : complain(well.error(), 1, "telesplat-health");
  if (o.show)
    if (const auto status = ask(*access, master.address, "status", o.timeout_s); status)
      std::printf("%s\n", status->text.c_str());
  return well->ok ? 0 : complain({well->text}, 1, "telesplat-health");
}

}  // namespace

int main(int argc, char** argv) {
  return net::guarded_main([&] {
    Options o;
    options::Parser parser("telesplat-health: tells by its exit code whether a session and a process in it are well");
    parser.add(table(o));
    parser.version(version());
    parser.parse_or_exit("telesplat-health", {argv + 1, argv + argc});
    return check(o);
  });
}
