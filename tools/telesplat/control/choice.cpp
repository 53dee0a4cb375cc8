#include "tools/telesplat/control/choice.h"

#include <algorithm>
#include <cstdio>

#include "common/net/master_address.h"
#include "common/net/service.h"
#include "tools/common/complain.h"

namespace telesplat::launcher {

options::Table session_rows(SessionChoice& c) {
  return {{.flag = "--master",
           .value = &c.master,
           .help = "address of the session's master; default: the one session of yours that runs on this machine",
           .environment = net::kMasterVariable},
          {.flag = "--session",
           .value = &c.session,
           .help = "of several sessions on this machine: its PID, scene or run folder, as telesplat ctl list tells"},
          net::keys_row(c.keys)};
}

std::unique_ptr<ControlClient> reach(const SessionChoice& c, const options::Given& given, int& exit_code,
                                     const std::vector<net::Role>& roles) {
  const bool is_told = std::find(given.begin(), given.end(), "--master") != given.end();
  const std::string environment = net::master_from_environment();
  if (!c.session.empty() && is_told && c.master != environment) {
    exit_code = tools::complain({"--master and --session both say which session is meant: give one of them"});
    return nullptr;
  }
  const auto search = net::find_master(c.session.empty() ? c.master : std::string(), c.session);
  if (search.address.empty()) {
    exit_code = tools::complain({search.problem}, search.exit_code());
    return nullptr;
  }
  const auto access = net::Access::open({}, c.keys.empty() ? search.keys : c.keys, roles);
  if (!access) {
    exit_code = tools::complain(access.error());
    return nullptr;
  }
  return std::make_unique<ControlClient>(search.address, *access);
}

int tell_answer(const Result<wire::ControlReply>& reply, const std::string& done) {
  if (!reply) return tools::complain(reply.error(), 1);
  if (!reply->ok) return tools::complain({reply->text});
  std::printf("%s\n", reply->text == "{}" && !done.empty() ? done.c_str() : reply->text.c_str());
  return 0;
}

}  // namespace telesplat::launcher
