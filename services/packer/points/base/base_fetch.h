// Fetches the chunks of a base from the data server.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/net/socket.h"
#include "common/scene/colouring.h"
#include "common/wire/tile_messages.h"
#include "services/packer/points/base/base.h"

namespace telesplat::packer {

class BaseFetch {
 public:
  struct Wanted {
    EpochId epoch;        // requests have it, and answers repeat it
    std::string array;    // that colours the mesh; empty: its own colours
    uint64_t most = 0;    // triangles
    float largest_m = 0;  // side of the mesh's box
  };

  explicit BaseFetch(net::Context* context) : context_(context) {}

  /// No effect if it is connected there already.
  void connect(const std::string& endpoint);
  /// Begins anew. colours: of the array; null: there is no array. Must outlive the bases made with it.
  void begin(Wanted wanted, const scene::ColourTable* colours);
  void stop();
  std::vector<net::Socket*> sockets();
  /// Asks again for what did not come.
  void tick(double now_s);
  /// Takes the data server's answers. Returns the base once it is whole.
  std::optional<Base> receive();

 private:
  void take(const wire::ChunkList& list);
  void take(const wire::Chunk& chunk);
  void ask();
  void give_up(const std::string& why);

  net::Context* const context_;
  std::optional<net::Socket> blocks_;
  std::string endpoint_;
  Wanted wanted_;
  const scene::ColourTable* colours_ = nullptr;
  bool asks_ = false;              // the data server has yet to answer
  std::optional<Base> made_;       // the base, as far as its chunks have come; nothing: the list has not
  std::vector<ChunkId> next_;      // chunks that have not come, the next one last
  size_t coarse_ = 0;              // chunks of them that are coarse ones: the last ones
  std::vector<float> spacings_m_;  // spacings of all chunks of the mesh
  double asked_s_ = -1e9, patience_s_ = 0;
};

}  // namespace telesplat::packer
