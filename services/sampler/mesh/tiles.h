// Tiles of a mesh: chunks are fetched from the data server, nearest first, and held as far as memory goes.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/metrics/recorder.h"
#include "services/sampler/epoch_book.h"
#include "services/sampler/mesh/sampler.h"
#include "services/sampler/retry_clock.h"
#include "services/sampler/tiles/tile_source.h"

namespace telesplat::sampler {

/// Which chunks a sampler holds, which it waits for, which it lets go: the least recently used ones first when over its
/// budget. No sockets, no clocks.
class ChunkCache {
 public:
  explicit ChunkCache(uint64_t budget_bytes) : budget_bytes_(budget_bytes) {}

  /// The data set's chunks; forgets everything held before.
  void reset(std::vector<geometry::ChunkInfo> chunks);
  bool known() const { return !chunks_.empty(); }

  /// Chunks the view needs and that are not held, nearest first; marks the held ones as used. Waiting ones are
  /// included.
  std::vector<ChunkId> missing(const geometry::Camera& camera);
  /// Chunks worth fetching before any view asks, as far as the budget goes: in order of id.
  std::vector<ChunkId> prefetch() const;

  bool held(ChunkId id) const { return held_.contains(id); }
  bool waiting(ChunkId id) const { return waiting_.contains(id); }
  size_t waiting_count() const { return waiting_.size(); }
  void mark_waiting(ChunkId id) { waiting_.insert(id); }
  void forget_waiting() { waiting_.clear(); }
  /// As the list says.
  uint64_t bytes_of(ChunkId id) const;
  uint64_t waiting_bytes() const;
  /// Takes note of a chunk of this size that came. Returns those to remove to stay within the budget; never one the
  /// last view needs.
  std::vector<ChunkId> insert(ChunkId id, uint64_t bytes);
  /// What came is no chunk. It is missing still, until it was refused kTries times: then views do without it. Returns
  /// whether it was the last time.
  static constexpr int kTries = 3;
  bool refuse(ChunkId id);
  /// Those that views do without.
  size_t holes() const { return holes_; }

  uint64_t bytes() const { return bytes_; }
  const std::vector<geometry::ChunkInfo>& chunks() const { return chunks_; }

 private:
  uint64_t budget_bytes_;
  std::vector<geometry::ChunkInfo> chunks_;  // index = id
  struct Held {
    uint64_t use;  // the last
    uint64_t bytes;
  };
  std::map<ChunkId, Held> held_;  // holes, too: nothing
  std::map<ChunkId, int> refused_;
  std::set<ChunkId> waiting_;
  size_t holes_ = 0;
  uint64_t use_ = 0, bytes_ = 0;
};

class MeshTiles final : public TileSource {
 public:
  /// Keeps references to the context, the link (to ask for more time while chunks are on their way) and the spans.
  MeshTiles(std::unique_ptr<Sampler> sampler, uint64_t cache_bytes, const std::string& service_name,
            net::Context& context, net::MasterLink& link, metrics::SpanRecorder& spans);

  const char* name() const override { return sampler_->name(); }
  void on_welcome(const wire::Welcome& session) override;
  /// A lease may have to wait for its chunks, but then they come first: the earliest tiles need not wait for the whole
  /// mesh.
  bool takes_leases() const override { return cache_.known(); }
  Readiness readiness(const HeldLease& lease, double now_s) override;
  Sampled sample(const HeldLease& lease) override;
  void fetch(const HeldLease* next, double now_s) override;
  std::vector<net::Socket*> sockets() override;
  void receive() override;
  void add_status(net::MasterLink::Values& values) const override;

 private:
  // How an epoch looks.
  struct Look {
    std::string text;   // the fact "colouring"
    std::string array;  // that chunks hold; empty: colours
    std::shared_ptr<const scene::ColourTable> colours;
    bool known = true;      // the texts could be read
    std::string clip_text;  // the fact "clip"
    geometry::Clip clip;
  };
  void learn_look(const wire::Welcome& session);
  size_t missing_count() const;
  void begin_anew();
  void fetch_list(double now_s);
  void extend(const HeldLease& next, double now_s);
  void refuse(ChunkId id, const std::string& why);

  std::unique_ptr<Sampler> sampler_;
  ChunkCache cache_;
  std::string service_name_;
  net::Context& context_;
  net::MasterLink& link_;
  metrics::SpanRecorder& spans_;
  std::optional<net::Socket> blocks_;
  std::string endpoint_, content_hash_;
  std::string array_;  // that the chunks held have
  EpochId epoch_;      // the newest
  EpochBook<Look> looks_;
  bool prefetched_ = false;
  uint64_t chunks_refused_ = 0;
  RetryClock retry_;  // of chunks
  double list_asked_s_ = -1e9, list_patience_s_ = RetryClock::kLeast_s;
  uint64_t failed_before_ = 0;
  bool broken_ = false;  // the connection, since something was asked for
  double last_extend_s_ = -1e9;
  double progress_s_ = -1e9;  // when something came of the data server
};

}  // namespace telesplat::sampler
