// Tiles of a mesh: fetches chunks from the data server, nearest first, and holds as many as memory allows.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/metrics/recorder.h"
#include "services/sampler/epoch_book.h"
#include "services/sampler/mesh/chunk_builder.h"
#include "services/sampler/mesh/cut.h"
#include "services/sampler/mesh/sampler.h"
#include "services/sampler/retry_clock.h"
#include "services/sampler/tiles/tile_source.h"

namespace telesplat::sampler {

/// Keeps the chunks that a sampler holds and waits for; over its budget, it drops the least recently used ones first.
/// No sockets, no clocks.
class ChunkCache {
 public:
  explicit ChunkCache(uint64_t budget_bytes) : budget_bytes_(budget_bytes) {}

  /// Sets the data set's chunks, in the order of their ids, and forgets everything held before.
  void reset(std::vector<geometry::ChunkInfo> chunks);
  bool known() const { return !chunks_.empty(); }

  /// Chooses what this part of a view is sampled from (choose_cut()); marks what is held of it, and what is above that,
  /// as used. Waiting chunks are missing.
  Cut cut(const geometry::Camera& camera, const geometry::Rect& part);
  /// Returns chunks to fetch before a view asks for them, as far as the budget goes, the coarsest first; but not the
  /// leaves, nor those right above them, unless the sampler is at rest: building them takes processors from views.
  std::vector<ChunkId> prefetch(bool at_rest) const;

  bool held(ChunkId id) const { return held_.contains(id); }
  bool waiting(ChunkId id) const { return waiting_.contains(id); }
  size_t waiting_count() const { return waiting_.size(); }
  void mark_waiting(ChunkId id) { waiting_.insert(id); }
  void forget_waiting() { waiting_.clear(); }
  /// Size of a coded chunk according to the list.
  uint64_t bytes_of(ChunkId id) const;
  uint64_t waiting_bytes() const;
  /// Memory of a chunk: its decoded bytes, and a hierarchy over its triangles (62 bytes each in Embree 3.13).
  static uint64_t memory(uint64_t bytes, uint64_t triangles) { return bytes + 62 * triangles; }
  /// Decoded bytes of chunks that have not come, about.
  static constexpr uint64_t kBytesPerTriangle = 24;
  /// Notes a chunk of this decoded size that came. Returns the chunks to remove to stay within the budget; none that
  /// the last view needs.
  std::vector<ChunkId> insert(ChunkId id, uint64_t bytes);
  /// An answer was not a valid chunk. The chunk stays missing until it was refused kTries times: then views do without
  /// it. True: this was the last time.
  static constexpr int kTries = 3;
  bool refuse(ChunkId id);
  /// Number of chunks that views do without.
  size_t holes() const { return holes_; }

  /// Memory of all chunks that are held.
  uint64_t bytes() const { return bytes_; }
  const std::vector<geometry::ChunkInfo>& chunks() const { return chunks_; }

 private:
  uint64_t budget_bytes_;
  std::vector<geometry::ChunkInfo> chunks_;  // index = id
  struct Held {
    uint64_t use;  // number of the last view that needed it
    uint64_t bytes;
  };
  std::map<ChunkId, Held> held_;  // with holes, of 0 bytes
  std::map<ChunkId, int> refused_;
  std::set<ChunkId> waiting_;
  size_t holes_ = 0;
  uint64_t use_ = 0, bytes_ = 0;
  geometry::Camera used_by_;  // the last view
};

/// Tells how long the tiles of a view wait for chunks before coarser ones stand in for them, and chunks for a view.
class DetailPatience {
 public:
  static constexpr double kPatience_s = 0.04;
  /// Only a session with plans casts again what was sampled from coarser chunks; in others tiles wait.
  void follow(const wire::SessionSettings& s) { plans_ = s.steering && !s.keep_redundant && !s.pictures; }
  /// Returns the time from which this lease is sampled from what is there.
  double until_s(const wire::Lease& lease, double now_s) {
    if (std::exchange(frame_, lease.frame) != lease.frame) since_s_ = now_s;
    return plans_ ? since_s_ + kPatience_s : 1e300;
  }

  /// True once there was no lease for a second: then chunks may be prepared that no view has asked for.
  bool at_rest(bool lease, double now_s) {
    if (lease) leased_s_ = now_s;
    return now_s - leased_s_ > 1;
  }
  void sampled(bool coarse) { coarse_ += coarse; }
  /// Number of tiles that were sampled from coarser chunks.
  uint64_t coarse() const { return coarse_; }

 private:
  FrameId frame_;
  double since_s_ = 0;  // its first lease waits since then
  double leased_s_ = -1e9;
  bool plans_ = true;
  uint64_t coarse_ = 0;
};

/// When the list of chunks is asked for. It is small, or its array is being read: each time it is waited for twice as
/// long.
class ListClock {
 public:
  /// True: it should be asked for now, and is taken to be. broken: what was asked for before may be lost.
  bool ask(bool broken, double now_s);
  void forget() { *this = {}; }

 private:
  double asked_s_ = -1e9, patience_s_ = RetryClock::kLeast_s;
};

class MeshTiles final : public TileSource {
 public:
  /// Keeps references to the context, the link (to ask for more time while chunks are on their way) and the spans.
  MeshTiles(std::unique_ptr<Sampler> sampler, uint64_t cache_bytes, const std::string& service_name,
            net::Context& context, net::MasterLink& link, metrics::SpanRecorder& spans);

  const char* name() const override { return builder_.sampler().name(); }
  void on_welcome(const wire::Welcome& session) override;
  /// True once the list is known: a lease may wait for its chunks, but these come first, so that the earliest tiles
  /// need not wait for the whole mesh.
  bool takes_leases() const override { return cache_.known(); }
  Readiness readiness(const HeldLease& lease, double now_s) override;
  Sampled sample(const HeldLease& lease) override;
  void fetch(const HeldLease* next, double now_s) override;
  std::vector<net::Socket*> sockets() override;
  void receive() override;
  void add_status(net::MasterLink::Values& values) const override;

 private:
  // The look of an epoch.
  struct Look {
    std::string text;   // the fact "colouring"
    std::string array;  // array whose values chunks hold; empty: they hold colours
    std::shared_ptr<const scene::ColourTable> colours;
    bool known = true;      // the texts could be read
    std::string clip_text;  // the fact "clip"
    geometry::Clip clip;
  };
  void learn_look(const wire::Welcome& session);
  void begin_anew();
  void fetch_list(double now_s);
  void extend(const HeldLease& next, double now_s);
  void refuse(ChunkId id, const std::string& why);

  ChunkBuilder builder_;
  ChunkCache cache_;
  std::string service_name_;
  net::Context& context_;
  net::MasterLink& link_;
  metrics::SpanRecorder& spans_;
  std::optional<net::Socket> blocks_;
  std::string endpoint_, content_hash_;
  std::string array_;  // array of the chunks held
  EpochId epoch_;      // newest epoch
  EpochBook<Look> looks_;
  uint64_t chunks_refused_ = 0;
  RetryClock retry_;  // for chunks
  DetailPatience patience_;
  ListClock list_clock_;
  uint64_t failed_before_ = 0;
  bool broken_ = false;  // the connection broke after a request
  double last_extend_s_ = -1e9;
  double progress_s_ = -1e9;  // when the data server last sent something useful
};

}  // namespace telesplat::sampler
