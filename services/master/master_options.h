// The flags of telesplat-master.
#pragma once

#include <string>

#include "common/net/service.h"
#include "common/options/table.h"
#include "services/master/settings.h"

namespace telesplat::master {

struct MasterServiceOptions {
  net::ServiceOptions service;  ///< bind: the control socket's address
  MasterOptions master;
  std::string out;                                      ///< run folder; empty: no record is written
  bool overwrite = false;                               ///< it may hold a record already, which is replaced
  bool goes_on = false;                                 ///< it may hold a record already, which goes on
  double table_limit_mb = 2000, trace_limit_mb = 1000;  ///< of a file of the record at most, 10^6 bytes; 0: no limit
  std::string started_by = "hand";                      ///< as net::RunningSession has it
  int metrics_port = 0;                                 ///< HTTP, for programs that watch; 0: none
  std::string metrics_address = "127.0.0.1";
  std::string label;    ///< of the record, in reports; empty: none
  std::string animate;  ///< as julia::parse_timeline takes it; empty: what the data server says
};

/// Flags that `telesplat run` has too: tiles, leases, packing. (There the data server is told of animations.) Rows
/// point into `options`.
options::Table session_table(MasterServiceOptions& options);
/// What one process may ask of the master: --max-sampling-pixels and others, which `telesplat run` has too.
options::Table limit_table(MasterServiceOptions& options);
/// --table-limit-mb and --trace-limit-mb, which `telesplat run` has too.
options::Table record_table(MasterServiceOptions& options);
/// --metrics-port, which `telesplat run` has too.
options::Row metrics_port_row(MasterServiceOptions& options);
/// All flags.
options::Table table(MasterServiceOptions& options);

}  // namespace telesplat::master
