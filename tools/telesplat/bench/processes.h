// The processes of a benchmark's session: master, data server, packer and any number of samplers, all real.
#pragma once

#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "tools/telesplat/control/client.h"
#include "tools/telesplat/run/process_group.h"

namespace telesplat::launcher {

class BenchProcesses {
 public:
  /// data_arguments: scene and flags of telesplat-data. The master records into `directory`, logs go to directory/logs.
  /// own_machines: samplers stand for machines of their own, so the packer gives way to none of them; else all have the
  /// priorities that `telesplat run` gives them. Returns once the master listens; wait_for_data() waits for the others.
  /// Error: what failed to start, or took over 20 s, or that Ctrl-C came.
  static Result<std::unique_ptr<BenchProcesses>> start(const std::vector<std::string>& data_arguments,
                                                       const std::vector<std::string>& master_flags,
                                                       const std::string& directory, bool own_machines);
  ~BenchProcesses();

  const std::string& endpoint() const { return group_.endpoint(); }
  const std::string& directory() const { return directory_; }

  /// What is done while one waits: keeping connections of one's own going.
  using Meanwhile = std::function<void()>;
  /// Data server and packer have joined. Errors as start(); a data server may read for `patience_s`.
  Status wait_for_data(double patience_s, const Meanwhile& meanwhile);
  /// Starts samplers with these flags until there are `count`; returns when all of them have joined. Errors as start().
  Status add_samplers(size_t count, const std::vector<std::string>& flags, const Meanwhile& meanwhile);
  /// kill -9. index: from 0.
  void kill_sampler(size_t index);

  /// Error: Ctrl-C, or a process died that was not killed with kill_sampler().
  Status alive();
  std::optional<nlohmann::json> status();
  /// Ends all processes; the record is complete then.
  void finish();

 private:
  explicit BenchProcesses(const std::string& directory);
  /// Waits until the master knows `count` living processes of a role.
  Status wait_for_role(const char* what, const std::string& role, int count, double patience_s,
                       const Meanwhile& meanwhile);

  std::string directory_;
  ProcessGroup group_;
  size_t samplers_ = 0;
  std::unique_ptr<ControlClient> control_;
};

}  // namespace telesplat::launcher
