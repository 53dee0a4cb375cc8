// Adds chunks to a sampler: prepares them in a thread of its own where the sampler can, so that tiles are sampled
// meanwhile.
#pragma once

#include <future>
#include <memory>
#include <utility>
#include <vector>

#include "services/sampler/mesh/sampler.h"

namespace telesplat::sampler {

class ChunkBuilder {
 public:
  explicit ChunkBuilder(std::unique_ptr<Sampler> sampler) : sampler_(std::move(sampler)) {}
  ChunkBuilder(const ChunkBuilder&) = delete;
  ~ChunkBuilder() { drop(); }

  Sampler& sampler() const { return *sampler_; }
  /// A chunk that was added, or refused.
  struct Added {
    ChunkId id;
    uint64_t bytes = 0;  ///< decoded
    Status status;
    double begin_s = 0, end_s = 0;  ///< when it was prepared
  };
  /// Takes chunks.
  void take(std::vector<std::pair<ChunkId, geometry::ChunkBytes>> chunks);
  /// Adds those that are ready.
  std::vector<Added> add();
  /// True if chunks are being prepared.
  bool busy() const { return preparing_.valid(); }
  /// Forgets what was taken and is not added. Waits for the thread.
  void drop();

 private:
  struct Prepared {
    ChunkId id;
    uint64_t bytes;
    Result<Sampler::Add> add;
    double begin_s, end_s;
  };
  struct Waiting {
    ChunkId id;
    uint64_t bytes;
    std::function<Result<Sampler::Add>()> prepare;
  };
  void begin();

  std::unique_ptr<Sampler> sampler_;
  std::vector<Added> added_;
  std::vector<Waiting> waiting_;
  std::future<std::vector<Prepared>> preparing_;  // after the sampler, which it uses
};

}  // namespace telesplat::sampler
