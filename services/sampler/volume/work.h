// Works on leases of a volume (T4.5, T5.3): fetches the voxels of its assigned slab, round by round, and splats the
// slab into slice images, one for each layer.
#pragma once

#include <algorithm>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "common/metrics/recorder.h"
#include "common/volume/session.h"
#include "services/sampler/epoch_book.h"
#include "services/sampler/retry_clock.h"
#include "services/sampler/volume/slab_store.h"
#include "services/sampler/work.h"

namespace telesplat::sampler {

class VolumeWork final : public Work {
 public:
  static constexpr uint64_t kAnswerBytes = 3 << 20;  ///< assumed size of an answer before one has come
  static constexpr double kPause_s = 0.05;  ///< a server that does not know the epoch yet is asked again after this
  static constexpr double kExtend_s = 0.1;  ///< between two requests for more time
  static constexpr double kPatience_s = 6;  ///< if no voxels come for longer, leases are not extended any more

  /// Messages to the master.
  struct Master {
    InstanceId instance;  ///< this sampler's
    std::function<void(const wire::SlabReady&)> ready;
    std::function<void(const wire::LeaseExtend&)> extend;
    std::function<double(double)> to_master_s;
  };

  struct Options {
    int threads = 0;           ///< to encode with; 0: one a core
    uint64_t cache_bytes = 0;  ///< for voxels
    std::string service_name;
  };
  /// make: arranges slabs. Keeps references to the context and the spans.
  VolumeWork(MakeSlab make, const Options& options, net::Context& context, Master master, metrics::SpanRecorder& spans);

  const char* name() const override { return "volume"; }
  /// Remembers the epoch's transfer function and step. Logs bad ones once; that epoch's leases are hopeless.
  void on_welcome(const wire::Welcome& session) override;
  bool takes_leases() const override { return !epochs_.empty(); }
  /// Takes slice leases and slab assignments.
  void take(net::Socket& from, const net::Message& message, bool takes_leases, double now_s) override;
  size_t leases() const override { return leases_.size(); }
  void drop_leases() override { leases_.clear(); }
  Readiness look_at_next(double now_s) override;
  Delivery sample_next() override;
  void fetch(double now_s) override;
  std::vector<net::Socket*> sockets() override;
  void receive(double now_s) override;
  void add_status(net::MasterLink::Values& values) const override;

 private:
  struct Epoch {
    std::map<std::string, double> parameters;
    std::string transfer;
    std::string clip_text;  // the fact "clip"
    geometry::Clip clip;
    std::optional<SlabScene> scene;  // nullopt: the parameters are bad
    int step = 0;
    std::vector<volume::LevelColour> colours;  // by level
    volume::LevelSet shown;
  };
  struct Held {
    wire::SliceLease lease;
    double received_s = 0;
    double waits_since_s = 0;  // HeldLease::waits_since_s
  };
  struct Asked {
    VoxelAsk ask;
    uint64_t failed_before = 0;  // Socket::failed_connections()
    double refused_s = 0;        // when a bad answer came; 0: no bad answer came
  };

  Readiness readiness(const Held& held, double now_s);
  static SlabWant want(EpochId epoch, const Epoch& of, int begin, int end);
  std::optional<VoxelAsk> next_ask();
  void ask(double now_s);
  bool overdue(double now_s) const;
  void forget_asked();
  void tell_ready();
  void arrange_ahead();
  void forget_servers();

  SlabStore store_;
  int threads_;
  std::string service_name_;
  net::Context& context_;
  Master master_;
  metrics::SpanRecorder& spans_;
  EpochBook<Epoch> epochs_;
  std::deque<Held> leases_;
  std::map<std::string, net::Socket> servers_;  // by endpoint
  std::optional<Asked> asked_;
  RetryClock retry_;
  uint64_t answer_bytes_ = kAnswerBytes;
  std::pair<uint64_t, EpochId> told_ready_;  // partition and epoch of the last SlabReady
  uint64_t bytes_received_ = 0, bytes_before_ = 0, rejected_ = 0;
  double pause_until_s_ = 0, last_extend_s_ = -1e9, progress_s_ = -1e9;
};

}  // namespace telesplat::sampler
