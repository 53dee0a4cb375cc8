// A pipeline of real processes for benchmarks: master, data server and packer of a Julia set, any number of samplers,
// and this process in the viewer's place.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/net/master_link.h"
#include "tools/telesplat/bench/processes.h"

namespace telesplat::launcher {

class BenchSession {
 public:
  /// scene_flags: as telesplat-data julia takes them; the rest and errors as BenchProcesses::start(). Returns when data
  /// server and packer have joined.
  static Result<std::unique_ptr<BenchSession>> start(const std::vector<std::string>& scene_flags,
                                                     const std::string& directory, bool own_machines);
  ~BenchSession();

  /// As BenchProcesses has them.
  Status add_samplers(size_t count, const std::vector<std::string>& flags);
  void kill_sampler(size_t index) { processes_->kill_sampler(index); }

  /// What happened to a frame. Rows are those that have arrived here.
  struct Progress {
    double elapsed_s = 0;
    int rows = 0;
    bool complete = false;
  };
  /// Requests a frame and waits until its last patch is here. `watch` is called every 50 ms or sooner. Error: Ctrl-C, a
  /// process died that was not killed with kill_sampler(), or nothing arrived for `patience_s`.
  Result<double> frame(const geometry::Camera& camera, double patience_s, auto&& watch) {
    if (const Status s = request(camera); !s) return s.error();
    while (true) {
      const auto progress = receive(patience_s);
      if (!progress) return progress.error();
      if (progress->complete) return progress->elapsed_s;
      watch(*progress);
    }
  }

  const std::string& directory() const { return processes_->directory(); }
  /// Of the last frame.
  RequestId request() const { return request_; }
  std::optional<nlohmann::json> status() { return processes_->status(); }
  /// Ends all processes; the record is complete then.
  void finish();

 private:
  BenchSession() = default;
  Status request(const geometry::Camera& camera);
  Result<Progress> receive(double patience_s);
  void pump(int timeout_ms);

  std::unique_ptr<BenchProcesses> processes_;
  net::Context context_;
  std::optional<net::MasterLink> link_;
  std::optional<net::Socket> patches_;
  bool subscribed_ = false;
  RequestId request_;
  Progress progress_;
  double requested_s_ = 0, heard_s_ = 0;
};

}  // namespace telesplat::launcher
