// A pipeline of real processes for the scaling study: master, data server and packer of a Julia set, any number of
// samplers, and this process in the viewer's place.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "common/net/master_link.h"
#include "tools/telesplat/control/client.h"
#include "tools/telesplat/run/process_group.h"

namespace telesplat::lab {

class Session {
 public:
  /// scene_flags: flags of telesplat-data julia. The master records into `directory`, logs go to directory/logs.
  /// own_machines: samplers stand for machines of their own, so the packer gives way to none of them; else all have the
  /// priorities that `telesplat run` gives them. Returns when data server and packer have joined. Error: a process
  /// failed to start or took over 20 s, or Ctrl-C came.
  static Result<std::unique_ptr<Session>> start(const std::vector<std::string>& scene_flags,
                                                const std::string& directory, bool own_machines);
  ~Session();

  /// Starts samplers with these flags until there are `count`; returns when all of them have joined. Errors as start().
  Status add_samplers(size_t count, const std::vector<std::string>& flags);

  /// Progress of a frame. rows: number of rows that have arrived here.
  struct Progress {
    double elapsed_s = 0;
    int rows = 0;
    bool complete = false;
  };
  /// Requests a frame and waits for its last patch; returns the seconds that it took. Calls `watch` every 50 ms or
  /// sooner. Error: Ctrl-C, a process died, or nothing arrived for `patience_s`.
  Result<double> frame(const geometry::Camera& camera, double patience_s,
                       const std::function<void(const Progress&)>& watch);

  /// Ends all processes; then the record is complete.
  void finish();

 private:
  explicit Session(const std::string& directory);
  Status start_processes(const std::vector<std::string>& scene_flags, bool own_machines);
  Status join();
  /// Error: Ctrl-C, or a process ended.
  Status alive();
  /// Waits until the master knows `count` living processes of a role.
  Status wait_for(const char* what, const std::string& role, int count);
  int count_joined(const std::string& role);
  void pump(int timeout_ms);
  void take(const net::Message& message);

  std::string directory_;
  launcher::ProcessGroup group_;
  size_t samplers_ = 0;
  std::unique_ptr<launcher::ControlClient> control_;
  net::Context context_;
  std::optional<net::MasterLink> link_;
  std::optional<net::Socket> patches_;
  bool subscribed_ = false;
  RequestId request_;
  Progress progress_;
  double requested_s_ = 0;
};

}  // namespace telesplat::lab
