// The part of a volume's data server between its sockets: learns epochs, queues requests, and answers the most urgent
// request first.
#pragma once

#include <deque>
#include <list>
#include <mutex>
#include <optional>
#include <string>
#include <variant>

#include "common/wire/messages.h"
#include "services/data/volume/store.h"

namespace telesplat::data {

inline constexpr size_t kEpochsKept = 8;
inline constexpr size_t kRequestsAPeer = 8;      ///< waiting requests per peer; a newer one replaces the peer's oldest
inline constexpr size_t kRequestsWaiting = 512;  ///< waiting requests of all peers
inline constexpr size_t kProbesWaiting = 64;
inline constexpr int kSlicesAnAnswer = 64;
inline constexpr uint64_t kVoxelsAnAnswer = 768u << 10;  ///< about 3 MB: half a minute at a megabit a second

/// follow() and ask() are for the thread of the sockets, work() for another one.
class VolumeAnswers {
 public:
  /// Only work() uses the store.
  explicit VolumeAnswers(VolumeStore& store);

  /// Learns a session. A new epoch's weights become due. Error: the session shows another volume.
  Status follow(const wire::Welcome& welcome);

  /// A message to send: VoxelData to a peer, SliceWeights (without `data`) to the master.
  struct Reply {
    std::string peer;  ///< empty: the master
    std::string_view type;
    std::string body;
    uint64_t voxels = 0, bytes = 0;  ///< figures of VoxelData
  };

  /// Queues a request, or returns at once why it cannot be answered (unknown epoch, slices of others, too many wait).
  /// Error: the request is not valid.
  Result<std::optional<Reply>> ask(const std::string& peer, const wire::VoxelRequest& request);

  /// Queues the question which surface a ray meets. Error: it is not a ray, the epoch is unknown, too many wait.
  Status probe(const wire::Order& order);

  bool has_work() const;
  /// Does the most urgent work: weights first, then probes, then the request of the earliest round, among these the
  /// oldest. nullopt: no work is left.
  std::optional<Reply> work(InstanceId self);

 private:
  struct Epoch {
    EpochId id;
    int step = 0;
    volume::LevelSet shown;
    std::string transfer;
    volume::TransferFunction function;
    geometry::Clip clip;
    bool weights_due = true;
  };
  struct Waiting {
    std::string peer;
    EpochId epoch;
    int step, begin, end;
    uint64_t round;
    volume::LevelSet have, shown;
  };
  struct Probe {
    uint64_t number;  // the order's
    scene::Probe ray;
    int step;
    volume::TransferFunction function;
    geometry::Clip clip;
  };
  Reply answer(const Probe& probe, InstanceId self);
  const Epoch* epoch(EpochId id) const;  // precondition: mutex_ is held
  std::optional<Reply> weigh(const Epoch& epoch, InstanceId self);
  Reply answer(const Waiting& request);
  double bytes_per_voxel(int step, const volume::LevelSet& shown, const std::vector<uint32_t>& weights);

  VolumeStore& store_;
  const volume::Session session_;
  const int begin_, end_;  // slices of this store
  mutable std::mutex mutex_;
  InstanceId master_;
  std::deque<Epoch> epochs_;    // the newest last
  std::list<Waiting> waiting_;  // in order of arrival
  std::deque<Probe> probes_;
  uint64_t voxels_ = 0, bytes_ = 0;  // encoded so far
};

}  // namespace telesplat::data
