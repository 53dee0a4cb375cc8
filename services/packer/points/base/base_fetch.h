// Fetches the list of chunks, and chunks, from the data server.
#pragma once

#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/geometry/chunk_code.h"
#include "common/net/socket.h"
#include "common/wire/tile_messages.h"

namespace telesplat::packer {

class BaseFetch {
 public:
  struct Wanted {
    EpochId epoch;      // requests have it, and answers repeat it
    std::string array;  // that colours the mesh; empty: its own colours
  };
  struct Sinks {
    std::function<void(std::vector<geometry::ChunkInfo>)> list;
    /// Error: it cannot be decoded.
    std::function<void(ChunkId, const Result<geometry::HeldChunk>&)> chunk;
  };

  explicit BaseFetch(net::Context* context) : context_(context) {}

  /// No effect if it is connected there already.
  void connect(const std::string& endpoint);
  /// Begins anew, with the list.
  void begin(Wanted wanted);
  /// Asks for a chunk after those that were wanted before. No effect if it is wanted already.
  void want(ChunkId chunk);
  void stop();
  std::vector<net::Socket*> sockets();
  /// Asks again for what did not come.
  void tick(double now_s);
  /// Takes the data server's answers.
  void receive(const Sinks& sinks);

 private:
  void ask();
  bool asks() const { return wants_list_ || !next_.empty(); }

  net::Context* const context_;
  std::optional<net::Socket> blocks_;
  std::string endpoint_;
  Wanted wanted_;
  bool wants_list_ = false;   // it has not come
  std::deque<ChunkId> next_;  // chunks that have not come; the first one was asked for
  double asked_s_ = -1e9, patience_s_ = 0;
  bool fresh_ = false;  // asked since the last tick()
};

}  // namespace telesplat::packer
