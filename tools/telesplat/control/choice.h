// Which session a command of `telesplat ctl` means.
#pragma once

#include <memory>
#include <string>

#include "common/options/table.h"
#include "tools/telesplat/control/client.h"

namespace telesplat::launcher {

struct SessionChoice {
  std::string master;   ///< --master, or TELESPLAT_MASTER in the environment; empty: the one that runs here
  std::string session;  ///< --session: as net::find_master() takes it
  std::string keys;     ///< --keys: folder; empty: those that the session's file names, if it runs here
};

options::Table session_rows(SessionChoice& choice);

/// A connection to the session's master. Null: it is not known; why was said on stderr, and `exit_code` is set.
std::unique_ptr<ControlClient> reach(const SessionChoice& choice, const options::Given& given, int& exit_code,
                                     const std::vector<net::Role>& roles = net::asking_roles());

/// Prints what the master answered to an order; done: in place of an answer that says nothing. Exit code: 1: there is
/// no answer, 2: it refused, so it was asked for something wrong.
int tell_answer(const Result<wire::ControlReply>& reply, const std::string& done = {});

}  // namespace telesplat::launcher
