// A pipeline of real processes for benchmarks: master, data server and packer of a Julia set, any number of samplers, and this process
// in the viewer's place.
#pragma once

#include <csignal>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/net/master_link.h"
#include "tools/telesplat/child_process.h"
#include "tools/telesplat/control_client.h"

namespace telesplat::launcher {

class BenchSession {
 public:
  /// scene_flags: as telesplat-data julia takes them. The master records into `directory`, logs go to directory/logs. Returns when data
  /// server and packer have joined. own_machines: samplers stand for machines of their own, so the packer gives way to none of
  /// them; else all have the priorities that `telesplat run` gives them. Error: what failed to start, or took over 20 s, or that Ctrl-C came.
  static Result<std::unique_ptr<BenchSession>> start(const std::vector<std::string>& scene_flags,
                                                     const std::string& directory, bool own_machines);
  ~BenchSession();

  /// Starts samplers with these flags until there are `count`; returns when all of them have joined. Errors as start().
  Status add_samplers(size_t count, const std::vector<std::string>& flags);
  /// kill -9.
  void kill_sampler(size_t index) { samplers_.at(index).signal(SIGKILL); }

  /// What happened to a frame. Rows are those that have arrived here.
  struct Progress {
    double elapsed_s = 0;
    int rows = 0;
    bool complete = false;
  };
  /// Requests a frame and waits until its last patch is here. `watch` is called every 50 ms or sooner. Error: Ctrl-C, a process died that
  /// was not killed with kill_sampler(), or nothing arrived for `patience_s`.
  Result<double> frame(const geometry::Camera& camera, double patience_s, auto&& watch) {
    if (const Status s = request(camera); !s) return s.error();
    while (true) {
      const auto progress = receive(patience_s);
      if (!progress) return progress.error();
      if (progress->complete) return progress->elapsed_s;
      watch(*progress);
    }
  }

  const std::string& directory() const { return directory_; }
  std::optional<nlohmann::json> status() { return ask_status(); }
  /// Ends all processes; the record is complete then.
  void finish();

 private:
  BenchSession() = default;
  Status launch(std::vector<ChildProcess>& into, const std::string& name, const std::string& program,
                std::vector<std::string> arguments, int nice);
  Status wait_for(const char* what, auto condition);
  Status alive();
  std::optional<nlohmann::json> ask_status();
  Status request(const geometry::Camera& camera);
  Result<Progress> receive(double patience_s);
  void pump(int timeout_ms);

  std::string directory_, endpoint_;
  std::vector<ChildProcess> servers_, samplers_;
  net::Context context_;
  std::optional<net::MasterLink> link_;
  std::optional<net::Socket> patches_;
  std::unique_ptr<ControlClient> control_;
  bool subscribed_ = false;
  RequestId request_;
  Progress progress_;
  double requested_s_ = 0, heard_s_ = 0;
};

}  // namespace telesplat::launcher
